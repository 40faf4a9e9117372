"""Tetrahedra that fill the solid where a function is negative.

Isosurface stuffing: F. Labelle, J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good
Dihedral Angles", ACM Transactions on Graphics 26(3), 2007. A body-centred cubic lattice covers the box;
lattice points close to the surface move onto it; tetrahedra that the surface still cuts are trimmed.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh.connectivity import edges
from taichifem.mesh.validation import drop_orphans

LONG_REACH, SHORT_REACH = (
    0.24999,
    0.41189,
)  # how near, in lengths of an edge, the surface pulls a lattice point
LIMIT = 20_000_000  # lattice cubes


def stuff(function: Callable[[np.ndarray], np.ndarray], lower, upper, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Mesh the solid where `function` is negative.

    Args:
        function: maps points (n, 3) [m] to values (n,), negative inside and positive outside, continuous.
        lower: lowest corner (3,) of a box that holds the solid [m].
        upper: highest corner (3,) of that box [m].
        spacing: edge of the lattice's cubes [m]; tetrahedra have edges of about that length.

    Returns:
        Points (n, 3) float64 and positively oriented cells (m, 4) int32.

    Raises:
        InputError: the box or the spacing makes no lattice, the solid is empty or leaves the box, or the
            function gives something else than one finite number per point.
    """
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    if lower.shape != (3,) or upper.shape != (3,) or not np.all(lower < upper):
        raise InputError(f"lower {lower.tolist()} must be below upper {upper.tolist()} along x, y and z")
    if not 0 < spacing < np.inf:
        raise InputError(f"spacing must be a positive length in metres, not {spacing!r}")
    counts = np.ceil((upper - lower) / spacing) + 2
    if counts.prod() > LIMIT:
        raise InputError(f"spacing {spacing} makes {counts.prod():.0f} lattice cubes; choose a coarser one")
    grid, cells = _lattice(counts.astype(int))
    points = (lower + upper - counts * spacing) / 2 + grid * (spacing / 2)

    value = _evaluate(function, points)
    on_rim = ((grid == 0) | (grid == 2 * counts)).any(axis=1) | (grid == 2 * counts - 1).any(axis=1)
    if np.any(value[on_rim] < 0):
        raise InputError("the solid leaves its box; move lower and upper further out")
    cells = cells[(value[cells] < 0).any(axis=1)]
    if not len(cells):
        raise InputError("the solid is empty at this spacing: the function is nowhere negative; refine the spacing")

    pairs = edges(cells)
    cuts = _crossings(function, points, value, pairs)
    value = _snap(points, value, grid, pairs, cuts)
    points, cells = _trim(points, cells, value, pairs, cuts)
    points, cells, _ = drop_orphans(points, cells)
    return points, cells


def _evaluate(function, points: np.ndarray) -> np.ndarray:
    value = np.asarray(function(points), float)
    if value.shape != (len(points),) or not np.isfinite(value).all():
        raise InputError(f"the function must give one finite number per point, shape ({len(points)},)")
    return value


