"""Checks that turn raw arrays into a mesh that can be simulated, and puts right what can be put right."""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from taichifem.errors import InputError

FLATTEST = 1e-12  # smallest volume over longest edge cubed (tetrahedron: 0.118), or area over its square (0.433)
COINCIDENT = 1e-9  # distance of two points over the diagonal of the bounding box
ELEMENTS = {2: "triangles", 3: "tetrahedra"}  # by the dimension of the mesh
SIZE = {2: "area", 3: "volume"}
PADDING = {2: "give x and z only: the body lies in the plane y = 0", 3: "pad a flat mesh with a z column"}


@dataclass(frozen=True)
class Repairs:
    """What validation put right or noticed.

    Attributes:
        flipped: elements whose vertex order was reversed.
        orphans: points that belonged to no element and were dropped.
        duplicates: points that lie on top of another one; reported, not merged.
    """

    flipped: int = 0
    orphans: int = 0
    duplicates: int = 0


def few(indices: np.ndarray, limit: int = 5) -> str:
    """The first few of many indices, for a message of one line."""
    shown = ", ".join(str(int(i)) for i in indices[:limit])
    return shown if len(indices) <= limit else f"{shown}, ... ({len(indices)} in all)"


def signed_sizes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Volume (m,) of each tetrahedron, or area of each triangle, negative where its vertices are in mirrored order."""
    sides = [points[cells[:, i]] - points[cells[:, 0]] for i in range(1, cells.shape[1])]
    if len(sides) == 2:
        (ux, uz), (vx, vz) = sides[0].T, sides[1].T
        return (ux * vz - uz * vx) / 2
    return np.einsum("ij,ij->i", np.cross(sides[0], sides[1]), sides[2]) / 6


def validate(points, cells, regions=None, dimension: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray, Repairs]:
    """Check and repair the arrays of a mesh of tetrahedra, or of triangles in the plane.

    Args:
        points: (n, dimension) positions in metres.
        cells: (m, dimension + 1) 0-based vertex indices.
        regions: (m,) integers, or None for all 0.
        dimension: 3 for tetrahedra, 2 for triangles.

    Returns:
        Points (n', dimension) float64, positively oriented cells (m, dimension + 1) int32, regions (m,) int32, and
        the repairs.

    Raises:
        InputError: an array has a wrong shape, a value that is not finite, an index out of range, or an
            element without volume or area.
    """
    points = checked_points(points, dimension)
    cells = checked_cells(cells, len(points), dimension)
    regions = _regions(regions, len(cells), dimension)
    points, cells, orphans = drop_orphans(points, cells)
    cells, flipped = _oriented(points, cells)
    return points, cells, regions, Repairs(flipped, orphans, _count_duplicates(points))


def drop_orphans(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Points that some cell uses, cells with the new numbers (int32), and how many points went."""
    used = np.zeros(len(points), bool)
    used[cells] = True
    number = np.cumsum(used) - 1
    return points[used], number[cells].astype(np.int32), int(len(points) - used.sum())


def checked_points(points, dimension: int) -> np.ndarray:
    """A copy (n, dimension) float64 of `points`, or an InputError that says what is wrong with them."""
    try:
        points = np.array(points, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InputError(f"points must be an (n, {dimension}) array of numbers") from None
    if points.ndim != 2 or points.shape[1] != dimension:
        raise InputError(f"points must have shape (n, {dimension}), not {points.shape}; {PADDING[dimension]}")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise InputError(f"points {few(bad)} are not finite; remove or correct them")
    return points


def checked_cells(cells, point_count: int, dimension: int) -> np.ndarray:
    """`cells` as an array (m, dimension + 1), or an InputError that says what is wrong with them."""
    elements, corners = ELEMENTS[dimension], dimension + 1
    try:
        cells = np.asarray(cells)
    except ValueError:
        raise InputError(f"cells must be an (m, {corners}) array of integers") from None
    if cells.size == 0:
        raise InputError(f"the mesh has no {elements}; give at least one")
    if cells.ndim != 2 or cells.shape[1] != corners:
        raise InputError(
            f"cells must have shape (m, {corners}), not {cells.shape}; only linear {elements} are simulated"
        )
    if not np.issubdtype(cells.dtype, np.integer):
        raise InputError(f"cells must hold integer vertex indices, not {cells.dtype}")
    bad = np.flatnonzero(((cells < 0) | (cells >= point_count)).any(axis=1))
    if len(bad):
        raise InputError(
            f"{elements} {few(bad)} use vertex indices outside 0..{point_count - 1}; "
            "number the vertices from 0 and give every one of them"
        )
    return cells


def _regions(regions, cell_count: int, dimension: int) -> np.ndarray:
    if regions is None:
        return np.zeros(cell_count, np.int32)
    regions = np.asarray(regions)
    if regions.shape != (cell_count,) or not np.issubdtype(regions.dtype, np.integer):
        raise InputError(
            f"regions must be one integer for each of the {ELEMENTS[dimension]}, "
            f"shape ({cell_count},), not {regions.shape}"
        )
    return regions.astype(np.int32)


def _oriented(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, int]:
    dimension, sizes, corners = points.shape[1], signed_sizes(points, cells), points[cells]
    pairs = itertools.combinations(range(dimension + 1), 2)
    longest = np.max([np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i, j in pairs], axis=0)
    flat = np.flatnonzero(np.abs(sizes) <= FLATTEST * longest**dimension)
    if len(flat):
        raise InputError(
            f"{ELEMENTS[dimension]} {few(flat)} have no {SIZE[dimension]}; remove them or move their vertices apart"
        )
    mirrored = sizes < 0
    cells[mirrored, 1:3] = cells[mirrored, 2:0:-1]
    return cells, int(mirrored.sum())


def _count_duplicates(points: np.ndarray) -> int:
    reach = COINCIDENT * np.linalg.norm(np.ptp(points, axis=0))
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    return len(np.unique(pairs[:, 1]))
