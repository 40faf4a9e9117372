"""Simple plane shapes as arrays of points (n, 2), x and z, and counter-clockwise triangles (m, 3).

Round shapes are centred at the origin. `rings` is the number of layers of triangles from the centre, or from the
hole, to the rim; all other counts follow, so that triangles are about as long as wide.
"""

import itertools

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh.parameters import Arrays, each, grid_points, positive, whole

PATTERNS = ("alternating", "right")
THINNEST = 1e-6  # wall of a ring over its radius


def rectangle(size=(1.0, 0.25), cells=(16, 4), pattern: str = "alternating") -> Arrays:
    """A rectangle with its lower left corner at the origin and the opposite one at `size`.

    Vertex (i, k) of the grid has number i (nz+1) + k.

    Args:
        size: lengths along x and z [m].
        cells: number of rectangles along x and z, each cut into two triangles.
        pattern: the diagonals: "alternating" from rectangle to rectangle, which prefers no direction, or all of
            them "right", from the lower left to the upper right.

    Raises:
        InputError: a size or a count is not positive, or there is no such pattern.
    """
    size = np.array(each("size", size, positive, 2))
    shares, triangles = _unit_square(cells, pattern)
    return shares * size, triangles


def quadrilateral(corners, cells=(8, 8), pattern: str = "alternating") -> Arrays:
    """A convex quadrilateral, to which the grid of a rectangle is mapped bilinearly.

    Args:
        corners: (4, 2) positions [m], counter-clockwise; the grid's x goes from the first to the second, and its z
            from the first to the fourth.
        cells: number of quadrilaterals along the grid's x and z.
        pattern: the diagonals, as for a rectangle.

    Raises:
        InputError: the corners are not those of a convex quadrilateral, counter-clockwise; a count is not positive,
            or there is no such pattern.
    """
    try:
        corners = np.asarray(corners, float)
    except (TypeError, ValueError):
        raise InputError(f"corners must be four points [x, z], not {corners!r}") from None
    if corners.shape != (4, 2) or not np.isfinite(corners).all():
        raise InputError(f"corners must be four points [x, z] of finite numbers, not {corners.tolist()}")
    ahead = np.roll(corners, -1, axis=0) - corners
    behind = np.roll(ahead, 1, axis=0)
    turns = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
    if not np.all(turns > 1e-9 * np.ptp(corners, axis=0).max() ** 2):
        raise InputError(f"corners must go counter-clockwise about a convex quadrilateral, not {corners.tolist()}")
    shares, triangles = _unit_square(cells, pattern)
    (x, z), (a, b, c, d) = shares.T[..., None], corners
    return (1 - x) * ((1 - z) * a + z * d) + x * ((1 - z) * b + z * c), triangles


def disk(radius: float = 0.5, rings: int = 5) -> Arrays:
    """A disk of 6 rings^2 triangles.

    Args:
        radius: of the circle on which the rim's vertices lie [m].
        rings: layers of triangles from the centre to the rim.

    Raises:
        InputError: the radius or the number of rings is not positive.
    """
    positive("radius", radius), whole("rings", rings)
    points, triangles = unit_disk(rings)
    return radius * points, triangles


def ring(inner: float = 0.25, outer: float = 0.5, rings: int = 4) -> Arrays:
    """A disk with a round hole; its triangles grow with the distance from the centre and keep their shape.

    Every circle has the same number of vertices, a multiple of four, and is turned by half a step against the one
    before: in the plane of angle and logarithm of the radius the triangles are nearly equilateral. The hole's circle
    has vertices on both axes, and so has the rim's if `rings` is even.

    Args:
        inner: radius of the hole [m].
        outer: radius of the rim [m].
        rings: layers of triangles between the two.

    Raises:
        InputError: a radius or the number of rings is not positive, or inner is not the smaller radius.
    """
    positive("inner", inner), positive("outer", outer), whole("rings", rings)
    if inner >= outer * (1 - THINNEST):
        raise InputError(f"inner {inner} must be smaller than outer {outer}, by more than a millionth")
    around = 4 * max(2, round(3**0.5 * np.pi * rings / np.log(outer / inner) / 4))
    layer, step = grid_points(np.array([rings + 1, around])).T
    angles = (step + 0.5 * (layer % 2)) * (2 * np.pi / around)
    radii = np.concatenate([np.geomspace(inner, outer, rings + 1)[:rings], [outer]])[layer]
    low, j = grid_points(np.array([rings, around])).T
    even = low % 2 == 0

    def vertex(layer, step):
        return layer * around + step % around

    here, there = vertex(low, j), vertex(low + 1, j)
    next_here, next_there = vertex(low, j + 1), vertex(low + 1, j + 1)
    shorter = np.column_stack([here, np.where(even, there, next_there), next_here])  # their base on the inner circle
    longer = np.column_stack([np.where(even, next_here, here), there, next_there])
    points = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
    return points, np.stack([shorter, longer], axis=1).reshape(-1, 3)


SHAPES = {f.__name__: f for f in (rectangle, quadrilateral, disk, ring)}


def unit_disk(rings: int) -> Arrays:
    """The unit disk in rings of 6, 12, 18, ... points: points (n, 2), counter-clockwise triangles."""
    points, triangles = [np.zeros((1, 2))], []
    inner, outer = 0, 1  # first point of the previous ring and of this one
    for ring in range(1, rings + 1):
        angles = np.arange(6 * ring) * (np.pi / (3 * ring))
        points.append(np.column_stack([np.cos(angles), np.sin(angles)]) * ring / rings)
        for sector, step in itertools.product(range(6), range(ring)):
            a, b = (outer + (sector * ring + step + s) % (6 * ring) for s in (0, 1))
            p, q = (inner + (sector * (ring - 1) + step + s) % max(1, 6 * (ring - 1)) for s in (0, 1))
            triangles.append((a, b, p))
            if step < ring - 1:
                triangles.append((p, b, q))
        inner, outer = outer, outer + 6 * ring
    return np.concatenate(points), np.array(triangles)


def _unit_square(cells, pattern: str) -> Arrays:
    """The grid of the unit square: points (n, 2) from 0 to 1, and two triangles in each of its `cells`."""
    counts = np.array(each("cells", cells, whole, 2))
    if pattern not in PATTERNS:
        raise InputError(f"pattern must be one of {', '.join(map(repr, PATTERNS))}, not {pattern!r}")
    i, k = squares = grid_points(counts).T
    a = i * (counts[1] + 1) + k
    b, d = a + counts[1] + 1, a + 1
    c = b + 1
    rising = np.ones(len(a), bool) if pattern == "right" else squares.sum(axis=0) % 2 == 0
    first = np.column_stack([a, b, np.where(rising, c, d)])
    second = np.column_stack([np.where(rising, a, b), c, d])
    return grid_points(counts + 1) / counts, np.stack([first, second], axis=1).reshape(-1, 3)
