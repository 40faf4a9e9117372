"""Pins, handles and colliders over time: which act, and where they stand, in the world's fields."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from taichifem import transfer
from taichifem.description import BoxCollider, Collider, Motion, PlaneCollider, Scene, SphereCollider
from taichifem.description.motion import rotation_matrix
from taichifem.formulas.collision import BOX, PLANE, SPHERE
from taichifem.hands import ROOM, Hands
from taichifem.layout import Group, Layout
from taichifem.world import Counts, World

_STILL = (np.eye(3), np.zeros(3))


class Surroundings:
    """Keeps the world's pins, handles and colliders up to date.

    held_bodies (bodies,): what some pin holds now.  held (k,5): node, group and axes (1 or 0) of every pinned node.
    """

    def __init__(self, scene: Scene, layout: Layout, world: World, counts: Counts, hands: Hands) -> None:
        self.held_bodies = np.zeros(len(scene.bodies), dtype=bool)
        self.held = np.zeros((0, 5))
        self._scene, self._layout, self._world, self._counts = scene, layout, world, counts
        self._groups: list[Group] = [*layout.pins, *layout.handles]
        self._hands = hands
        self._number = layout.node_number  # of each node of the scene in the world
        self.forget()

    def forget(self) -> None:
        """Send everything again at the next update, as after loading a state."""
        self._active: list[bool] | None = None

    def take(self, scene: Scene) -> None:
        """Go on with the colliders of `scene`."""
        self._scene = scene
        self.forget()

    @property
    def last_key(self) -> float:
        """The last time [s] at which a motion has a key; 0 if nothing moves."""
        return max((motion.times[-1] for motion in self._motions), default=0.0)

    @property
    def turn(self) -> float:
        """What the fastest turn of a pin or handle would make until the last key [degrees]."""
        turns = [group.motion.fastest_turn for group in self._groups if group.motion is not None]
        return max(turns, default=0.0) * self.last_key

    @property
    def _motions(self) -> list[Motion]:
        motions = [group.motion for group in self._groups] + [c.motion for c in self._scene.colliders]
        return [motion for motion in motions if motion is not None]

    @property
    def held_for_ever(self) -> np.ndarray:
        """The rows of `held` that no time lets go."""
        lasting = np.array([group.until is None for group in self._groups] + [False] * (1 + ROOM), dtype=bool)
        return self.held[lasting[self.held[:, 1].astype(int)]]

    def update(self, time: float, dt: float, *, all_act: bool = False) -> bool:
        """Put everything where it stands at `time` [s], the end of a step of `dt` [s].

        all_act: whatever their times say, all pins and handles do.  What never moves is sent once.
        Returns True if pins or handles began or ceased to act.
        """
        everything = self._active is None
        motions = [group.motion for group in self._groups]
        if everything or len(self._hands) or any(m is not None for m in motions):
            poses = pose_table(motions, time), self._hands.poses(self._layout.rest[self._number])
            transfer.fill_poses(self._world, np.concatenate(poses))
        if everything or any(c.motion is not None for c in self._scene.colliders):
            table = collider_table(self._scene.colliders, time, dt)
            transfer.fill_colliders(self._world, table)
        active = [all_act or group.acts_at(time) for group in self._groups]
        if active == self._active and not self._hands.changed:
            return False
        self._active, self._hands.changed = active, False
        self._choose(active)
        return True

    def _choose(self, active: list[bool]) -> None:
        """Tell the world which nodes are held and pulled."""
        n_pins = len(self._layout.pins)
        held, pulled, stiffness = [np.zeros((0, 5))], [np.zeros((0, 2))], [np.zeros(0)]
        self.held_bodies[:] = False
        for g, group in enumerate(self._groups):
            if not active[g]:
                continue
            which = np.full(len(group.nodes), g)
            if g < n_pins:
                axes = np.tile(group.axes, (len(group.nodes), 1))
                held.append(np.column_stack([group.nodes, which, axes]))
                self.held_bodies[self._layout.node_bodies[group.nodes]] = True
            else:
                pulled.append(np.column_stack([group.nodes, which]))
                stiffness.append(np.full(len(group.nodes), group.stiffness))
        by_hand = self._hands.rows(self._number, max(len(self._groups), 1))
        for rows, more in zip((held, pulled, stiffness), by_hand, strict=True):
            rows.append(more)
        self.held_bodies[self._layout.node_bodies[by_hand[0][:, 0].astype(int)]] = True
        nodes, springs = self.held, _ = np.concatenate(held), np.concatenate(pulled)
        self._counts.held, self._counts.pulled = len(nodes), len(springs)
        transfer.fill_groups(self._world, nodes, springs, np.concatenate(stiffness))


def pose(motion: Motion | None, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3,3) and offset (3,) [m] at `time` [s]; no motion is the identity."""
    return motion.at(time) if motion is not None else _STILL


def pose_table(motions: Sequence[Motion | None], time: float) -> np.ndarray:
    """Rows of R and c (groups,3,4), at least one."""
    rows = [np.column_stack(pose(motion, time)) for motion in motions]
    return np.array(rows or [np.column_stack(_STILL)])


def _frame_of_normal(normal: Sequence[float]) -> np.ndarray:
    """A rotation whose third column is the normal."""
    z = np.asarray(normal, dtype=float)
    z = z / np.linalg.norm(z)
    x = np.eye(3)[np.argmin(np.abs(z))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _rest_frame(collider: Collider) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
    """Kind, rotation (3,3), centre (3,) and size (3,) as described."""
    if isinstance(collider, PlaneCollider):
        return PLANE, _frame_of_normal(collider.normal), np.asarray(collider.point), np.zeros(3)
    if isinstance(collider, SphereCollider):
        return SPHERE, np.eye(3), np.asarray(collider.center), np.full(3, collider.radius)
    assert isinstance(collider, BoxCollider)
    turn = rotation_matrix(collider.axis, collider.angle)
    return BOX, turn, np.asarray(collider.center), np.asarray(collider.size)


def _spin(before: np.ndarray, after: np.ndarray, dt: float) -> np.ndarray:
    """Angular velocity (3,) [rad/s] that turns `before` into `after` in `dt`."""
    turn = after @ before.T
    axial = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine, cosine = np.linalg.norm(axial), 0.5 * (np.trace(turn) - 1)
    return axial / dt * (np.arctan2(sine, cosine) / sine if sine > 0 else 1.0)


def collider_table(colliders: Sequence[Collider], time: float, dt: float) -> np.ndarray:
    """Rows for `transfer.fill_colliders` (colliders,35): where they stand at `time`, moving since `time - dt`."""
    rows = []
    for collider in colliders:
        kind, frame, point, size = _rest_frame(collider)
        (R0, c0), (R1, c1) = pose(collider.motion, time - dt), pose(collider.motion, time)
        before, after = R0 @ point + c0, R1 @ point + c1
        velocity, spin = (after - before) / dt, _spin(R0, R1, dt)
        turns = (R1 @ frame).ravel(), (R0 @ frame).ravel()
        rows.append(np.concatenate([[kind, collider.friction], size, after, velocity, spin, before, *turns]))
    return np.array(rows) if rows else np.zeros((1, 35))
