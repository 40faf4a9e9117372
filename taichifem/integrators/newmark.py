"""Newmark's method with beta = 1/4 and gamma = 1/2, the trapezoidal rule (Newmark 1959): second order, no damping.

x1 = x0 + dt (v0 + v1) / 2 and v1 = v0 + dt (a0 + a1) / 2: an implicit step with h = dt / 2. What it does not damp it
carries on, contact's jolts included: backward Euler and BDF2 suit contact better.
"""

from taichifem import elements
from taichifem.integrators import implicit
from taichifem.integrators.step import Step, StepReport
from taichifem.runtime import ti


@ti.kernel
def _accelerate(w: ti.template(), n: ti.i32, gx: ti.f64, gy: ti.f64, gz: ti.f64):
    """Acceleration at the start, kept in `w.past_v` [m/s^2]."""
    gravity = ti.Vector([gx, gy, gz])
    for i in range(n):
        force = elements.gathered_force(w, i) + w.outside[i] - w.drag[i] * w.v[i]
        w.past_v[i] = force / w.mass[i] + ti.cast(gravity, w.real)


@ti.kernel
def _half_way(w: ti.template(), n: ti.i32, h: ti.f64):
    """The base: the first half of the step with what is known at its start."""
    for i in range(n):
        w.base_x[i] = w.x[i] + ti.cast(h, w.real) * w.v[i]
        w.base_v[i] = w.v[i] + ti.cast(h, w.real) * w.past_v[i]


@ti.kernel
def _remember(w: ti.template(), n: ti.i32, h: ti.f64):
    for i in range(n):
        # What is held goes as it is told: its jerks would swing on in it, and burst out where it is let go.
        w.past_v[i] = w.free[i] * (w.v[i] - w.base_v[i]) / ti.cast(h, w.real)


def advance(step: Step) -> StepReport:
    """One step, solved by Newton's method."""
    w, n, h = step.w, step.counts.nodes, 0.5 * step.dt
    implicit.start(w, n)
    if step.fresh:
        if step.follow is not None:
            step.follow()
        step.laws.deform(w, step.counts, stiffness=0.0, rate_damping=1.0, due=step.take_due(), keep=True)
        _accelerate(w, n, *step.gravity)
    _half_way(w, n, h)
    report = implicit.solve(step, h=h, newton=step.options.newton)
    _remember(w, n, h)
    return report
