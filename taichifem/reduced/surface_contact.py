"""Contact of a body that is known by its surface: the points that touch, and what pushes them."""

from __future__ import annotations

import numpy as np

from taichifem.reduced.active_set import balanced_forces
from taichifem.reduced.answer import Answer
from taichifem.reduced.contact import frames_of
from taichifem.reduced.obstacles import Obstacles

PASSES = 12
PRECISE = 1e-5
"""Of the body's extent: error of a gap that another pass is made for. Colliders are curved, and frames follow them."""

FIRM = 0.01
"""Squared share of a normal that lies along axes which give way: with less, pins or hands hold the point against it."""


class SurfaceContact:
    """The contacts of one body: points (m,), the colliders `which` (m,), and the forces `pushed` (m,3) [N]."""

    def __init__(self, rest: np.ndarray) -> None:
        self._rest, self._precise = rest, PRECISE * float(np.ptp(rest, axis=0).max())
        self.points, self.which = np.zeros(0, dtype=int), np.zeros(0, dtype=int)
        self.pushed = np.zeros((0, 3))

    def state(self) -> dict[str, np.ndarray]:
        """What the next step begins with."""
        return {"touched": self.points, "against": self.which, "pushed": self.pushed}

    def set_state(self, state: dict[str, np.ndarray]) -> None:
        """The inverse of `state`."""
        self.points, self.which, self.pushed = (state[name].copy() for name in ("touched", "against", "pushed"))

    @property
    def axes(self) -> np.ndarray:
        """Axes (3m,) of the points."""
        return (3 * self.points[:, None] + np.arange(3)).ravel()

    def press(
        self, answer: Answer, before: np.ndarray, alone: np.ndarray, dt: float, time: float, obstacles: Obstacles
    ) -> None:
        """Find the forces that keep points (s,3) out of the obstacles at the end of the step from `time` on [s].

        before: where the points are (s,3) [m].  alone: their displacement (3s,) without contact.
        Obstacles are curved: each pass takes their planes from where the last one led. Points that pins and firm hands
        hold against an obstacle go where those take them.
        """
        table = obstacles.table(time + dt, dt)
        for _ in range(PASSES):
            # Begun with the forces of the last step, most of which stay.
            moved = alone + answer.moved(self.axes, self.pushed.ravel())[0] if len(self.points) else alone
            after = self._rest + moved.reshape(-1, 3)
            gaps, normals = obstacles.gaps(table, before, after)
            others = self._enter(gaps, _movable(answer, normals))
            gap, normal = gaps[self.points, self.which], normals[self.points, self.which]
            gap, normal = obstacles.standing(table, self.which, after[self.points], gap, normal)
            pushed = (self.pushed * normal).sum(axis=1) > 0
            wrong = np.where(pushed, np.abs(gap), -gap)
            if not others and wrong.max(initial=0.0) <= self._precise:
                break
            slip = after[self.points] - before[self.points]
            slip -= obstacles.carried(table, self.which, before[self.points], dt)
            self._balance(answer, gap, slip, normal, obstacles.friction[self.which])
        held = self.pushed.any(axis=1)
        self.points, self.which, self.pushed = self.points[held], self.which[held], self.pushed[held]

    def _enter(self, gaps: np.ndarray, movable: np.ndarray) -> bool:
        """Add the points that have gone into a collider, drop those that cannot move; has that changed any?"""
        stays = movable[self.points, self.which]
        self.points, self.which, self.pushed = self.points[stays], self.which[stays], self.pushed[stays]
        inside = (gaps < 0) & movable
        inside[self.points, self.which] = False
        points, which = np.nonzero(inside)
        self.points, self.which = np.r_[self.points, points], np.r_[self.which, which]
        self.pushed = np.concatenate([self.pushed, np.zeros((len(points), 3))])
        return len(points) > 0 or not stays.all()

    def _balance(self, answer: Answer, gap, slip, normal, friction) -> None:
        """The forces for gaps (m,), slips (m,3) and normals (m,3) seen under those of now."""
        frames, m = frames_of(normal), len(gap)
        block = answer.block(self.axes).reshape(m, 3, m, 3)
        turned = np.matmul(frames[:, None], block.transpose(0, 2, 1, 3)) @ frames.transpose(0, 2, 1)[None]
        turned = turned.transpose(0, 2, 1, 3).reshape(3 * m, 3 * m)
        seen = np.einsum("mab,mb->ma", frames, slip)
        seen[:, 0] = gap
        forces = np.einsum("mab,mb->ma", frames, self.pushed)
        free = seen - (turned @ forces.ravel()).reshape(-1, 3)
        self.pushed = np.einsum("mba,mb->ma", frames, balanced_forces(turned, free, friction, forces))


def _movable(answer: Answer, normals: np.ndarray) -> np.ndarray:
    """Can points move along the normals (s,colliders,3)?"""
    return (normals**2 * answer.gives.reshape(-1, 1, 3)).sum(axis=2) > FIRM
