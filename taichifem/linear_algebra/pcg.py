"""Conjugate gradients with a block-Jacobi preconditioner, on (A + springs) dv = load + spring_load.

Axes that are held keep the dv they start with: their residual is masked out, and the preconditioner is zero
there, so no search direction ever moves them. Scalars stay on the device in double precision; sums add fixed
chunks in order, so that runs repeat bit for bit.
"""

import math
from dataclasses import dataclass

from taichifem.errors import Diverged
from taichifem.runtime import ti
from taichifem.world import CHUNKS, World

RZ, RR, LIMIT, DONE, COUNT, ALPHA, BETA, LOAD, NOISE = range(9)
CHECK_EVERY = 8


@dataclass(frozen=True)
class Convergence:
    """What a solve did: iterations, relative residual reached, whether that met the tolerance.

    load: norm of the right-hand side [N s].  noise: what rounding of the forces adds to it.
    """

    iterations: int
    residual: float
    converged: bool
    load: float
    noise: float


@ti.func
def _row(w: ti.template(), source: ti.template(), i: ti.i32):
    """Row i of (A + springs) times `source`."""
    total = w.spring[i] @ source[i]
    for k in range(w.row_start[i], w.row_start[i + 1]):
        total += w.block[k] @ source[w.column[k]]
    return total


@ti.kernel
def _begin(w: ti.template(), n: ti.i32, tolerance: ti.f64, noise: ti.f64):
    """Residual of the start `w.dv`, preconditioner, first direction, and the residual norm to reach.

    `noise` times the diagonal's size is what rounding leaves of the forces: a right-hand side below that
    is not worth resolving further.
    """
    ti.loop_config(block_dim=1)
    for c in range(CHUNKS):
        sums = ti.Vector.zero(ti.f64, 4)
        for i in range(c * n // CHUNKS, (c + 1) * n // CHUNKS):
            free = w.free[i]
            b = free * (w.load[i] + w.spring_load[i])
            r = b - free * _row(w, w.dv, i)
            d = w.block[w.diagonal[i]] + w.spring[i]
            stiff = (w.block[w.diagonal[i]].trace() - 3 * w.mass[i]) / 3 * free.sum() / 3
            for a in ti.static(range(3)):
                if free[a] == 0:
                    for k in ti.static(range(3)):
                        d[a, k] = 0.0
                        d[k, a] = 0.0
                    d[a, a] = 1.0
            inverse = d.inverse()
            for a in ti.static(range(3)):
                if free[a] == 0:
                    inverse[a, a] = 0.0
            z = inverse @ r
            w.inverse[i] = inverse
            w.residual[i] = r
            w.direction[i] = z
            floor = ti.cast(noise * stiff, ti.f64) * w.x[i].norm()
            sums += ti.Vector(
                [ti.cast(r.dot(z), ti.f64), ti.cast(r.dot(r), ti.f64), ti.cast(b.dot(b), ti.f64), floor**2]
            )
        w.partial[c] = sums
    ti.loop_config(serialize=True)
    for _ in range(1):
        sums = ti.Vector.zero(ti.f64, 4)
        for c in range(CHUNKS):
            sums += w.partial[c]
        size = ti.max(sums[2], sums[3])
        w.scalar[LOAD] = ti.sqrt(sums[2])
        w.scalar[NOISE] = ti.sqrt(sums[3])
        w.scalar[RZ] = sums[0]
        w.scalar[RR] = ti.sqrt(sums[1] / ti.max(size, 1e-300))
        w.scalar[LIMIT] = tolerance * tolerance * size
        w.scalar[DONE] = 1.0 if sums[1] <= tolerance * tolerance * size else 0.0
        w.scalar[COUNT] = 0.0


@ti.kernel
def _iterate(w: ti.template(), n: ti.i32, tolerance: ti.f64):
    """One iteration; does nothing once the tolerance is met."""
    ti.loop_config(block_dim=1)
    for c in range(CHUNKS):
        if w.scalar[DONE] == 0:
            total = ti.cast(0.0, ti.f64)
            for i in range(c * n // CHUNKS, (c + 1) * n // CHUNKS):
                q = w.free[i] * _row(w, w.direction, i)
                w.product[i] = q
                total += ti.cast(w.direction[i].dot(q), ti.f64)
            w.partial[c][0] = total
    ti.loop_config(serialize=True)
    for _ in range(1):
        total = ti.cast(0.0, ti.f64)
        for c in range(CHUNKS):
            total += w.partial[c][0]
        w.scalar[ALPHA] = w.scalar[RZ] / total if total > 0 else 0.0
    ti.loop_config(block_dim=1)
    for c in range(CHUNKS):
        if w.scalar[DONE] == 0:
            alpha = ti.cast(w.scalar[ALPHA], w.real)
            sums = ti.Vector.zero(ti.f64, 2)
            for i in range(c * n // CHUNKS, (c + 1) * n // CHUNKS):
                w.dv[i] += alpha * w.direction[i]
                r = w.residual[i] - alpha * w.product[i]
                w.residual[i] = r
                sums += ti.Vector([ti.cast(r.dot(w.inverse[i] @ r), ti.f64), ti.cast(r.dot(r), ti.f64)])
            w.partial[c][0] = sums[0]
            w.partial[c][1] = sums[1]
    ti.loop_config(serialize=True)
    for _ in range(1):
        if w.scalar[DONE] == 0:
            rz, rr = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
            for c in range(CHUNKS):
                rz += w.partial[c][0]
                rr += w.partial[c][1]
            w.scalar[BETA] = rz / w.scalar[RZ] if w.scalar[RZ] > 0 else 0.0
            w.scalar[RZ] = rz
            w.scalar[COUNT] += 1
            w.scalar[RR] = tolerance * ti.sqrt(rr / ti.max(w.scalar[LIMIT], 1e-300))
            # alpha is zero only when rounding has taken the curvature: more iterations cannot help.
            if rr <= w.scalar[LIMIT] or w.scalar[ALPHA] == 0:
                w.scalar[DONE] = 1.0
    for i in range(n):
        if w.scalar[DONE] == 0:
            w.direction[i] = w.inverse[i] @ w.residual[i] + ti.cast(w.scalar[BETA], w.real) * w.direction[i]


def solve(w: World, n: int, *, tolerance: float, max_iterations: int, noise: float) -> Convergence:
    """Improve `w.dv` until the residual is below `tolerance` times the right-hand side.

    w: world with block, spring, load, spring_load, free and the start dv.  n: nodes in use.
    noise: relative rounding error of the forces, over dt.
    Raises Diverged where the residual is not finite.
    """
    _begin(w, n, tolerance, noise)
    launched = 0
    while w.scalar[DONE] == 0 and launched < max_iterations and math.isfinite(w.scalar[RR]):
        for _ in range(min(CHECK_EVERY, max_iterations - launched)):
            _iterate(w, n, tolerance)
            launched += 1
    residual = float(w.scalar[RR])
    if not math.isfinite(residual):
        raise Diverged("the solver met a number that is not finite: take smaller time steps, or start more gently")
    return Convergence(
        int(w.scalar[COUNT]),
        residual,
        residual <= tolerance * (1 + 1e-12),
        float(w.scalar[LOAD]),
        float(w.scalar[NOISE]),
    )
