"""What every integrator is given for one step, and what it reports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from taichifem.laws import Laws
from taichifem.linear_algebra.plan import Plan
from taichifem.processes.riding import Riding
from taichifem.timing import PhaseTimer
from taichifem.world import Counts, World


@dataclass(frozen=True)
class Options:
    """How a step is solved. tolerance: of the linear solver.  newton: most linearisations.

    newton_tolerance: imbalance, relative to the forces at work, at which Newton's method ends.
    """

    tolerance: float
    max_iterations: int
    newton: int = 20
    newton_tolerance: float = 1e-6


@dataclass(frozen=True)
class Iteration:
    """One linearisation of Newton's method: imbalance of the nodes before it, relative; what its solve took;
    and the part of the correction that was made (below 1 where the line search cut it short)."""

    imbalance: float
    iterations: int
    length: float = 1.0


@dataclass
class StepReport:
    """What a step took: CG iterations in all, last relative residual, solves for contact, linearisations.

    converged: did every linear solve meet its tolerance?  balanced: did Newton's method?  history: its iterations.
    """

    iterations: int = 0
    residual: float = 0.0
    converged: bool = True
    contact_passes: int = 0
    linearisations: int = 0
    balanced: bool = True
    history: list[Iteration] = field(default_factory=list)


@dataclass
class Step:
    """A step of `dt` [s]: the world, where its poses and colliders stand at the end of it, and how to solve.

    gravity: (3,) [m/s^2].  plan: of the linear solver; explicit methods need none.
    riding: embedded vertices that meet colliders, where there are any.
    follow: brings loads that follow the surface up to date, where there are any.
    due: time over which plastic flow is due [s]: the last step has moved the nodes, but nothing has flowed since.
    fresh: there is no past step to go on from.  damped: has some material stiffness damping?
    """

    w: World
    counts: Counts
    laws: Laws
    dt: float
    gravity: np.ndarray
    options: Options
    timer: PhaseTimer
    plan: Plan | None
    riding: Riding | None = None
    follow: Callable[[], None] | None = None
    due: float = 0.0
    fresh: bool = True
    damped: bool = True

    def take_due(self) -> float:
        """The time over which plastic flow is due, from then on none."""
        due, self.due = self.due, 0.0
        return due
