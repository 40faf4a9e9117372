"""What the mouse points at, where no browser works it out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.output.camera import Viewpoint
from taichifem.output.frame import Frame


@dataclass(frozen=True)
class Hit:
    """A point (3,) [m] of the surface, its depth along the view [m], and the node to take it by."""

    point: np.ndarray
    depth: float
    node: int


def ray_through(viewpoint: Viewpoint, x: float, y: float, aspect: float) -> np.ndarray:
    """Unit vector (3,) from the eye through a point of the picture, x and y from -1 to 1, up positive."""
    t = np.tan(np.radians(viewpoint.fov) / 2)
    along = viewpoint.forward + t * (x * aspect * viewpoint.right + y * viewpoint.up)
    return along / np.linalg.norm(along)


def pick(frame: Frame, viewpoint: Viewpoint, along: np.ndarray) -> Hit | None:
    """The first point of the surface on the ray from the eye (Moeller & Trumbore 1997), or None."""
    a, b, c = (np.asarray(frame.points, float)[frame.triangles[:, k]] for k in range(3))
    p = np.cross(along, c - a)
    det = ((b - a) * p).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = ((viewpoint.eye - a) * p).sum(axis=1) / det
        q = np.cross(viewpoint.eye - a, b - a)
        v = (q @ along) / det
        distance = ((c - a) * q).sum(axis=1) / det
        met = (np.abs(det) > 1e-30) & (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
    if not met.any():
        return None
    k = int(np.argmin(np.where(met, distance, np.inf)))
    corner = int(np.argmax([1 - u[k] - v[k], u[k], v[k]]))
    depth = float(distance[k] * (along @ viewpoint.forward))
    point = int(frame.triangles[k, corner])
    return Hit(viewpoint.eye + distance[k] * along, depth, point if frame.nodes is None else int(frame.nodes[point]))
