"""Backward Euler (slide 10): x1 = x0 + dt v1, v1 = v0 + dt M^-1 f(x1, v1). First order, damps every motion."""

from taichifem.integrators import implicit
from taichifem.integrators.step import Step, StepReport


def advance_once(step: Step) -> StepReport:
    """One step with one linearisation: the real-time default."""
    implicit.start(step.w, step.counts.nodes)
    return implicit.solve(step, h=step.dt, newton=1)


def advance(step: Step) -> StepReport:
    """One step solved by Newton's method."""
    implicit.start(step.w, step.counts.nodes)
    return implicit.solve(step, h=step.dt, newton=step.options.newton)
