"""A body that is known by its surface: loads, pins, handles and contact move it at once, or in implicit steps."""

from __future__ import annotations

import numpy as np

from taichifem.errors import InputError
from taichifem.layout import Group
from taichifem.reduced.contact import contact_forces, frames_of
from taichifem.reduced.parts import Parts
from taichifem.reduced.surface_models import BoundarySurface, CondensedSurface
from taichifem.surroundings import pose

PASSES = 8


class SurfaceBody:
    """One body of a scene. u: displacement of the surface (3s,) [m], v: its velocity."""

    def __init__(self, parts: Parts, *, dt: float, model: CondensedSurface | BoundarySurface) -> None:
        self.parts, self.model, self._dt = parts, model, dt
        nodes = model.nodes
        self._rest = parts.rest[nodes]
        self.u = np.zeros(3 * len(nodes))
        self.v = parts.velocities[nodes].ravel() if isinstance(model, CondensedSurface) else 0 * self.u
        self._forces: np.ndarray | None = np.zeros_like(self.u)
        self._asked: np.ndarray | None = None
        self.contacts = 0
        self._groups = [self._seen(group) for group in (*parts.pins, *parts.handles)]
        self._active: list[bool] | None = None

    def _seen(self, group: Group) -> tuple[Group, np.ndarray]:
        """The group, and its nodes among those of the surface."""
        at = np.searchsorted(self.model.nodes, group.nodes)
        seen = self.model.nodes[np.minimum(at, len(self.model.nodes) - 1)] == group.nodes
        if not seen.any():
            raise InputError(
                f"{self.parts.label}: a pin or handle has inner nodes only: choose some of the surface, "
                'or use model = "linear"'
            )
        return group, at[seen]

    # State

    rotation = np.eye(3)

    @property
    def displacement(self) -> np.ndarray:
        """Of all nodes (n,3) [m]; that of inner nodes is worked out here."""
        return self.model.everywhere(self.u, self.forces)

    @property
    def positions(self) -> np.ndarray:
        """(n,3) [m]"""
        return self.parts.rest + self.displacement

    @property
    def velocities(self) -> np.ndarray:
        """(n,3) [m/s]"""
        return self.model.velocities(self.v)

    @property
    def elastic_energy(self) -> float:
        """[J]"""
        return self.model.energy(self.u, self.forces)

    def surface_stress(self) -> np.ndarray | None:
        """Stress of the triangles of the surface (k,3,3) [Pa], where the model knows that."""
        if isinstance(self.model, BoundarySurface):
            return self.model.surface_stress(self.u, self.forces)
        return None

    @property
    def finite(self) -> bool:
        """Is the state made of numbers?"""
        return bool(np.isfinite(self.u).all() and np.isfinite(self.v).all())

    def keep(self) -> tuple[np.ndarray, np.ndarray]:
        """The state, for `take_back`."""
        return self.u, self.v

    def take_back(self, kept: tuple[np.ndarray, np.ndarray]) -> None:
        """Undo a step."""
        self.u, self.v = kept

    def state(self) -> dict[str, np.ndarray]:
        """What the next steps depend on."""
        return {"u": self.u, "v": self.v, "forces": self.forces}

    def set_state(self, state: dict[str, np.ndarray], time: float) -> None:
        """The inverse of `state`."""
        self.u, self.v, self._forces = (state[name].copy() for name in ("u", "v", "forces"))

    # Steps

    def advance(self, dt: float, time: float, gravity: np.ndarray, obstacles) -> None:
        """From `time` to `time` + dt [s] under gravity (3,) [m/s^2]."""
        end = time + dt
        self._hold([group.acts_at(end) for group, _ in self._groups])
        loads = {k: field.load.share_at(end) for k, field in enumerate(self.parts.loads)}
        free, out_of_balance = self.model.free(gravity, {k: s for k, s in loads.items() if s}, self.u, self.v)
        target = np.concatenate([np.zeros(0), *(self._target(k, end) for k in self._acting)])
        stretch = target - free[self._axes]
        asked = np.concatenate([free, stretch, out_of_balance])
        if self._asked is None or not np.array_equal(asked, self._asked):
            self._asked = asked
            self._alone = free + self._moved_by @ stretch + self._shifted_by @ out_of_balance
        pushed, axes = self._contact(self._alone, dt, time, obstacles)
        new = self._alone + pushed @ self._columns[axes]
        self._last = stretch, out_of_balance, axes, pushed
        self._forces = None
        self.v, self.u = (new - self.u) / dt, new

    @property
    def forces(self) -> np.ndarray:
        """Of pins, handles and contact on the surface (3s,) [N] in the last step."""
        if self._forces is None:
            stretch, out_of_balance, axes, pushed = self._last
            self._forces = np.zeros_like(self.u)
            self._forces[axes] = pushed
            self._forces[self._axes] += self._reactions(stretch, out_of_balance, axes, pushed)
        return self._forces

    def _hold(self, active: list[bool]) -> None:
        """Fold what pins and handles hold now into the compliance: an update of low rank, no new factorisation."""
        if active == self._active:
            return
        self._active = active
        self._acting = [k for k, acts in enumerate(active) if acts]
        axes, softness = [np.zeros(0, dtype=int)], [np.zeros(0)]
        for k in self._acting:
            group, nodes = self._groups[k]
            own = (3 * nodes[:, None] + np.flatnonzero(group.axes)).ravel()
            axes.append(own)
            softness.append(np.full(len(own), 1 / group.stiffness if group.stiffness else 0.0))
        self._axes, self._softness = np.concatenate(axes), np.concatenate(softness)
        try:
            self._holding = self.model.compliance.holding(self._axes, self._softness)
        except InputError as error:
            raise InputError(f"{self.parts.label}: {error}") from None
        base, self._moved_by, self._shifted_by = self.model.compliance.held_for_good(self._axes, self._softness)
        self._columns = np.ascontiguousarray(base.matrix.T)  # a row: what a force on one axis does
        self._asked = None

    def _target(self, k: int, time: float) -> np.ndarray:
        group, nodes = self._groups[k]
        turn, shift = pose(group.motion, time)
        moved = self._rest[nodes] @ turn.T + shift - self._rest[nodes]
        return moved[:, list(group.axes)].ravel()

    def _reactions(self, stretch, out_of_balance, axes, pushed) -> np.ndarray:
        """Forces (h,) of pins and handles, those against contact too."""
        c = self.model.compliance
        stretch = stretch - c.matrix[np.ix_(self._axes, axes)] @ pushed
        return self._holding.reactions(stretch, out_of_balance + c.balance[:, axes] @ pushed)

    def _contact(self, alone: np.ndarray, dt: float, time: float, obstacles) -> tuple[np.ndarray, np.ndarray]:
        """Contact forces on the axes (3m,) of the points that touch."""
        self.contacts = 0
        if not obstacles.count:
            return np.zeros(0), np.zeros(0, dtype=int)
        table = obstacles.table(time + dt, dt)
        before, after = self._rest + self.u.reshape(-1, 3), self._rest + alone.reshape(-1, 3)
        points, which = np.zeros(0, dtype=int), np.zeros(0, dtype=int)
        frames, pushed, axes = np.zeros((0, 3, 3)), np.zeros(0), np.zeros(0, dtype=int)
        for _ in range(PASSES):
            gaps, normals = obstacles.gaps(table, before, after)
            known = np.zeros(gaps.shape, dtype=bool)
            known[points, which] = True
            new, where = np.nonzero((gaps < 0) & ~known)
            if not len(new):
                break
            points, which = np.r_[points, new], np.r_[which, where]
            frames = np.concatenate([frames, frames_of(normals[new, where])])
            axes = (3 * points[:, None] + np.arange(3)).ravel()
            turned = np.einsum("mab,mbnc->manc", frames, self._gather(axes))
            answer = np.einsum("manc,ndc->mand", turned, frames).reshape(len(axes), len(axes))
            answer = 0.5 * (answer + answer.T)  # boundary elements are symmetric in the limit only
            slip = (self._rest + alone.reshape(-1, 3))[points] - before[points]
            slip -= obstacles.carried(table, which, before[points], dt)
            end = np.einsum("mab,mb->ma", frames, slip)
            # The gap without contact, along the normals that were found.
            end[:, 0] = gaps[points, which] - np.einsum(
                "mb,mb->m", frames[:, 0], after[points] - (self._rest + alone.reshape(-1, 3))[points]
            )
            local = contact_forces(answer, end, obstacles.friction[which])
            pushed = np.einsum("mba,mb->ma", frames, local).ravel()
            after = self._rest + (alone + pushed @ self._columns[axes]).reshape(-1, 3)
        self.contacts = int((np.abs(pushed.reshape(-1, 3)).sum(axis=1) > 0).sum())
        return _summed(axes, pushed)

    def _gather(self, axes: np.ndarray) -> np.ndarray:
        m = len(axes) // 3
        return self._columns[axes][:, axes].T.reshape(m, 3, m, 3)


def _summed(axes: np.ndarray, pushed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each axis once: a point may touch two colliders."""
    once, at = np.unique(axes, return_inverse=True)
    return np.bincount(at, pushed, minlength=len(once)), once
