"""Symplectic Euler: v += dt M^-1 f(x), x += dt v, explicit (slide 10). Keeps energy bounded, below a critical step.

Contact and handles act on single nodes, so they are taken implicitly node by node and do not limit the step.
"""

import math

import numpy as np

from taichifem import elements
from taichifem.errors import Diverged
from taichifem.integrators import implicit
from taichifem.integrators.constraints import friction, settle
from taichifem.integrators.step import Step, StepReport
from taichifem.linear_algebra.pcg import Convergence
from taichifem.processes import holding
from taichifem.runtime import ti

SAFETY = 0.9
"""Part of the critical step that is taken where the number of steps is left open."""

LOST = 0
"""Where `w.scalar` says that a number was not finite."""


@ti.kernel
def _load(w: ti.template(), n: ti.i32, dt: ti.f64, gx: ti.f64, gy: ti.f64, gz: ti.f64):
    """Impulses on the nodes, without contact and handles."""
    gravity = ti.Vector([gx, gy, gz])
    for i in range(n):
        w.force[i] = elements.gathered_force(w, i)
        outside = w.mass[i] * ti.cast(gravity, w.real) + w.outside[i] - w.drag[i] * w.v[i]
        w.load[i] = ti.cast(dt, w.real) * (w.force[i] + outside)
    w.scalar[LOST] = 0.0


@ti.kernel
def _solve(w: ti.template(), n: ti.i32):
    """Change of velocity of every node on its own: (m + springs) dv = load, on the axes that are free."""
    for i in range(n):
        A = w.spring[i]
        b = w.load[i] + w.spring_load[i]
        free = w.free[i]
        for k in ti.static(range(3)):
            A[k, k] += w.mass[i]
        if w.sprung[i]:
            b -= A @ ((1 - free) * w.dv[i])
            for k in ti.static(range(3)):
                if free[k] == 0:
                    for j in ti.static(range(3)):
                        A[k, j] = 0.0
                        A[j, k] = 0.0
                    A[k, k] = 1.0
            b = A.inverse() @ (free * b)
        else:
            b /= w.mass[i]
        w.dv[i] = free * b + (1 - free) * w.dv[i]


@ti.kernel
def _update(w: ti.template(), n: ti.i32, dt: ti.f64):
    for i in range(n):
        w.v[i] += w.dv[i]
        w.x[i] = w.base_x[i] + ti.cast(dt, w.real) * w.v[i]
        # Beyond any number a step leads back from; also true of NaN.
        if not w.x[i].norm_sqr() < 1e30:
            w.scalar[LOST] = 1.0


def critical_step(frequency: float, mass_damping: float, stiffness_damping: float) -> float:
    """The longest stable step [s] at the highest angular frequency [1/s]: 2 / omega, less with damping.

    With c = alpha + beta omega^2 the amplification matrix has its eigenvalues inside the unit circle while
    omega^2 dt^2 + 2 c dt < 4.
    """
    if frequency == 0:
        return math.inf
    c = mass_damping + stiffness_damping * frequency**2
    # The root that is written as 4 over a sum loses nothing to cancellation.
    return 4 / (c + math.sqrt(c * c + 4 * frequency**2))


def advance(step: Step) -> StepReport:
    """One explicit step."""
    w, n, dt = step.w, step.counts.nodes, step.dt
    report = StepReport()
    implicit.start(w, n)
    with step.timer.phase("forces"):
        if step.follow is not None:
            step.follow()
        step.laws.push(w, step.counts, damped=step.damped, due=step.take_due())
        _load(w, n, dt, *step.gravity)
        holding.hold(w, n, step.counts.held, dt, dt)

    def solve(_: int, __: float) -> Convergence:
        with step.timer.phase("solve"):
            _solve(w, n)
        return Convergence(0, 0.0, True, 0.0, 0.0)

    settle(step, dt, report, solve, weight=float(np.linalg.norm(step.gravity)))
    with step.timer.phase("update"):
        _update(w, n, dt)
    if w.scalar[LOST]:
        raise Diverged("explicit steps ran away: give more substeps, or leave substeps out")
    friction(step, dt)
    return report
