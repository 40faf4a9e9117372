"""Conjugate gradients on (A + springs) dv = load + spring_load, preconditioned by a cycle over levels (`multilevel`).

Axes that are held keep the dv they start with: their residual is masked out, and the preconditioner is zero
there, so no search direction ever moves them.

The residual is measured against the smaller of two sizes: the impulses that act on the nodes (load, and what springs
give at the current dv), which vanish where a body rests; and the change of momentum and weight, which stay sensible
where a stiff body releases large elastic forces.

Scalars stay on the device in double precision; sums add fixed pieces in order, so that runs repeat bit for bit.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from taichifem.errors import Diverged
from taichifem.linear_algebra import balance, crew, steps
from taichifem.linear_algebra.guess import guess
from taichifem.linear_algebra.plan import Plan
from taichifem.linear_algebra.program import READY, Program
from taichifem.linear_algebra.steps import COUNT, DONE, INDEFINITE, NOISE, RESIDUAL, RZ, SIZE, Limits
from taichifem.world import MOST_TURNS, Counts, World

ROUNDS = 40
"""Iterations in one launch at most: in between, one can look whether numbers are still finite."""


IDLE = 120
"""Iterations that do not halve the residual: then the levels are left out."""


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


def solve(
    w: World,
    counts: Counts,
    plan: Plan,
    *,
    tolerance: float,
    max_iterations: int,
    noise: float,
    weight: float,
    drag_factor: float,
    guessed: bool = False,
    springs_only: bool = False,
) -> Convergence:
    """Improve `w.dv` until the residual is below `tolerance` times what acts on the nodes.

    plan: of the matrix.
    w: world with own, block, spring, load, spring_load, free and the start dv.
    noise: relative rounding error of the forces, over dt.  weight: gravity times dt [m/s].
    drag_factor: of `w.drag` in the matrix.
    guessed: start from what the last steps did (`guess`), not from `w.dv`.
    springs_only: of the matrix, nothing but `w.spring` has changed since the last solve.
    Raises Diverged where the residual is not finite.
    """
    n, flying = counts.nodes, counts.bodies if counts.flying else 0
    galerkin, program = plan.galerkin, plan.program
    limits = Limits(tolerance, max_iterations, noise, weight)
    if galerkin is not None and not springs_only:
        galerkin.renew(w)
    ready = 0
    if guessed or flying:
        # This goes between the operations.
        crew.run(w, n, program.operations, limits, opening=(0, 1 if guessed else READY))
        ready = READY
        if guessed:
            guess(w, n, counts.pieces)
        if flying:
            balance.translate(w, flying, drag_factor)
    spent = 0
    told, helped = None, False
    if galerkin is not None:
        told, helped = _iterate(w, n, program, limits, ready, plain=False)
        if not helped:
            spent, ready = int(told[COUNT]), 0
            limits = replace(limits, most=max(max_iterations - spent, 1))
    if not helped:
        told, _ = _iterate(w, n, program, limits, ready, plain=True)
    if flying:
        balance.translate(w, flying, drag_factor)
        balance.spin(w, n, counts.pieces, flying, drag_factor)
    residual = float(told[RESIDUAL])
    if not math.isfinite(residual):
        raise Diverged("the solver met a number that is not finite: take smaller time steps, or start more gently")
    return Convergence(
        spent + int(told[COUNT]),
        residual,
        residual <= tolerance * (1 + 1e-12),
        float(told[SIZE]),
        float(told[NOISE]),
        bool(told[INDEFINITE] == 0),
    )


def _iterate(w: World, n: int, program: Program, limits: Limits, ready: int, *, plain: bool) -> tuple[np.ndarray, bool]:
    """Make ready, but for the first `ready` operations, and go on until the solve is done.

    Gives the numbers that tell of it (`steps.told`), and False if the levels do not help: then it can be done without.
    Splinters may be so stiff and light that single precision leaves nothing of the matrices of their rigid motions.
    """
    begin, end = (program.plain, len(program.operations)) if plain else (program.cycle, program.plain)
    opening = (ready, READY if plain else program.cycle)
    rounds, idle, best = min(ROUNDS, (MOST_TURNS - opening[1]) // (end - begin)), 0, math.inf
    while True:
        crew.run(w, n, program.operations, limits, opening=opening, repeated=(begin, end), rounds=rounds)
        opening, told = (0, 0), steps.told(w)
        residual = told[RESIDUAL]
        if not plain and told[RZ] < 0:
            return told, False
        if told[DONE] or not math.isfinite(residual):
            return told, True
        idle = idle + rounds if residual > 0.5 * best else 0
        best = min(best, residual)
        if idle >= IDLE and not plain:
            return told, False