def _lattice(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Body-centred cubic lattice: points (n, 3) in units of half a cube, and its tetrahedra.

    A tetrahedron joins the centres of two cubes that share a face with one edge of that face.
    """
    corner = np.stack(np.meshgrid(*(np.arange(c + 1) for c in counts), indexing="ij"), -1).reshape(-1, 3)
    centre = np.stack(np.meshgrid(*(np.arange(c) for c in counts), indexing="ij"), -1).reshape(-1, 3)

    def corner_number(p):
        return (p[:, 0] * (counts[1] + 1) + p[:, 1]) * (counts[2] + 1) + p[:, 2]

    def centre_number(p):
        return len(corner) + (p[:, 0] * counts[1] + p[:, 1]) * counts[2] + p[:, 2]

    step, cells = np.eye(3, dtype=int), []
    for axis in range(3):
        u, v = step[(axis + 1) % 3], step[(axis + 2) % 3]
        here = centre[centre[:, axis] < counts[axis] - 1]
        there = here + step[axis]
        ring = [there, there + u, there + u + v, there + v, there]  # corners of the shared face, in turn
        for p, q in pairwise(ring):
            ends = centre_number(here), centre_number(there)
            cells.append(np.column_stack([*ends, corner_number(p), corner_number(q)]))
    return np.concatenate([2 * corner, 2 * centre + 1]), np.concatenate(cells)


def _crossings(function, points: np.ndarray, value: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Where the surface cuts each edge, as a fraction (e,) from its first point; NaN where it does not."""
    crossing = np.full(len(pairs), np.nan)
    cut = np.flatnonzero(value[pairs[:, 0]] * value[pairs[:, 1]] < 0)
    start, span = points[pairs[cut, 0]], points[pairs[cut, 1]] - points[pairs[cut, 0]]
    starts_inside = value[pairs[cut, 0]] < 0
    low, high = np.zeros(len(cut)), np.ones(len(cut))
    for _ in range(30):
        middle = (low + high) / 2
        before = (_evaluate(function, start + middle[:, None] * span) < 0) == starts_inside
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    crossing[cut] = (low + high) / 2
    return crossing


def _snap(points, value, grid, pairs, cuts) -> np.ndarray:
    """Move points that are close to the surface onto it, in place; returns the values, 0 for those moved."""
    is_cut = np.flatnonzero(np.isfinite(cuts))
    a, b = pairs[is_cut].T
    is_long = (grid[a] % 2 == grid[b] % 2).all(axis=1)
    reach = np.where(is_long, LONG_REACH, SHORT_REACH)
    place = points[a] + cuts[is_cut, None] * (points[b] - points[a])
    length = np.linalg.norm(points[b] - points[a], axis=1)
    near, share = np.concatenate([a, b]), np.concatenate([cuts[is_cut], 1 - cuts[is_cut]])
    moves = np.flatnonzero(share < np.tile(reach, 2))
    moves = moves[np.argsort((share * np.tile(length, 2))[moves], kind="stable")]
    moved, first = np.unique(near[moves], return_index=True)  # the nearest of its cuts, for each point
    points[moved] = np.tile(place, (2, 1))[moves[first]]
    value = value.copy()
    value[moved] = 0
    return value


def _trim(points, cells, value, pairs, cuts) -> tuple[np.ndarray, np.ndarray]:
    """Keep what is inside: tetrahedra with an inside vertex, the part of each beyond the surface cut off.

    What remains of a tetrahedron is a corner (one inside vertex), a wedge (two) or a prism (three) with some
    vertices possibly merged; all are handled as prisms, and parts without volume fall away.
    """
    alive = (value[pairs[:, 0]] * value[pairs[:, 1]]) < 0
    a, b = pairs[alive].T
    new_points = points[a] + cuts[alive, None] * (points[b] - points[a])
    keys = pairs[:, 0] * len(points) + pairs[:, 1]
    cut_number = np.full(len(pairs), -1)
    cut_number[alive] = len(points) + np.arange(alive.sum())

    def cut_point(inside: np.ndarray, outside: np.ndarray) -> np.ndarray:
        """The cut on an edge; the outside vertex itself where that one lies on the surface."""
        row = np.searchsorted(keys, np.minimum(inside, outside) * len(points) + np.maximum(inside, outside))
        return np.where(value[outside] == 0, outside, cut_number[row])

    inside_first = np.argsort(value[cells] >= 0, axis=1, kind="stable")
    v = np.take_along_axis(cells, inside_first, axis=1)
    inside, outside = (value[v] < 0).sum(axis=1), (value[v] > 0).sum(axis=1)
    parts = [v[(inside > 0) & (outside == 0)]]
    p, q, r, s = v[(inside == 1) & (outside > 0)].T
    parts.append(np.column_stack([p, cut_point(p, q), cut_point(p, r), cut_point(p, s)]))
    p, q, r, s = v[(inside == 2) & (outside > 0)].T
    parts += _prism(p, cut_point(p, r), cut_point(p, s), q, cut_point(q, r), cut_point(q, s))
    p, q, r, s = v[(inside == 3) & (outside > 0)].T
    parts += _prism(p, q, r, cut_point(p, s), cut_point(q, s), cut_point(r, s))

    cells = np.concatenate(parts)
    corners = np.sort(cells, axis=1)
    cells = cells[(np.diff(corners, axis=1) > 0).all(axis=1)]
    points = np.concatenate([points, new_points])
    e1, e2, e3 = (points[cells[:, i]] - points[cells[:, 0]] for i in (1, 2, 3))
    mirrored = np.einsum("ij,ij->i", np.cross(e1, e2), e3) < 0
    cells[mirrored] = cells[mirrored][:, [0, 2, 1, 3]]
    return points, cells


def _prism(*corners: np.ndarray) -> list[np.ndarray]:
    """Three tetrahedra (n, 4) each from prisms with triangles (0, 1, 2) and (3, 4, 5).

    On each side the diagonal starts at the smallest number: neighbours agree, and every prism can be cut.
    """
    prism = np.column_stack(corners)
    turned = [[i, (i + 1) % 3, (i + 2) % 3] for i in range(3)]
    turns = np.array([t + [3 + i for i in t] for t in turned] + [[3 + i for i in t] + t for t in turned])
    w = np.take_along_axis(prism, turns[prism.argmin(axis=1)], axis=1)
    rising = np.minimum(w[:, 1], w[:, 5]) < np.minimum(w[:, 2], w[:, 4])
    return [
        w[rising][:, [0, 1, 2, 5]],
        w[rising][:, [0, 1, 5, 4]],
        w[~rising][:, [0, 1, 2, 4]],
        w[~rising][:, [0, 4, 2, 5]],
        w[:, [0, 4, 5, 3]],
    ]
