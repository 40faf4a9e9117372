"""What stands in a frame, as one list of triangles with normals at the corners."""

from __future__ import annotations

import numpy as np

from taichifem import runtime
from taichifem.output import colors, raster_kernels
from taichifem.output.frame import Frame, Shape, triangulate

_CREASE = np.cos(np.radians([48.0, 32.0]))
"""Faces at more than the first angle keep a crease between them, at less than the second they are smooth."""

_NOWHERE = 1e15
"""Coordinates [m] beyond which a node is taken for lost: squares would leave the range of floats."""


class Solids:
    """Bodies and colliders as one list of triangles, ready for kernels.

    points: (n,3) float32 [m].  triangles: (k,3) int32, the bodies' first; the last one is a placeholder of no
    extent, so that no array is ever empty.  colors: (k,3,3) float32, linear light, one for each corner.
    floor: the plane that carries the scene, or None.  flat: are all bodies sheets in one plane?
    center, radius: of a ball [m] that holds everything that casts a shadow.

    Walls (planes that are not the floor) are left out where `eye` (3,) [m] is behind them. Triangles with a node
    that flew off to nowhere (NaN, or out of all bounds) are left out too.
    """

    def __init__(self, frame: Frame, eye: np.ndarray | None = None) -> None:
        planes = [s for s in frame.colliders if s.kind == "plane"]
        level = max(planes, key=lambda s: s.normal[2], default=None)
        self.floor: Shape | None = level if level is not None and level.normal[2] > 0.1 else None
        walls = [s for s in planes if s is not self.floor]
        if eye is not None:
            walls = [s for s in walls if s.normal @ (eye - s.center) > 0]
        bodies = np.asarray(frame.points, np.float32).reshape(-1, 3)
        faces = np.asarray(frame.triangles, np.int32).reshape(-1, 3)
        there = (np.abs(bodies) < _NOWHERE).all(axis=1)
        if not there.all():
            bodies = np.where(there[:, None], bodies, np.float32(0))
            faces = np.where(there[faces].all(axis=1)[:, None], faces, 0).astype(np.int32)
        seen = bodies[there]
        self.low, self.high = (seen.min(axis=0), seen.max(axis=0)) if len(seen) else np.zeros((2, 3))
        extent = max(float(np.linalg.norm(self.high - self.low)), 1e-6)
        self.flat = bool((self.high - self.low).min() <= 1e-6 * extent)

        solids = [s for s in frame.colliders if s.kind != "plane"]
        grey = colors.to_linear(colors.parse_hex(colors.COLLIDER))
        points = [bodies]
        triangles = [faces]
        shades = [colors.to_linear(frame.corner_colors()).reshape(-1, 3, 3)]
        parts = [triangulate(s) for s in solids]
        parts += [_wall(s, self.low, self.high) for s in walls]
        self._companions = []
        for more, faces in parts:
            triangles.append(faces + sum(len(p) for p in points))
            points.append(more)
            shades.append(np.broadcast_to(grey, (len(faces), 3, 3)))
            if np.linalg.norm(np.ptp(more, axis=0)) < 3 * extent:
                self._companions.append(more)
        points.append(np.zeros((1, 3), np.float32))
        triangles.append(np.full((1, 3), sum(len(p) for p in points) - 1, np.int32))
        shades.append(np.zeros((1, 3, 3), np.float32))
        self.points = np.ascontiguousarray(np.concatenate(points), np.float32)
        self.triangles = np.ascontiguousarray(np.concatenate(triangles), np.int32)
        self.colors = np.ascontiguousarray(np.concatenate(shades), np.float32)
        low = np.min([self.low, *(p.min(axis=0) for p in self._companions)], axis=0)
        high = np.max([self.high, *(p.max(axis=0) for p in self._companions)], axis=0)
        self.center = (low + high) / 2
        # In steps, so that the texels of the shadow map do not crawl while bodies bend.
        exact = max(float(np.linalg.norm(high - low)) / 2, 1e-6)
        self.radius = float(1.1 ** np.ceil(np.log(exact * 1.02) / np.log(1.1)))

    def subject(self) -> np.ndarray:
        """Points (n,3) [m] that a picture should show: bodies, colliders of their size, and where they may fall."""
        bodies = np.array(np.meshgrid(*zip(self.low, self.high, strict=True))).reshape(3, -1).T
        extent = np.linalg.norm(self.high - self.low)
        if self.floor is None:
            below = bodies - [0, 0, 0.4 * extent]
        else:
            height = (bodies - self.floor.center) @ self.floor.normal
            below = bodies - np.clip(height, 0, 1.5 * extent)[:, None] * self.floor.normal
        return np.concatenate([bodies, below, *self._companions])


class CornerNormals:
    """Normals that follow the deformation; which triangles meet at a node is kept while it does not change."""

    def __init__(self) -> None:
        self._topology = (np.zeros((0, 3), np.int32), 0)
        self._starts = self._fans = np.zeros(0, np.int32)

    def of(self, solids: Solids) -> np.ndarray:
        """Unit normals (k,3,3) float32 at the corners of the triangles."""
        triangles, nodes = solids.triangles, len(solids.points)
        if self._topology[1] != nodes or not np.array_equal(self._topology[0], triangles):
            self._topology = (triangles, nodes)
            owners = triangles.ravel()
            self._fans = (np.argsort(owners, kind="stable") // 3).astype(np.int32)
            counts = np.bincount(owners, minlength=nodes)
            self._starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        normals = np.zeros((len(triangles), 3, 3), np.float32)
        faces = np.zeros((len(triangles), 3), np.float32)
        with runtime.precision_of("f32"):
            raster_kernels.corner_normals(
                solids.points, triangles, len(triangles) - 1, self._starts, self._fans, faces, normals, *_CREASE
            )
        return normals


def _wall(plane: Shape, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A square of a plane that is not the ground, behind the bodies."""
    middle, half = (low + high) / 2, float(np.linalg.norm(high - low))
    foot = middle - ((middle - plane.center) @ plane.normal) * plane.normal
    u, v = plane.rotation[:, 0] * half, plane.rotation[:, 1] * half
    points = np.stack([foot - u - v, foot + u - v, foot + u + v, foot - u + v])
    return points.astype(np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
