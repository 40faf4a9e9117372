"""Quasi-static: every step is the balance of forces under the loads, pins and handles of its end. No inertia.

Velocities are those that lead from one balance to the next.
"""

from taichifem.integrators import implicit
from taichifem.integrators.step import Step, StepReport
from taichifem.runtime import ti


@ti.kernel
def _rest(w: ti.template(), n: ti.i32):
    """Nothing moves yet: the unknown is the displacement over dt."""
    for i in range(n):
        w.v[i] = ti.Vector.zero(w.real, 3)
        w.dv[i] = ti.Vector.zero(w.real, 3)


def advance(step: Step) -> StepReport:
    """One static solve by Newton's method, from the last balance."""
    w, n = step.w, step.counts.nodes
    implicit.start(w, n)
    _rest(w, n)
    return implicit.solve(step, h=step.dt, newton=step.options.newton, inertia=False)
