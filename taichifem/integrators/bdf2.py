"""BDF2: second order, damps only what the step does not resolve (Hairer & Wanner, Solving ODEs II, V.1).

x1 = (4 x0 - x_before + 2 dt v1) / 3 and the same for v: an implicit step with h = 2 dt / 3. The first step, which has
no step before it, is one of backward Euler.
"""

from taichifem.integrators import implicit
from taichifem.integrators.step import Step, StepReport
from taichifem.runtime import ti


@ti.kernel
def _extrapolate(w: ti.template(), n: ti.i32):
    """The base, from the last step and the one before it."""
    for i in range(n):
        # Differences first: positions are large and their changes small.
        w.base_x[i] = w.x[i] + (w.x[i] - w.past_x[i]) / 3
        w.base_v[i] = w.v[i] + (w.v[i] - w.past_v[i]) / 3


@ti.kernel
def _remember(w: ti.template(), n: ti.i32):
    for i in range(n):
        w.past_x[i] = w.x0[i]
        w.past_v[i] = w.v0[i]


def advance(step: Step) -> StepReport:
    """One step, solved by Newton's method."""
    w, n = step.w, step.counts.nodes
    implicit.start(w, n)
    if not step.fresh:
        _extrapolate(w, n)
    h = step.dt if step.fresh else 2 * step.dt / 3
    report = implicit.solve(step, h=h, newton=step.options.newton)
    _remember(w, n)
    return report
