"""Checks that turn raw arrays into a mesh that can be simulated, and puts right what can be put right."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from taichifem.errors import InputError

FLATTEST = 1e-12  # smallest volume over longest edge cubed; a regular tetrahedron has 0.118
COINCIDENT = 1e-9  # distance of two points over the diagonal of the bounding box


@dataclass(frozen=True)
class Repairs:
    """What validation put right or noticed.

    Attributes:
        flipped: tetrahedra whose vertex order was reversed.
        orphans: points that belonged to no tetrahedron and were dropped.
        duplicates: points that lie on top of another one; reported, not merged.
    """

    flipped: int = 0
    orphans: int = 0
    duplicates: int = 0


def few(indices: np.ndarray, limit: int = 5) -> str:
    """The first few of many indices, for a message of one line."""
    shown = ", ".join(str(int(i)) for i in indices[:limit])
    return shown if len(indices) <= limit else f"{shown}, ... ({len(indices)} in all)"


def signed_volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Volume (m,) of each tetrahedron, negative where its vertices are in mirrored order."""
    a, b, c, d = (points[cells[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def validate(points, cells, regions=None) -> tuple[np.ndarray, np.ndarray, np.ndarray, Repairs]:
    """Check and repair the arrays of a tetrahedral mesh.

    Args:
        points: (n, 3) positions in metres.
        cells: (m, 4) 0-based vertex indices.
        regions: (m,) integers, or None for all 0.

    Returns:
        Points (n', 3) float64, positively oriented cells (m, 4) int32, regions (m,) int32, and the repairs.

    Raises:
        InputError: an array has a wrong shape, a value that is not finite, an index out of range, or an
            element without volume.
    """
    points = _points(points)
    cells = _cells(cells, len(points))
    regions = _regions(regions, len(cells))
    points, cells, orphans = drop_orphans(points, cells)
    cells, flipped = _oriented(points, cells)
    return points, cells, regions, Repairs(flipped, orphans, _count_duplicates(points))


def drop_orphans(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Points that some cell uses, cells with the new numbers (int32), and how many points went."""
    used = np.zeros(len(points), bool)
    used[cells] = True
    number = np.cumsum(used) - 1
    return points[used], number[cells].astype(np.int32), int(len(points) - used.sum())


def _points(points) -> np.ndarray:
    try:
        points = np.array(points, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InputError("points must be an (n, 3) array of numbers") from None
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"points must have shape (n, 3), not {points.shape}; pad a flat mesh with a z column")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise InputError(f"points {few(bad)} are not finite; remove or correct them")
    return points


def _cells(cells, point_count: int) -> np.ndarray:
    try:
        cells = np.asarray(cells)
    except ValueError:
        raise InputError("cells must be an (m, 4) array of integers") from None
    if cells.size == 0:
        raise InputError("the mesh has no tetrahedra; give at least one")
    if cells.ndim != 2 or cells.shape[1] != 4:
        raise InputError(f"cells must have shape (m, 4), not {cells.shape}; only linear tetrahedra are simulated")
    if not np.issubdtype(cells.dtype, np.integer):
        raise InputError(f"cells must hold integer vertex indices, not {cells.dtype}")
    bad = np.flatnonzero(((cells < 0) | (cells >= point_count)).any(axis=1))
    if len(bad):
        raise InputError(
            f"tetrahedra {few(bad)} use vertex indices outside 0..{point_count - 1}; "
            "number the vertices from 0 and give every one of them"
        )
    return cells


def _regions(regions, cell_count: int) -> np.ndarray:
    if regions is None:
        return np.zeros(cell_count, np.int32)
    regions = np.asarray(regions)
    if regions.shape != (cell_count,) or not np.issubdtype(regions.dtype, np.integer):
        raise InputError(f"regions must be one integer per tetrahedron, shape ({cell_count},), not {regions.shape}")
    return regions.astype(np.int32)


def _oriented(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, int]:
    volumes = signed_volumes(points, cells)
    corners = points[cells]
    longest = np.max([np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i in range(4) for j in range(i)], 0)
    flat = np.flatnonzero(np.abs(volumes) <= FLATTEST * longest**3)
    if len(flat):
        raise InputError(f"tetrahedra {few(flat)} have no volume; remove them or move their vertices apart")
    mirrored = volumes < 0
    cells[mirrored] = cells[mirrored][:, [0, 2, 1, 3]]
    return cells, int(mirrored.sum())


def _count_duplicates(points: np.ndarray) -> int:
    reach = COINCIDENT * np.linalg.norm(np.ptp(points, axis=0))
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    return len(np.unique(pairs[:, 1]))
