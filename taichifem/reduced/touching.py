"""Contact of a modal body with colliders: which points touch, and what pushes them."""

from __future__ import annotations

from functools import partial

import numpy as np

from taichifem.reduced.contact import contact_forces, frames_of, stopping_impulses

PASSES = 5
MOST = 40
"""Contacts that are added in a pass at most: a body of some dozens of coordinates needs no more."""

CELLS = 6

PRECISE = 1e-5
"""Error of a gap [m] that another pass is made for."""


_TOUCHED = ("touched", "against", "pushed")


def spread_out(points: np.ndarray, gaps: np.ndarray, most: int) -> np.ndarray:
    """Of points (m,3), at most `most`: the deepest of each cell of a grid, the deepest of all first."""
    if len(points) <= most:
        return np.arange(len(points))
    low, extent = points.min(axis=0), np.ptp(points, axis=0).max()
    cells = np.minimum((points - low) / max(extent, 1e-300) * CELLS, CELLS - 1).astype(int)
    key = cells @ (CELLS * CELLS, CELLS, 1)
    order = np.lexsort((gaps, key))
    first = order[np.r_[True, np.diff(key[order]) > 0]]
    return first[np.argsort(gaps[first], kind="stable")][:most]


class Touch:
    """The contacts of one body in a step.

    dissipated: energy [J] that contact has taken up to now, from which pushing out of a penetration is paid for.
    """

    def __init__(self) -> None:
        self.dissipated = 0.0
        self._near, self._close = np.zeros(0, dtype=int), None
        self._known: tuple = ()
        self._clear()

    def state(self) -> dict[str, np.ndarray]:
        """What the next step depends on: it begins with the contacts of this one."""
        held = self.forces[:, 0] > 0
        touched = self._near[self.points[held]], self.which[held], self.forces[held]
        return {"dissipated": np.array(self.dissipated)} | dict(zip(_TOUCHED, touched, strict=True))

    def set_state(self, state: dict[str, np.ndarray]) -> None:
        """The inverse of `state`."""
        self.dissipated = float(state["dissipated"])
        self._near, self.which, self.forces = (state[name].copy() for name in _TOUCHED)
        self.points, self._close = np.arange(len(self._near)), None

    def _clear(self) -> None:
        self.points, self.which = np.zeros(0, dtype=int), np.zeros(0, dtype=int)
        self.frames, self.forces = np.zeros((0, 3, 3)), np.zeros((0, 3))

    @property
    def count(self) -> int:
        """Points that were pushed in the last step."""
        return int((self.forces[:, 0] > 0).sum())

    def press(self, body, push: np.ndarray, dt: float, time: float, obstacles):
        """The state after dt with forces of contact, which keep the skin out of the obstacles at the end of the step.

        body: see `ModalBody`.  push: generalised forces (r,) without contact.
        """
        held = self.forces[:, 0] > 0
        last = self._near[self.points[held]], self.which[held], self.forces[held]
        self._clear()
        now, alone = body.keep(), body.trial(dt, push)
        if not obstacles.count:
            return alone
        self._table, self._obstacles = obstacles.table(time + dt, dt), obstacles
        near = body.skin.near(now, alone, partial(obstacles.near, self._table))
        if not len(near):
            return alone
        if not np.array_equal(near, self._near) or self._close is None:
            self._near, self._close, self._known = near, body.skin.all.part(near, body.skin.all.rows.dtype), ()
        before = self._places(now)
        contact, compliance, reached = np.zeros_like(push), body.compliance(dt), alone
        after = self._begin_with(*last, before, alone)
        for k in range(PASSES):
            if k or not len(self.points):
                everywhere = self._places(reached)
                if not self._take(everywhere, *obstacles.gaps(self._table, before, everywhere)):
                    break
                after = everywhere[self.points]
            # How contact turns the frame is linear to first order only: correct by where it really leads.
            acted = self.forces if reached is not alone else np.zeros_like(self.forces)
            contact = self._forces(now, before[self.points], after, acted, compliance, dt, time)
            reached = body.trial(dt, push + contact)
        return self._paid(body, push, contact, reached, alone, dt)

    def _places(self, state) -> np.ndarray:
        """Where the close points are (n,3) [m]. As a rule a step begins where the last one has looked at its end."""
        depends = state.q, state.frame.rotation, state.frame.origin
        if not self._known or any(a is not b for a, b in zip(depends, self._known[0], strict=True)):
            self._known = depends, self._close.at(state)
        return self._known[1]

    def _begin_with(self, points: np.ndarray, which: np.ndarray, forces: np.ndarray, before, alone) -> np.ndarray:
        """Contacts of the last step, by their numbers among all points, are the first to be looked at in this one:
        where these points (m,3) would be without them."""
        at = np.minimum(np.searchsorted(self._near, points), len(self._near) - 1)
        still = self._near[at] == points
        points, which, forces = at[still], which[still], forces[still]
        after = self._close.part(points).at(alone) if len(points) else np.zeros((0, 3))
        gaps, normals = self._obstacles.gaps(self._table, before[points], after)
        each = np.arange(len(points))
        gaps, normals = gaps[each, which], normals[each, which]
        deep = gaps < 0
        self.points, self.which, self.forces = points[deep], which[deep], forces[deep]
        self.frames, self._gaps = frames_of(normals[deep]), gaps[deep]
        return after[deep]

    def _take(self, after: np.ndarray, gaps: np.ndarray, normals: np.ndarray) -> bool:
        """Add the points (n,3) that have gone in; is there anything to be done?"""
        known = np.zeros(gaps.shape, dtype=bool)
        known[self.points, self.which] = True
        deep = -PRECISE if len(self.points) else 0.0
        points, which = np.nonzero((gaps < deep) & ~known)
        new = spread_out(after[points], gaps[points, which], MOST)
        points, which = points[new], which[new]
        self.points, self.which = np.r_[self.points, points], np.r_[self.which, which]
        self.frames = np.concatenate([self.frames, frames_of(normals[points, which])])
        self.forces = np.concatenate([self.forces, np.zeros((len(points), 3))])
        self._gaps = gaps[self.points, self.which]
        return len(points) > 0 or np.abs(self._gaps[self.forces[:, 0] > 0]).max(initial=0.0) > PRECISE

    def _forces(self, now, before, after, acted, compliance, dt, time) -> np.ndarray:
        """What the contacts known so far do to the coordinates (r,).

        before, after: where their points are (m,3) now, and at the end of the step under the forces `acted` (m,3).
        """
        at = np.arange(len(self.points))
        slip = after - before - self._obstacles.carried(self._table, self.which, before, dt)
        end = np.einsum("mab,mb->ma", self.frames, slip)
        end[:, 0] = self._gaps
        J = (self.frames @ self._close.part(self.points).levers(now)).reshape(3 * len(at), -1)
        answer = J @ compliance @ J.T
        free = end - (answer @ acted.ravel()).reshape(-1, 3)
        friction = self._obstacles.friction[self.which]
        self.forces = contact_forces(answer, free, friction, self.forces)
        # What is inside already is pushed out if contact has taken enough energy to pay for it.
        begin = self._obstacles.gaps(self._obstacles.table(time, dt), before, before)[0][at, self.which]
        begin = np.minimum(begin, 0.0)
        flat = self.forces.ravel()
        if flat @ (answer @ flat + free.ravel()) - self.forces[:, 0] @ begin > self.dissipated:
            self.forces = contact_forces(
                answer, free - np.column_stack([begin, 0 * begin, 0 * begin]), friction, self.forces
            )
        return J.T @ self.forces.ravel()

    def _paid(self, body, push, contact, reached, alone, dt):
        """The state with the contact forces, or with a part that takes no more energy than contact has dissipated."""
        for share in (1.0, 0.95, 0.85, 0.7, 0.5, 0.25, 0.0):
            if share < 1:
                reached = body.trial(dt, push + share * contact)
            work = body.work(share * contact, reached, alone)
            if work <= self.dissipated:
                break
        self.dissipated -= work
        self.forces = share * self.forces
        return reached

    def stop(self, body, dt: float) -> None:
        """At the end of the step, stop what the obstacles pushed: a step that just closes a gap would fling it back."""
        held = self.forces[:, 0] > 0
        if not held.any():
            return
        which, frames = self.which[held], self.frames[held]
        now, points = body.keep(), self._close.part(self.points[held])
        places, velocity = points.at(now), points.velocities(now)
        relative = velocity - self._obstacles.carried(self._table, which, places, dt) / dt
        J = (frames @ points.levers(now)).reshape(3 * len(which), -1)
        answer = J @ body.mobility() @ J.T
        seen = np.einsum("mab,mb->ma", frames, relative)
        # Friction has acted during the step: only what it has left may act now.
        side = np.linalg.norm(self.forces[held, 1:], axis=1)
        most = np.maximum(self._obstacles.friction[which] * self.forces[held, 0] - side, 0.0) * dt
        impulses = stopping_impulses(answer, seen, most)
        before = body.kinetic_energy
        body.strike(J.T @ impulses.ravel())
        self.dissipated += before - body.kinetic_energy
