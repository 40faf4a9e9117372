"""Conjugate gradients on (A + springs) dv = load + spring_load.

The preconditioner is block Jacobi and, beside it, the rigid motions of aggregates (`coarse`).

Axes that are held keep the dv they start with: their residual is masked out, and the preconditioner is zero
there, so no search direction ever moves them.

The residual is measured against the smaller of two sizes: the impulses that act on the nodes (load, and what springs
give at the current dv), which vanish where a body rests; and the change of momentum and weight, which stay sensible
where a stiff body releases large elastic forces.

Scalars stay on the device in double precision; sums add fixed chunks in order, so that runs repeat bit for bit.
"""

import math
from dataclasses import dataclass

from taichifem.errors import Diverged
from taichifem.linear_algebra import balance, coarse, matrix
from taichifem.linear_algebra.coarse import Coarse
from taichifem.runtime import ti
from taichifem.world import CHUNKS, Counts, World

RZ, RESIDUAL, DONE, COUNT, ALPHA, BETA, LOAD, NOISE, WEIGHT, SIZE, INDEFINITE = range(11)
CHECK_EVERY = 8


@dataclass(frozen=True)
class Convergence:
    """What a solve did: iterations, relative residual reached, whether that met the tolerance.

    load: what the residual was measured against [N s].  noise: what rounding of the forces adds to it.
    definite: False if the matrix turned out to have a negative eigenvalue, and the solve was given up.
    """

    iterations: int
    residual: float
    converged: bool
    load: float
    noise: float
    definite: bool = True


@ti.kernel
def _residual(w: ti.template(), n: ti.i32):
    """Residual of the start `w.dv`, on the axes that are free."""
    for i in range(n):
        w.residual[i] = w.free[i] * (w.load[i] + w.spring_load[i] - matrix.row(w, w.dv, i))


@ti.func
def _inverse_diagonal(w: ti.template(), i: ti.i32):
    """Inverse of the diagonal block over the free axes, zero on the held ones."""
    free = w.free[i]
    d = w.block[w.diagonal[i]] + w.spring[i]
    for a in ti.static(range(3)):
        if free[a] == 0:
            for k in ti.static(range(3)):
                d[a, k] = 0.0
                d[k, a] = 0.0
            d[a, a] = 1.0
    inverse = d.inverse()
    for a in ti.static(range(3)):
        inverse[a, a] *= free[a]
    return inverse


@ti.func
def _impulse(w: ti.template(), i: ti.i32):
    """Squared norm of the impulse on node i: the load, and what the springs give at the current dv."""
    return ti.cast((w.free[i] * (w.load[i] + w.spring_load[i] - w.spring[i] @ w.dv[i])).norm_sqr(), ti.f64)


@ti.func
def _change(w: ti.template(), i: ti.i32):
    """Squared norm of the momentum that dv gives node i."""
    return ti.cast((w.free[i] * w.mass[i] * w.dv[i]).norm_sqr(), ti.f64)


@ti.func
def _judge(w: ti.template(), residual, sprung, change, tolerance):
    """Relative residual, and whether it will do.

    `sprung` is the squared impulse on nodes with springs, `change` the squared change of momentum.
    """
    impulse = ti.sqrt(w.scalar[LOAD] ** 2 + sprung)
    size = ti.max(ti.min(impulse, ti.sqrt(change) + w.scalar[WEIGHT]), w.scalar[NOISE])
    w.scalar[SIZE] = size
    # In single precision a literal below 1e-38 would be zero.
    w.scalar[RESIDUAL] = ti.sqrt(residual) / ti.max(size, 1e-30)
    if ti.sqrt(residual) <= tolerance * size:
        w.scalar[DONE] = 1.0


