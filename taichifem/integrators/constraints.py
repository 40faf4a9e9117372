"""Contact and handles within a step: springs on single nodes, solved again while contacts open, close or slip."""

from __future__ import annotations

from collections.abc import Callable

from taichifem import meeting_elements
from taichifem.integrators.step import Step, StepReport
from taichifem.linear_algebra.pcg import Convergence
from taichifem.processes import contact, holding

CONTACT_PASSES = 8
FRICTION_RENEWALS = 2

TOLERANCE = 0.03
"""Relative error of the forces of contacts, root mean square, at which they count as settled."""

SLACK = 100.0
"""Times the tolerance of the linear solver: enough to tell which contacts open and close; the last solve has none."""


def settle(
    step: Step, h: float, report: StepReport, solve: Callable[[int, float], Convergence], *, weight: float
) -> Convergence:
    """Solve for `w.dv`, again while contacts change, and while friction does.

    solve: given the number of the pass and its slack.
    weight: [m/s^2] a force of this times the mass counts as one that matters.
    """
    colliders = step.counts.colliders
    renewals, slack = 0, SLACK if colliders else 1.0
    if step.riding is not None:
        step.riding.begin()
    for passes in range(1, CONTACT_PASSES + 1):
        with step.timer.phase("contact"):
            excess = springs(step, h, weight)
            if passes > 1 and excess <= 0:
                renewals += 1
                if renewals > FRICTION_RENEWALS or _press(step, h, weight) <= 0:
                    if slack == 1:
                        break
                    slack = 1.0
                springs(step, h, weight)
            if passes == CONTACT_PASSES:
                slack = 1.0
        done = solve(passes, slack)
        report.iterations += done.iterations
        report.residual = done.residual
        report.converged &= done.converged or slack > 1
        report.contact_passes = passes
        if not colliders:
            break
    return done


def springs(step: Step, h: float, weight: float = 0.0) -> int:
    """Handles and contacts for the solution so far; the excess of error of those of the last call."""
    w, counts = step.w, step.counts
    acting = bool(counts.pulled or counts.colliders or counts.meetings)
    if not (acting or counts.sprung):
        return 0
    counts.sprung = acting
    excess = 0
    if counts.colliders:
        excess += contact.touch(w, counts.nodes, counts.colliders, h, step.dt, weight, TOLERANCE)
    else:
        holding.clear_springs(w, counts.nodes)
    if counts.pulled:
        holding.pull(w, counts.pulled, h)
    if counts.meetings:
        meeting_elements.push(w, counts.meetings, h)
    if step.riding is not None:
        excess += step.riding.touch(w, counts, h, step.dt, weight, TOLERANCE)
    return excess


def _press(step: Step, h: float, weight: float) -> int:
    """Renew the normal forces that limit friction; the excess of their error."""
    excess = contact.press(step.w, step.counts.nodes, step.counts.colliders, h, step.dt, weight, TOLERANCE)
    if step.riding is not None:
        excess += step.riding.press(step.w, step.counts, h, step.dt, weight, TOLERANCE)
    return excess


def friction(step: Step, h: float) -> None:
    """At the end of a step: what sticks, and by how much its springs are stretched."""
    with step.timer.phase("contact"):
        if step.counts.colliders:
            contact.slide(step.w, step.counts.nodes, step.counts.colliders, h, step.dt)
        if step.riding is not None:
            step.riding.slide(step.w, step.counts, h, step.dt)
