"""A body that is known by its surface: loads, pins, handles and contact move it at once, or in implicit steps."""

from __future__ import annotations

import numpy as np

from taichifem.description import Material
from taichifem.errors import InputError
from taichifem.layout import Group
from taichifem.reduced.answer import Answer
from taichifem.reduced.grip import NOTHING, Grip
from taichifem.reduced.parts import Parts
from taichifem.reduced.surface_contact import SurfaceContact
from taichifem.reduced.surface_models import BoundarySurface, CondensedSurface
from taichifem.surroundings import pose


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
        self._everywhere: tuple[np.ndarray, np.ndarray] | None = None
        self._contact = SurfaceContact(self._rest)
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
        """Of all nodes (n,3) [m]; that of inner nodes is worked out here, once for a state."""
        if self._everywhere is None or self._everywhere[0] is not self.u:
            self._everywhere = self.u, self.model.everywhere(self.u, self.forces)
        return self._everywhere[1].copy()

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
        return {"u": self.u, "v": self.v, "forces": self.forces} | self._contact.state()

    def set_state(self, state: dict[str, np.ndarray], time: float) -> None:
        """The inverse of `state`."""
        self.u, self.v, self._forces = (state[name].copy() for name in ("u", "v", "forces"))
        self._contact.set_state(state)

    @property
    def contacts(self) -> int:
        """Points that were pushed in the last step."""
        return len(self._contact.points)

    @property
    def holdable(self) -> np.ndarray:
        """Nodes that hands can take hold of (s,)."""
        return self.model.nodes

    def set_material(self, material: Material) -> None:
        """Another Young's modulus or damping from the next step on; forces of the last step are those it took."""
        self._forces = self.forces
        self.model.set_material(material)
        self._active = None

    # Steps

    def advance(self, dt: float, time: float, gravity: np.ndarray, obstacles, grip: Grip = NOTHING) -> None:
        """From `time` to `time` + dt [s] under gravity (3,) [m/s^2], with hands on it."""
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
        new, acting = self._gripped(self._alone, grip)
        if obstacles.count:
            contact = self._contact
            contact.press(self._answer, self._rest + self.u.reshape(-1, 3), new, dt, time, obstacles)
            if len(contact.points):
                moved, against = self._answer.moved(contact.axes, contact.pushed.ravel())
                new = new + moved
                acting += [(contact.axes, contact.pushed.ravel()), (self._answer.axes, against)]
        self._last = stretch, out_of_balance, acting
        self._forces = None
        self.v, self.u = (new - self.u) / dt, new

    def _gripped(self, alone: np.ndarray, grip: Grip) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
        """Where all axes are with hands but without contact, and what acts on which axes."""
        acting = []
        if len(grip.pushed):
            acting.append((self._on(grip.pushed), grip.forces.ravel()))
            alone = alone + acting[0][1] @ self._columns[acting[0][0]]
        axes, softness, targets = self._on(grip.held), np.repeat(grip.softness, 3), grip.targets.ravel()
        free = self._answer.unpinned[axes]  # what pins hold is not the hands'
        axes, softness, targets = axes[free], softness[free], targets[free]
        if not self._answer.holds(axes, softness):
            self._answer.hold(axes, softness)
        if len(axes):
            pulled, alone = self._answer.pull(alone, targets - self._rest.ravel()[axes])
            acting.append((axes, pulled))
        return alone, acting

    def _on(self, nodes: np.ndarray) -> np.ndarray:
        """Axes (3h,) of nodes (h,) of the body that are on its surface."""
        return (3 * np.searchsorted(self.model.nodes, nodes)[:, None] + np.arange(3)).ravel()

    @property
    def forces(self) -> np.ndarray:
        """Of pins, handles and contact on the surface (3s,) [N] in the last step."""
        if self._forces is None:
            stretch, out_of_balance, acting = self._last
            pushed, axes = _summed(acting)
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
        self._answer = Answer(self._columns)
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


def _summed(acting: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Each axis once, and the forces on it: a point may touch two colliders."""
    axes = np.concatenate([np.zeros(0, dtype=int), *(axes for axes, _ in acting)])
    forces = np.concatenate([np.zeros(0), *(forces for _, forces in acting)])
    once, at = np.unique(axes, return_inverse=True)
    return np.bincount(at, forces, minlength=len(once)), once
