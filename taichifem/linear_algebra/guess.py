"""Where a solve starts: at the best combination of what the last steps did (Fischer 1998, CMAME 163).

Motion goes on, so what the next step adds to the velocities lies close to the span V of what the last ones added.
Of all V c, the one nearest to the solution, in the energy norm of the matrix A, solves V^T A V c = V^T (b - A h),
where h is what held axes will do. It costs one product with the matrix, of a few columns at once.

Kept are not the changes but their differences backwards in time, new, new - last, and so on: they span the same, and
lose less of it to rounding.
"""

from taichifem.linear_algebra import matrix, steps
from taichifem.runtime import ti
from taichifem.world import MEMORY, PIECES, World

TINY = {"f32": 1e-5, "f64": 1e-10}
"""A column with less than this of its size beyond the span of those before it says nothing but rounding."""


@ti.func
def remember(w: ti.template(), i: ti.i32):
    """Of node i, what the step from `w.v0` to `w.v` added, and the differences to the steps before: columns 1 on."""
    new = w.v[i] - w.v0[i]
    for k in ti.static(range(1, MEMORY + 1)):
        for a in ti.static(range(3)):
            old = w.past[i][a, k]
            w.past[i][a, k] = new[a]
            new[a] -= old


@ti.func
def recall(w: ti.template(), i: ti.i32):
    """A first idea of dv, before there is a matrix: the step does what the last one did."""
    return ti.Vector([w.past[i][a, 1] for a in ti.static(range(3))])


@ti.kernel
def _mask(w: ti.template(), n: ti.i32):
    """Column 0 is what held axes will do; from what they did nothing follows."""
    ti.loop_config(serialize=ti.static(w.alone(15)))
    for i in range(n):
        for a in ti.static(range(3)):
            w.past[i][a, 0] = (1 - w.free[i][a]) * w.dv[i][a]
            for k in ti.static(range(1, MEMORY + 1)):
                w.past[i][a, k] = w.free[i][a] * w.past[i][a, k]


@ti.func
def _eliminate(w: ti.template(), tiny: ti.f64):
    """Solve for `w.share` by Gauss's elimination in the last row of `w.gram`."""
    for k in range(MEMORY):
        for j in range(k):
            w.gram[PIECES, k, j] = w.gram[PIECES, j, k]
        w.share[k + 1] = w.gram[PIECES, k, k]
    for k in range(MEMORY):
        pivot = w.gram[PIECES, k, k]
        w.share[k + 1] = 1.0 if pivot > tiny * w.share[k + 1] else 0.0
        if w.share[k + 1] > 0:
            for i in range(k + 1, MEMORY):
                factor = w.gram[PIECES, i, k] / pivot
                for j in range(k, MEMORY + 1):
                    w.gram[PIECES, i, j] -= factor * w.gram[PIECES, k, j]
    for back in range(MEMORY):
        k = MEMORY - 1 - back
        if w.share[k + 1] > 0:
            total = w.gram[PIECES, k, MEMORY]
            for j in range(k + 1, MEMORY):
                total -= w.gram[PIECES, k, j] * w.share[j + 1]
            w.share[k + 1] = total / w.gram[PIECES, k, k]


@ti.kernel
def _project(w: ti.template(), n: ti.i32, pieces: ti.i32, tiny: ti.f64):
    """The products of the matrix with all columns; V^T A V and V^T (b - A h); the shares c."""
    ti.loop_config(block_dim=1)
    for c in range(pieces):
        first, last = steps.range_of(n, c, pieces)
        matrix.multiply(w, w.past, w.image, first, last)
        sums = ti.Matrix.zero(ti.f64, MEMORY, MEMORY + 1)
        for i in range(first, last):
            left = w.load[i] + w.spring_load[i]
            for a, k in ti.static(ti.ndrange(3, MEMORY)):
                v = ti.cast(w.past[i][a, k + 1], ti.f64)
                sums[k, MEMORY] += v * ti.cast(left[a] - w.image[i][a, 0], ti.f64)
                for j in ti.static(range(k, MEMORY)):
                    sums[k, j] += v * ti.cast(w.image[i][a, j + 1], ti.f64)
        for k in ti.static(range(MEMORY)):
            for j in ti.static(range(k, MEMORY + 1)):
                w.gram[c, k, j] = sums[k, j]
    ti.loop_config(serialize=True)
    for _ in range(1):
        for k in range(MEMORY):
            for j in range(k, MEMORY + 1):
                total = ti.cast(0.0, ti.f64)
                for c in range(pieces):
                    total += w.gram[c, k, j]
                w.gram[PIECES, k, j] = total
        _eliminate(w, tiny)


@ti.kernel
def _combine(w: ti.template(), n: ti.i32):
    """dv, and the residual that is left of the load."""
    ti.loop_config(serialize=ti.static(w.alone(30)))
    for i in range(n):
        dv, product = ti.Vector.zero(w.real, 3), ti.Vector.zero(w.real, 3)
        for a in ti.static(range(3)):
            dv[a], product[a] = w.past[i][a, 0], w.image[i][a, 0]
            for k in ti.static(range(1, MEMORY + 1)):
                share = ti.cast(w.share[k], w.real)
                dv[a] += share * w.past[i][a, k]
                product[a] += share * w.image[i][a, k]
        w.dv[i] = dv
        steps.leave(w, i, product)


def guess(w: World, n: int, pieces: int) -> None:
    """Set `w.dv`, on the free axes, and the residual. The matrix must be complete."""
    _mask(w, n)
    _project(w, n, pieces, TINY[w.precision])
    _combine(w, n)
