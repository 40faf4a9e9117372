"""The part of flat faces that lies inside of a surface: what is seen of cracks through a mesh that carries one."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from taichifem.mesh.embedded import closest_point

NEAR = 16
"""Triangles of the surface that are looked at around a place, by their corners and middles."""

COARSE, MOST = 1.5, 8
"""Faces are cut into parts of about this many edges of the surface, and into at most so many parts a side."""


class Inside:
    """How deep places lie in a surface of points (p,3) [m] and triangles (k,3), whose normals point outward."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray) -> None:
        self._triangles, self._corners = triangles, points[triangles]
        sides = np.roll(self._corners, -1, axis=1) - self._corners
        self.edge = float(np.median(np.linalg.norm(sides, axis=2)))
        seen = np.concatenate([self._corners.reshape(-1, 3), self._corners.mean(axis=1)])
        self._of = np.r_[np.repeat(np.arange(len(triangles)), 3), np.arange(len(triangles))]
        self._tree = cKDTree(seen)
        # Normals of the points, by the angles of their triangles: they tell the side at edges and corners too.
        normal = np.cross(sides[:, 0], sides[:, 1])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        unit = sides / np.maximum(np.linalg.norm(sides, axis=2, keepdims=True), 1e-300)
        angle = np.arccos(np.clip(-(unit * np.roll(unit, 1, axis=1)).sum(axis=2), -1, 1))
        self._normals = np.zeros_like(points, dtype=float)
        np.add.at(self._normals, triangles, angle[:, :, None] * normal[:, None])

    def depth(self, places: np.ndarray) -> np.ndarray:
        """Distance of places (m,3) from the surface [m], negative outside (Baerentzen & Aanaes 2005)."""
        near = self._of[self._tree.query(places, k=min(NEAR, len(self._of)))[1].reshape(len(places), -1)]
        feet = closest_point(places[:, None], self._corners[near])
        away = np.linalg.norm(feet - places[:, None], axis=2)
        each, best = np.arange(len(places)), away.argmin(axis=1)
        foot, triangle = feet[each, best], near[each, best]
        share = _shares(foot, self._corners[triangle])
        normal = (share[:, :, None] * self._normals[self._triangles[triangle]]).sum(axis=1)
        return np.where(((places - foot) * normal).sum(axis=1) > 0, -1.0, 1.0) * away[each, best]


def clip(faces: np.ndarray, inside: Inside) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (k,3,3) that cover what of the faces (f,3,3) [m] lies inside, and the face (k,) each is of.

    Rows are the corners of a triangle, as shares of the corners of its face.
    """
    sides = np.linalg.norm(np.roll(faces, -1, axis=1) - faces, axis=2).max(axis=1)
    middle = faces.mean(axis=1)
    radius = np.linalg.norm(faces - middle[:, None], axis=2).max(axis=1)
    deep = inside.depth(middle)
    parts = np.clip(np.ceil(sides / (COARSE * inside.edge)).astype(int), 1, MOST)
    parts[np.abs(deep) > radius] = 0  # all of it is on one side
    whole = np.flatnonzero((parts == 0) & (deep > 0))
    triangles, of = [np.repeat(np.eye(3)[None], len(whole), axis=0)], [whole]
    for count in np.unique(parts[parts > 0]):
        cut = np.flatnonzero(parts == count)
        shares, small = _lattice(count)
        depth = inside.depth((shares @ faces[cut]).reshape(-1, 3)).reshape(len(cut), -1)
        face, part = np.divmod(np.arange(len(cut) * len(small)), len(small))
        kept, source = _cut(shares[small[part]], depth[face[:, None], small[part]])
        triangles.append(kept), of.append(cut[face[source]])
    return np.concatenate(triangles), np.concatenate(of)


def _shares(foot: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Of points (m,3) in triangles (m,3,3), the shares (m,3) of the corners."""
    areas = [
        np.linalg.norm(np.cross(corners[:, (a + 1) % 3] - foot, corners[:, (a + 2) % 3] - foot), axis=1)
        for a in range(3)
    ]
    total = np.stack(areas, axis=1)
    return total / np.maximum(total.sum(axis=1, keepdims=True), 1e-300)


def _lattice(count: int) -> tuple[np.ndarray, np.ndarray]:
    """A triangle cut into count x count ones: its points, as shares of the corners (p,3), and the small ones (k,3)."""
    place = {}
    for i in range(count + 1):
        for j in range(count + 1 - i):
            place[i, j] = len(place)
    shares = np.array([(count - i - j, i, j) for i, j in place]) / count
    up = [(place[i, j], place[i + 1, j], place[i, j + 1]) for i, j in place if i + j < count]
    down = [(place[i + 1, j], place[i + 1, j + 1], place[i, j + 1]) for i, j in place if i + j + 1 < count]
    return shares, np.array(up + down)


def _cut(triangles: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What of triangles (t,3,3) lies where the depth of their corners (t,3) is positive, and of which (k,) it is."""
    inside = depth > 0
    count = inside.sum(axis=1)
    whole = np.flatnonzero(count == 3)
    pieces, of = [triangles[whole]], [whole]
    for some in (1, 2):
        which = np.flatnonzero(count == some)
        # First the corner that is alone on its side; the order of the three stays.
        alone = (inside[which] if some == 1 else ~inside[which]).argmax(axis=1)
        turn = (alone[:, None] + np.arange(3)) % 3
        p, d = triangles[which[:, None], turn], depth[which[:, None], turn]
        to_next, to_last = (p[:, 0] + (d[:, 0] / (d[:, 0] - d[:, k]))[:, None] * (p[:, k] - p[:, 0]) for k in (1, 2))
        if some == 1:
            pieces.append(np.stack([p[:, 0], to_next, to_last], axis=1)), of.append(which)
        else:
            pieces.append(np.stack([to_next, p[:, 1], p[:, 2]], axis=1)), of.append(which)
            pieces.append(np.stack([to_next, p[:, 2], to_last], axis=1)), of.append(which)
    return np.concatenate(pieces), np.concatenate(of)
