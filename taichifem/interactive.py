"""Bodies that one can lay hands on while they move: grab, pin, push, and exchange what they meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from taichifem.description import Collider, Material, check
from taichifem.errors import InputError
from taichifem.hands import Hand, Hands
from taichifem.riding_bodies import RidingBodies

MOST_NODES = 16
"""That one hand holds: the nearest ones."""


class InteractiveBodies(RidingBodies):
    """Bodies with hands on them. What is done acts at the next step; nothing recompiles."""

    @property
    def hands(self) -> Hands:
        """The hands that hold or pull now."""
        return self._hands

    def grab(self, node: int, *, radius: float, stiffness: float | None) -> Hand:
        """Take hold of the body around `node`: its nearest nodes within `radius` [m], at rest, at most MOST_NODES.

        stiffness: of the implicit spring by which the hand pulls [N/m]; None holds firmly, as a pin does.
        Raises InputError for a node that is not there, and where hands would hold too many nodes.
        """
        nodes = self._around(node, check.number("radius", radius, at_least=0, unit="m"))
        if stiffness is not None:
            check.number("stiffness", stiffness, above=0, unit="N/m")
        return self._hands.take(Hand(nodes, self.positions[nodes], stiffness))

    def push(self, node: int, impulse: Sequence[float], *, radius: float) -> None:
        """Strike the body around `node` with `impulse` [N s]: its nodes as in `grab` take on one more velocity."""
        nodes = self._around(node, check.number("radius", radius, at_least=0, unit="m"))
        velocities = self.velocities
        velocities[nodes] += np.asarray(check.vector("impulse", impulse, unit="N s")) / self.masses[nodes].sum()
        self.set_velocities(velocities)

    def takes(self, material: Material) -> bool:
        """Can a body get this material while the simulation runs? Else another law is needed, and a new simulation."""
        return self._laws.knows(material) and (material.fracture is None or self._may_break)

    def set_colliders(self, colliders: Sequence[Collider], *, kept: bool = False) -> None:
        """Have these colliders from the next step on. Raises InputError for more than the world has room for.

        kept: they are the same, but for how they move; what touches goes on touching.
        """
        room, before = self._world.capacity.colliders, self.scene.colliders
        if len(colliders) > room:
            raise InputError(f"there is room for {room} colliders here: make a new simulation for more")
        if not kept:
            same = [k < min(len(before), len(colliders)) and before[k] == colliders[k] for k in range(room)]
            contacts = self._read_contacts(room)
            for values in contacts.values():
                values[~np.array(same)] = 0
            self._write_contacts(contacts)
        self.scene = replace(self.scene, colliders=tuple(colliders))
        self._counts.colliders = len(colliders)
        self._surroundings.take(self.scene)

    def force_on_ball(self, collider: int, time: float) -> np.ndarray:
        """Force (3,) [N] with which bodies pressed, in the step that ended at `time` [s], on the sphere `collider`."""
        ball, rotation, offset = self._poses(time)[collider]
        x, pressed = self._pressed_points(collider)
        met = np.flatnonzero(pressed > 0)
        away = x[met] - (rotation @ np.asarray(ball.center) + offset)
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
        return -(pressed[met, None] * away).sum(axis=0, dtype=float)

    def _reshape(self, parent: np.ndarray) -> None:
        super()._reshape(parent)
        if len(self._hands):
            self._fill_table()
            self._hands.follow(parent, self.masses)

    def _around(self, node: int, radius: float) -> np.ndarray:
        """Nodes of the body of `node` within `radius` [m] of it at rest, the nearest ones."""
        if check.whole("node", node, at_least=0) >= self._counts.nodes:
            raise InputError(f"node {node} is not there: the scene has {self._counts.nodes} nodes now")
        rest, (_, _, pieces) = self.rest_positions, self._labelled
        distance = np.linalg.norm(rest - rest[node], axis=1)
        distance[pieces != pieces[node]] = np.inf
        nearest = np.argsort(distance, kind="stable")[:MOST_NODES]
        return np.sort(nearest[distance[nearest] <= radius])