@ti.kernel
def _begin(w: ti.template(), n: ti.i32, n_coarse: ti.i32, tolerance: ti.f64, noise: ti.f64, weight: ti.f64):
    """Preconditioner, first direction, and the size of load and weight (`weight` is gravity times dt).

    `noise` times the diagonal's size is what rounding leaves of the forces: a right-hand side below that
    is not worth resolving further.
    """
    ti.loop_config(block_dim=1)
    for c in range(CHUNKS):
        sums = ti.Vector.zero(ti.f64, 7)
        for i in range(c * n // CHUNKS, (c + 1) * n // CHUNKS):
            r = w.residual[i]
            w.inverse[i] = _inverse_diagonal(w, i)
            z = w.inverse[i] @ r
            stiff = (w.block[w.diagonal[i]].trace() - 3 * w.mass[i]) * w.free[i].sum() / 9
            floor = ti.cast(noise, ti.f64) * ti.cast(stiff * w.x[i].norm(), ti.f64)
            sums += ti.Vector(
                [
                    ti.cast(r.dot(z), ti.f64),
                    ti.cast(r.dot(r), ti.f64),
                    _impulse(w, i) * (1 - w.sprung[i]),
                    floor**2,
                    _impulse(w, i) * w.sprung[i],
                    _change(w, i),
                    ti.cast(w.mass[i] * w.mass[i] * w.free[i].sum() / 3, ti.f64) * weight * weight,
                ]
            )
        w.partial[c] = sums
    for g in range(n_coarse):
        coarse.restrict(w, g)
    for a in range(6 * n_coarse):
        coarse.solve_row(w, n_coarse, a)
    ti.loop_config(serialize=True)
    for _ in range(1):
        sums = ti.Vector.zero(ti.f64, 7)
        for c in range(CHUNKS):
            sums += w.partial[c]
        w.scalar[RZ] = sums[0] + _coarse_product(w, n_coarse)
        w.scalar[LOAD] = ti.sqrt(sums[2])
        w.scalar[NOISE] = ti.sqrt(sums[3])
        w.scalar[WEIGHT] = ti.sqrt(sums[6])
        w.scalar[DONE] = 0.0
        w.scalar[COUNT] = 0.0
        w.scalar[INDEFINITE] = 0.0
        _judge(w, sums[1], sums[4], sums[5], tolerance)
    for i in range(n):
        w.direction[i] = _preconditioned(w, n_coarse, i)


@ti.func
def _coarse_product(w: ti.template(), n_coarse: ti.i32):
    """What the coarse space adds to r . z; on the way its solution is turned to where the aggregates are."""
    total = ti.cast(0.0, ti.f64)
    for a in range(6 * n_coarse):
        total += ti.cast(w.coarse_residual[a] * w.coarse_solution[a], ti.f64)
    for g in range(n_coarse):
        coarse.prolong(w, g)
    return total


@ti.func
def _preconditioned(w: ti.template(), n_coarse: ti.i32, i: ti.i32):
    z = w.inverse[i] @ w.residual[i]
    if n_coarse > 0:
        z += coarse.correction(w, i)
    return z


@ti.kernel
def _iterate(w: ti.template(), n: ti.i32, n_coarse: ti.i32, tolerance: ti.f64):
    """One iteration; does nothing once the tolerance is met."""
    ti.loop_config(block_dim=1)
    for c in range(CHUNKS):
        if w.scalar[DONE] == 0:
            total = ti.cast(0.0, ti.f64)
            for i in range(c * n // CHUNKS, (c + 1) * n // CHUNKS):
                q = w.free[i] * matrix.row(w, w.direction, i)
                w.product[i] = q
                total += ti.cast(w.direction[i].dot(q), ti.f64)
            w.partial[c][0] = total
    ti.loop_config(serialize=True)
    for _ in range(1):
        total = ti.cast(0.0, ti.f64)
        for c in range(CHUNKS):
            total += w.partial[c][0]
        w.scalar[ALPHA] = w.scalar[RZ] / total if total > 0 else 0.0
        if total < 0 and w.scalar[DONE] == 0:
            w.scalar[INDEFINITE] = 1.0
    ti.loop_config(block_dim=1)
    for c in range(CHUNKS):
        if w.scalar[DONE] == 0:
            alpha = ti.cast(w.scalar[ALPHA], w.real)
            sums = ti.Vector.zero(ti.f64, 4)
            for i in range(c * n // CHUNKS, (c + 1) * n // CHUNKS):
                w.dv[i] += alpha * w.direction[i]
                r = w.residual[i] - alpha * w.product[i]
                w.residual[i] = r
                sums[0] += ti.cast(r.dot(w.inverse[i] @ r), ti.f64)
                sums[1] += ti.cast(r.dot(r), ti.f64)
                if w.sprung[i]:
                    sums[2] += _impulse(w, i)
                sums[3] += _change(w, i)
            for k in ti.static(range(4)):
                w.partial[c][k] = sums[k]
    for g in range(n_coarse):
        if w.scalar[DONE] == 0:
            coarse.restrict(w, g)
    for a in range(6 * n_coarse):
        if w.scalar[DONE] == 0:
            coarse.solve_row(w, n_coarse, a)
    ti.loop_config(serialize=True)
    for _ in range(1):
        if w.scalar[DONE] == 0:
            sums = ti.Vector.zero(ti.f64, 7)
            for c in range(CHUNKS):
                sums += w.partial[c]
            sums[0] += _coarse_product(w, n_coarse)
            w.scalar[BETA] = sums[0] / w.scalar[RZ] if w.scalar[RZ] > 0 else 0.0
            w.scalar[RZ] = sums[0]
            w.scalar[COUNT] += 1
            _judge(w, sums[1], sums[2], sums[3], tolerance)
            # alpha is zero where the matrix is indefinite, or rounding has taken the curvature: going on cannot help.
            if w.scalar[ALPHA] == 0:
                w.scalar[DONE] = 1.0
    for i in range(n):
        if w.scalar[DONE] == 0:
            w.direction[i] = _preconditioned(w, n_coarse, i) + ti.cast(w.scalar[BETA], w.real) * w.direction[i]


def solve(
    w: World,
    counts: Counts,
    space: Coarse,
    *,
    tolerance: float,
    max_iterations: int,
    noise: float,
    weight: float,
    drag_factor: float,
) -> Convergence:
    """Improve `w.dv` until the residual is below `tolerance` times what acts on the nodes.

    w: world with block, spring, load, spring_load, free and the start dv.  space: its coarse space.
    noise: relative rounding error of the forces, over dt.  weight: gravity times dt [m/s].
    drag_factor: of `w.drag` in the matrix.
    Raises Diverged where the residual is not finite.
    """
    n, n_coarse = counts.nodes, space.prepare()
    _residual(w, n)
    balance.translate(w, counts.bodies, drag_factor)
    _begin(w, n, n_coarse, tolerance, noise, weight)
    launched = 0
    while w.scalar[DONE] == 0 and launched < max_iterations and math.isfinite(w.scalar[RESIDUAL]):
        for _ in range(min(CHECK_EVERY, max_iterations - launched)):
            _iterate(w, n, n_coarse, tolerance)
            launched += 1
    balance.translate(w, counts.bodies, drag_factor)
    balance.spin(w, n, counts.bodies, drag_factor)
    residual = float(w.scalar[RESIDUAL])
    space.observe(int(w.scalar[COUNT]))
    if not math.isfinite(residual):
        raise Diverged("the solver met a number that is not finite: take smaller time steps, or start more gently")
    return Convergence(
        int(w.scalar[COUNT]),
        residual,
        residual <= tolerance * (1 + 1e-12),
        float(w.scalar[SIZE]),
        float(w.scalar[NOISE]),
        w.scalar[INDEFINITE] == 0,
    )
