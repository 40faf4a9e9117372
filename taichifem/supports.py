"""Can a body still move without being strained? Then it has no balance, and a static solve no answer."""

from __future__ import annotations

import numpy as np

from taichifem.description import Scene
from taichifem.errors import InputError
from taichifem.layout import AXES, Group, Layout

ROUND_OFF = 1e-6


def check_supports(scene: Scene, layout: Layout) -> None:
    """Raise InputError for a body that pins and handles leave free to shift or turn."""
    for b, body in enumerate(scene.bodies):
        begin, end = layout.body_start[b], layout.body_start[b + 1]
        motions = rigid_motions(layout.rest[begin:end], layout.dimension)
        rows = [_held(motions, group, begin, end) for group in (*layout.pins, *layout.handles)]
        held = np.concatenate([np.zeros((1, motions.shape[-1])), *rows])
        if np.linalg.matrix_rank(held, tol=ROUND_OFF) < motions.shape[-1]:
            raise InputError(
                f"body.{body.name or b} can shift or turn without strain, so it has no balance: "
                "pin nodes that are not all in one place or line, or add handles"
            )


def rigid_motions(points: np.ndarray, dimension: int) -> np.ndarray:
    """Displacements (n,3,k) of the points (n,3) under the k = 6 rigid motions of space, or the 3 of the plane y = 0."""
    arms = points - points.mean(axis=0)
    arms = arms / max(np.abs(arms).max(), 1e-300)
    turns = [np.cross(axis, arms) for axis in np.eye(3)[[0, 1, 2] if dimension == 3 else [1]]]
    shifts = [np.broadcast_to(np.eye(3)[axis], arms.shape) for axis in AXES[dimension]]
    return np.stack([*shifts, *turns], axis=-1)


def _held(motions: np.ndarray, group: Group, begin: int, end: int) -> np.ndarray:
    """What of the motions the group's nodes would feel (rows,k)."""
    nodes = group.nodes[(group.nodes >= begin) & (group.nodes < end)] - begin
    return motions[nodes][:, list(group.axes)].reshape(-1, motions.shape[-1])
