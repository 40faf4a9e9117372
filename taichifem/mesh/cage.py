"""A coarse mesh around a surface: the cubes of a grid that it touches or encloses, cut into tetrahedra."""

from __future__ import annotations

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh.embedded import EmbeddedSurface, winding_number
from taichifem.mesh.shapes import bar

TETS_PER_CUBE, TRIES = 5, 24
MARGIN = 0.02
"""Of a cube: how far the surface stays from the outside of the grid."""


def cage(surface: EmbeddedSurface, tets: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,3) [m] and tetrahedra (m,4), about `tets` of them, that enclose a surface.

    Raises InputError for fewer tetrahedra than a cube has.
    """
    if tets < TETS_PER_CUBE:
        raise InputError(f"a cage of {tets} tetrahedra is too small: ask for at least {TETS_PER_CUBE}")
    points = np.asarray(surface.points, dtype=float)
    low, extent = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-9)
    small, large = extent.max() / 200, 1.01 * extent.max()
    best = None
    for _ in range(TRIES):
        side = np.sqrt(small * large)
        cubes, counts, corner = _cubes(surface, low, extent, side)
        found = TETS_PER_CUBE * len(cubes)
        if best is None or abs(found - tets) < abs(TETS_PER_CUBE * len(best[0]) - tets):
            best = cubes, counts, corner, side
        small, large = (side, large) if found > tets else (small, side)
    return _cut(*best)


def _cubes(surface: EmbeddedSurface, low, extent, side) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cubes (c,3) of the grid that are needed, how many the grid has (3,), and its corner (3,)."""
    counts = np.maximum(np.ceil(extent / side + 2 * MARGIN).astype(int), 1)
    corner = low + 0.5 * (extent - counts * side)
    needed = np.zeros(counts, dtype=bool)
    for samples in _samples(surface, 0.25 * side):
        at = np.clip(((samples - corner) / side).astype(int), 0, counts - 1)
        needed[tuple(at.T)] = True
    if needed.size * len(surface.triangles) < 4e8:
        rest = np.argwhere(~needed)
        inside = winding_number(corner + (rest + 0.5) * side, surface.points, surface.triangles) > 0.5
        needed[tuple(rest[inside].T)] = True
    return np.argwhere(needed), counts, corner


def _samples(surface: EmbeddedSurface, spacing: float):
    """Points (s,3) on the surface, no farther apart than `spacing`: its triangles halved until they are small."""
    corners = surface.points[surface.triangles]
    while len(corners):
        yield corners.reshape(-1, 3)
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        sides = np.stack([np.linalg.norm(b - a, axis=1), np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1)])
        long = sides.max(axis=0) > spacing
        corners, which = corners[long], sides[:, long].argmax(axis=0)
        turned = corners[np.arange(len(corners))[:, None], (which[:, None] + np.arange(3)) % 3]
        middle = 0.5 * (turned[:, 0] + turned[:, 1])
        one = np.stack([turned[:, 0], middle, turned[:, 2]], axis=1)
        other = np.stack([middle, turned[:, 1], turned[:, 2]], axis=1)
        corners = np.concatenate([one, other])


def _cut(cubes: np.ndarray, counts: np.ndarray, corner: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """The tetrahedra of some cubes of a grid."""
    points, tets = bar(size=(counts * side).tolist(), cells=counts.tolist())
    number = np.ravel_multi_index(tuple(cubes.T), tuple(counts))
    chosen = tets.reshape(-1, TETS_PER_CUBE, 4)[np.sort(number)].reshape(-1, 4)
    used, chosen = np.unique(chosen, return_inverse=True)
    return points[used] + corner, chosen.reshape(-1, 4)
