"""The steps of conjugate gradients: what each does to a node, and what follows from the sums."""

from dataclasses import dataclass

import numpy as np

from taichifem.linear_algebra import multilevel
from taichifem.runtime import ti
from taichifem.world import World

RZ, RESIDUAL, DONE, COUNT, ALPHA, BETA, LOAD, NOISE, WEIGHT, SIZE, INDEFINITE = range(11)
"""Places in `World.scalar`, the last one last."""


@dataclass(frozen=True)
class Limits:
    """When a solve ends: relative residual, and iterations at most; `noise` and `weight` are those of `pcg.solve`."""

    tolerance: float
    most: int
    noise: float = 0.0
    weight: float = 0.0


@ti.func
def _inverse_diagonal(w: ti.template(), i: ti.i32, d):
    """Inverse of the diagonal block over the free axes, zero on the held ones."""
    free = w.free[i]
    for a in ti.static(range(3)):
        if free[a] == 0:
            for k in ti.static(range(3)):
                d[a, k] = 0.0
                d[k, a] = 0.0
            d[a, a] = 1.0
    # In double precision: a stiff contact on a light node leaves little that is positive in single.
    inverse = ti.cast(ti.cast(d, ti.f64).inverse(), w.real)
    for a in ti.static(range(3)):
        inverse[a, a] *= free[a]
    return inverse


@ti.func
def _impulse(w: ti.template(), i: ti.i32):
    """Squared norm of the impulse on node i: the load, and what the springs give at the current dv."""
    return ti.cast((w.free[i] * (w.load[i] + w.spring_load[i] - w.spring[i] @ w.dv[i])).norm_sqr(), ti.f64)


@ti.func
def total(w: ti.template(), pieces: ti.i32):
    """Sums of the pieces, in order."""
    sums = ti.Vector.zero(ti.f64, 3)
    for c in range(pieces):
        for k in ti.static(range(3)):
            sums[k] += w.partial[c][k]
    return sums


@ti.func
def range_of(items: ti.i32, c: ti.i32, pieces: ti.i32):
    """Beginning and end of piece c of the items."""
    size, more = items // pieces, items % pieces
    first = c * size + ti.min(c, more)
    return first, first + size + ti.cast(c < more, ti.i32)


@ti.func
def prepare(w: ti.template(), i: ti.i32, noise: ti.f64):
    """The matrix's diagonal. Squares: load, what rounding leaves of it, mass.

    `noise` times the diagonal's size is what rounding leaves of the forces: a right-hand side below that
    is not worth resolving further.
    """
    d = w.own[i] + w.spring[i]
    w.block[w.diagonal[i]] = d
    w.inverse[i] = _inverse_diagonal(w, i, d)
    stiff = (d.trace() - 3 * w.mass[i]) * w.free[i].sum() / 9
    floor = noise * ti.cast(stiff * w.x[i].norm(), ti.f64)
    load = _impulse(w, i) * (1 - w.sprung[i])
    return ti.Vector([load, floor**2, ti.cast(w.mass[i] * w.mass[i] * w.free[i].sum() / 3, ti.f64)])


@ti.func
def after_prepare(w: ti.template(), pieces: ti.i32, weight: ti.f64):
    """The size of load and weight (`weight` is gravity times dt); nothing is done yet."""
    sums = total(w, pieces)
    w.scalar[LOAD] = ti.sqrt(sums[0])
    w.scalar[NOISE] = ti.sqrt(sums[1])
    w.scalar[WEIGHT] = ti.sqrt(sums[2]) * weight
    w.scalar[ALPHA] = 0.0
    w.scalar[RZ] = 0.0
    w.scalar[COUNT] = -1.0
    w.scalar[INDEFINITE] = 0.0


@ti.func
def leave(w: ti.template(), i: ti.i32, product):
    """The residual of node i, given its row of A dv; and no direction yet."""
    w.residual[i] = w.free[i] * (w.load[i] + w.spring_load[i] - product)
    w.product[i] = ti.Vector.zero(w.real, 3)
    w.direction[i] = ti.Vector.zero(w.real, 3)


@ti.func
def advance(w: ti.template(), i: ti.i32, alpha):
    """Go on, and smooth a first time. Squares: residual, impulse of springs, change of momentum."""
    w.dv[i] = w.dv[i] + alpha * w.direction[i]
    r = w.residual[i] - alpha * w.product[i]
    w.residual[i] = r
    w.z[i] = ti.cast(multilevel.WEIGHT, w.real) * (w.inverse[i] @ r)
    sprung = ti.cast(0.0, ti.f64)
    if w.sprung[i]:
        sprung = _impulse(w, i)
    change = (w.free[i] * w.mass[i] * w.dv[i]).norm_sqr()
    return ti.Vector([ti.cast(r.dot(r), ti.f64), sprung, ti.cast(change, ti.f64)])


@ti.func
def after_advance(w: ti.template(), pieces: ti.i32, tolerance: ti.f64, most: ti.i32):
    """Relative residual, and whether it will do."""
    sums = total(w, pieces)
    impulse = ti.sqrt(w.scalar[LOAD] ** 2 + sums[1])
    size = ti.max(ti.min(impulse, ti.sqrt(sums[2]) + w.scalar[WEIGHT]), w.scalar[NOISE])
    count = w.scalar[COUNT] + 1
    w.scalar[COUNT] = count
    w.scalar[SIZE] = size
    # In single precision a literal below 1e-38 would be zero.
    w.scalar[RESIDUAL] = ti.sqrt(sums[0]) / ti.max(size, 1e-30)
    finite = sums[0] >= 0 and sums[0] < 1e300
    # alpha is zero where the matrix is indefinite, or rounding has taken the curvature: going on cannot help.
    if ti.sqrt(sums[0]) <= tolerance * size or count >= most or (count > 0 and w.scalar[ALPHA] == 0) or not finite:
        w.scalar[DONE] = 1.0


@ti.func
def after_cycle(w: ti.template(), pieces: ti.i32):
    rz = total(w, pieces)[0]
    w.scalar[BETA] = rz / w.scalar[RZ] if w.scalar[RZ] > 0 else 0.0
    w.scalar[RZ] = rz


@ti.func
def after_product(w: ti.template(), pieces: ti.i32):
    curvature = total(w, pieces)[0]
    w.scalar[ALPHA] = w.scalar[RZ] / curvature if curvature > 0 and w.scalar[RZ] > 0 else 0.0
    if curvature < 0 or w.scalar[RZ] < 0:
        w.scalar[INDEFINITE] = 1.0


@ti.kernel
def _tell(w: ti.template(), numbers: ti.types.ndarray(ndim=1)):
    ti.loop_config(serialize=True)
    for k in range(numbers.shape[0]):
        numbers[k] = w.scalar[k]


def told(w: World) -> np.ndarray:
    """The numbers in `World.scalar`, all at once: to ask for one takes as long."""
    numbers = np.empty(INDEFINITE + 1)
    _tell(w, numbers)
    return numbers
