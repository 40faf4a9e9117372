"""Poses of pins, handles and colliders at a time, as rows for the world's fields."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from taichifem.description import BoxCollider, Collider, Motion, PlaneCollider, SphereCollider
from taichifem.description.motion import rotation_matrix
from taichifem.formulas.collision import BOX, PLANE, SPHERE

_STILL = (np.eye(3), np.zeros(3))


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
