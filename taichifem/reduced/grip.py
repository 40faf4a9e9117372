"""What hands do to a reduced body in a step: nodes that they hold or pull, and nodes that they strike."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

DENT = 0.3
"""Seconds that a poke of a body without inertia takes: it gives way, and comes back."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Grip:
    """held (h,) nodes of the body, wanted at targets (h,3) [m], by springs that give way by softness (h,) [m/N]; 0 is
    firm.  pushed (p,) nodes, and the forces (p,3) [N] on them over the step."""

    held: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    targets: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    softness: np.ndarray = field(default_factory=lambda: np.zeros(0))
    pushed: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    forces: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))


NOTHING = Grip()


@dataclass(frozen=True, eq=False)
class Poke:
    """An impulse (3,) [N s] on nodes (p,) that is given from `begin` [s] on, over `span` [s]."""

    nodes: np.ndarray
    impulse: np.ndarray
    begin: float
    span: float

    def force(self, time: float, dt: float) -> np.ndarray:
        """Mean of the force (3,) [N] over the step from `time` to `time` + dt [s]."""
        return (self._given(time + dt) - self._given(time)) / dt * self.impulse

    def _given(self, time: float) -> float:
        """Share of the impulse given up to `time`: the force rises and falls as a squared sine."""
        s = min(max((time - self.begin) / self.span, 0.0), 1.0)
        return s - math.sin(2 * math.pi * s) / (2 * math.pi)
