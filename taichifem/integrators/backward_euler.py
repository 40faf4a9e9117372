"""Backward Euler (slide 10), with one linearisation a step or Newton's method to convergence.

The unknown is dv, the change of the velocity guess v. Linearised about positions x, with x1 = x0 + dt (v + dv):

    (M + dt alpha M + (dt^2 + dt beta) K) dv
        = M (v0 - v) + dt (f_el(x) - K (x0 + dt v - x) + f_ext - alpha M v - beta K v)

The first linearisation takes x = x0 and v = v0: the one-step method. Newton goes on from x = x0 + dt v.
"""

from dataclasses import dataclass

import numpy as np

from taichifem import elements
from taichifem.laws import Laws
from taichifem.linear_algebra import assembly, pcg
from taichifem.processes import contact, holding
from taichifem.runtime import ti
from taichifem.timing import PhaseTimer
from taichifem.world import Counts, World

CONTACT_PASSES = 12
FRICTION_RENEWALS = 2


@dataclass(frozen=True)
class Options:
    """How a step is solved. newton: most linearisations; 1 is the one-step method."""

    tolerance: float
    max_iterations: int
    newton: int = 1
    newton_tolerance: float = 1e-6


@dataclass
class StepReport:
    """What a step took: CG iterations in all, last relative residual, solves for contact, linearisations."""

    iterations: int = 0
    residual: float = 0.0
    converged: bool = True
    contact_passes: int = 0
    linearisations: int = 0


@ti.kernel
def _start(w: ti.template(), n: ti.i32):
    for i in range(n):
        w.x0[i] = w.x[i]
        w.v0[i] = w.v[i]


@ti.kernel
def _load(w: ti.template(), n: ti.i32, dt: ti.f64, gravity: ti.types.vector(3, ti.f64)):
    """Right-hand side of the step without contact and handles."""
    for i in range(n):
        step = ti.cast(dt, w.real)
        w.force[i] = elements.gathered_force(w, i)
        inertia = w.mass[i] * (w.v0[i] - w.v[i])
        outside = w.mass[i] * ti.cast(gravity, w.real) - w.drag[i] * w.v[i]
        w.load[i] = inertia + step * (w.force[i] + outside)


@ti.kernel
def _update(w: ti.template(), n: ti.i32, dt: ti.f64):
    for i in range(n):
        w.v[i] += w.dv[i]
        w.x[i] = w.x0[i] + ti.cast(dt, w.real) * w.v[i]


@ti.kernel
def go_back(w: ti.template(), n: ti.i32):
    """Undo a step that failed."""
    for i in range(n):
        w.x[i] = w.x0[i]
        w.v[i] = w.v0[i]
        w.dv[i] = ti.Vector.zero(w.real, 3)


@ti.kernel
def _forget(w: ti.template(), n: ti.i32):
    for i in range(n):
        w.dv[i] = ti.Vector.zero(w.real, 3)


def advance(
    w: World, counts: Counts, laws: Laws, *, dt: float, gravity: np.ndarray, options: Options, timer: PhaseTimer
) -> StepReport:
    """One step of `dt` [s]: new `w.x`, `w.v`. Poses and colliders must stand where the step ends.

    `w.dv` starts from the last step's, which is close when motion is smooth.
    """
    n = counts.nodes
    report = StepReport()
    weight = float(np.linalg.norm(gravity))
    _start(w, n)
    first_load = 0.0
    for k in range(options.newton):
        with timer.phase("forces"):
            rate = dt if k == 0 else 0.0
            laws.deform(w, counts, stiffness=dt * dt, damping=dt, rate=rate, rate_damping=1.0, keep=True)
            _load(w, n, dt, gravity)
            if k > 0:
                _forget(w, n)
            holding.hold(w, n, counts.held, dt)
        with timer.phase("assembly"):
            assembly.assemble(w, counts.pairs, 1.0, dt)
        done = _solve_with_contact(w, counts, dt, weight, options, timer, report)
        with timer.phase("update"):
            _update(w, n, dt)
        report.linearisations = k + 1
        first_load = first_load or done.load
        if k > 0 and done.load <= max(options.newton_tolerance * first_load, done.noise):
            break
    with timer.phase("contact"):
        if counts.colliders:
            contact.slide(w, n, counts.colliders, dt)
    return report


def _solve_with_contact(
    w: World, counts: Counts, dt: float, weight: float, options: Options, timer: PhaseTimer, report: StepReport
) -> pcg.Convergence:
    """Solve for dv, again while contacts open, close or slip otherwise, and while friction changes."""
    n = counts.nodes
    noise = float(np.finfo(np.float32 if w.precision == "f32" else np.float64).eps) / dt
    renewals = 0
    for passes in range(1, CONTACT_PASSES + 1):
        with timer.phase("contact"):
            changed = _springs(w, counts, dt)
            if passes > 1 and not changed:
                renewals += 1
                if renewals > FRICTION_RENEWALS or not contact.press(w, n, counts.colliders, dt, weight):
                    break
                _springs(w, counts, dt)
        with timer.phase("solve"):
            done = pcg.solve(
                w,
                counts,
                tolerance=options.tolerance,
                max_iterations=options.max_iterations,
                noise=noise,
                weight=weight * dt,
                drag_factor=dt,
            )
        report.iterations += done.iterations
        report.residual, report.converged = done.residual, done.converged
        report.contact_passes = passes
        if not counts.colliders:
            break
    return done


def _springs(w: World, counts: Counts, dt: float) -> int:
    """Handles and contacts for the solution so far; how many contacts changed."""
    holding.clear_springs(w, counts.nodes)
    holding.pull(w, counts.pulled, dt)
    return contact.touch(w, counts.nodes, counts.colliders, dt) if counts.colliders else 0
