"""Simple solids as arrays of points and tetrahedra.

Every body of revolution is centred at the origin with its axis along z. It takes a `resolution`, the number of
elements across its radius or its wall; all other counts follow, so that elements are about as long as wide.
"""

import itertools

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh.parameters import Arrays, each, grid_points, positive, whole
from taichifem.mesh.shapes2d import unit_disk

# Six Kuhn tetrahedra: from corner (0,0,0) to (1,1,1) along the axes in each of the six orders.
KUHN_ORDERS = [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)]
# Five tetrahedra in a cube whose corner (x,y,z) has number 4x+2y+z: four corners cut off and what is left.
FIVE = np.array([[0, 4, 2, 1], [6, 2, 4, 7], [5, 4, 1, 7], [3, 1, 2, 7], [1, 2, 4, 7]])


def bar(size=(1.0, 0.25, 0.25), cells=(16, 4, 4), split: int = 5) -> Arrays:
    """A box with one corner at the origin and the opposite one at `size`.

    Vertex (i, j, k) of the grid has number (i (ny+1) + j) (nz+1) + k.

    Args:
        size: lengths along x, y and z [m].
        cells: number of cubes along x, y and z.
        split: tetrahedra per cube: 5, mirrored from cube to cube so that faces match, or 6, Kuhn's.

    Raises:
        InputError: a size or a count is not positive, or split is neither 5 nor 6.
    """
    size = np.array(each("size", size, positive))
    counts = np.array(each("cells", cells, whole))
    if split not in (5, 6):
        raise InputError(f"split must be 5 or 6 tetrahedra per cube, not {split!r}")
    grid = grid_points(counts + 1)
    stride = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    cubes = grid_points(counts)
    corners = _kuhn() if split == 6 else grid_points(np.array([2, 2, 2]))[FIVE]
    tets = np.repeat(corners[None], len(cubes), axis=0)  # (cubes, tets, 4, 3)
    if split == 5:
        odd = cubes.sum(axis=1) % 2 == 1
        tets[odd, ..., 0] = 1 - tets[odd, ..., 0]
    tets = ((cubes[:, None, None] + tets) @ stride).reshape(-1, 4)
    return grid * (size / counts), _oriented(grid, tets)


def cylinder(radius: float = 0.25, height: float = 1.0, resolution: int = 3) -> Arrays:
    """A solid cylinder of the given radius and height [m], centred at the origin.

    Raises:
        InputError: a length or the resolution is not positive.
    """
    positive("radius", radius), positive("height", height), whole("resolution", resolution)
    points, triangles = unit_disk(resolution)
    layers = max(1, round(height / radius * resolution))
    levels = np.linspace(-height / 2, height / 2, layers + 1)
    stacked = np.array([np.column_stack([radius * points, np.full(len(points), z)]) for z in levels])
    return _swept(stacked, triangles, closed=False)


def hollow_cylinder(
    inner_radius: float = 0.15, outer_radius: float = 0.25, height: float = 0.5, resolution: int = 2
) -> Arrays:
    """A tube between two radii [m], centred at the origin; `resolution` elements through its wall.

    Raises:
        InputError: a length or the resolution is not positive, or the inner radius is not the smaller one.
    """
    positive("inner_radius", inner_radius), positive("outer_radius", outer_radius)
    positive("height", height), whole("resolution", resolution)
    if inner_radius >= outer_radius:
        raise InputError(f"inner_radius {inner_radius} must be smaller than outer_radius {outer_radius}")
    length = (outer_radius - inner_radius) / resolution
    around = max(8, round(np.pi * (inner_radius + outer_radius) / length))
    radii = np.linspace(inner_radius, outer_radius, resolution + 1)
    angles = np.arange(around) * (2 * np.pi / around)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    points = (radii[:, None, None] * ring).reshape(-1, 2)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(resolution), np.arange(around), indexing="ij"))
    a, b, c, d = (p * around + q % around for p, q in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    levels = np.linspace(-height / 2, height / 2, max(1, round(height / length)) + 1)
    stacked = np.array([np.column_stack([points, np.full(len(points), z)]) for z in levels])
    return _swept(stacked, triangles, closed=False)


def sphere(radius: float = 0.5, resolution: int = 5) -> Arrays:
    """A ball centred at the origin: 20 resolution^3 tetrahedra in shells about an icosahedron.

    Raises:
        InputError: the radius or the resolution is not positive.
    """
    positive("radius", radius), whole("resolution", resolution)
    corners, faces = _icosahedron()
    grid, tets = _simplex(resolution)
    weights = np.column_stack([grid[:, 0] - grid[:, 1], grid[:, 1] - grid[:, 2], grid[:, 2]]) / resolution
    flat = np.concatenate([weights @ corners[face] for face in faces])
    shell = np.tile(grid[:, 0], len(faces)) / resolution
    norms = np.linalg.norm(flat, axis=1)
    points = radius * flat * (shell / np.where(norms > 0, norms, 1))[:, None]
    cells = np.concatenate([tets + i * len(grid) for i in range(len(faces))])
    _, first, number = np.unique(np.round(flat * resolution * 1e6), axis=0, return_index=True, return_inverse=True)
    points, cells = points[first], number.reshape(-1)[cells]
    return points, _oriented(points, cells)


def torus(major_radius: float = 0.35, minor_radius: float = 0.15, resolution: int = 3) -> Arrays:
    """A solid ring in the xy plane; `resolution` elements across the radius of its tube.

    Args:
        major_radius: from the centre of the ring to the middle of the tube [m].
        minor_radius: of the tube [m].

    Raises:
        InputError: a radius or the resolution is not positive, or the tube is wider than the ring.
    """
    positive("major_radius", major_radius), positive("minor_radius", minor_radius)
    whole("resolution", resolution)
    if minor_radius >= major_radius:
        raise InputError(f"minor_radius {minor_radius} must be smaller than major_radius {major_radius}")
    disc, triangles = unit_disk(resolution)
    around = max(8, round(2 * np.pi * major_radius / minor_radius * resolution))
    angles = np.arange(around)[:, None] * (2 * np.pi / around)
    distance = major_radius + minor_radius * disc[:, 0]
    height = np.broadcast_to(minor_radius * disc[:, 1], (around, len(disc)))
    return _swept(np.stack([distance * np.cos(angles), distance * np.sin(angles), height], axis=-1), triangles, True)


SHAPES = {f.__name__: f for f in (bar, cylinder, hollow_cylinder, sphere, torus)}


def _kuhn() -> np.ndarray:
    """The corners (6, 4, 3) of Kuhn's tetrahedra in the unit cube."""
    steps = np.eye(3, dtype=int)[np.array(KUHN_ORDERS)]
    return np.concatenate([np.zeros((6, 1, 3), int), np.cumsum(steps, axis=1)], axis=1)


def _oriented(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    mirrored = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    tets[mirrored] = tets[mirrored][:, [0, 2, 1, 3]]
    return tets


def _swept(sections: np.ndarray, triangles: np.ndarray, closed: bool) -> Arrays:
    """Prisms between successive copies (s, n, 3) of a triangulated section, each cut into three tetrahedra.

    Each prism is cut by the order of its triangle's numbers, so neighbours cut their common side alike.
    """
    count, size = sections.shape[:2]
    points = sections.reshape(-1, 3)
    a, b, c = np.sort(triangles, axis=1).T
    tets = []
    for layer in range(count if closed else count - 1):
        low, high = layer * size, (layer + 1) % count * size
        tets += [
            np.column_stack([a + low, b + low, c + low, c + high]),
            np.column_stack([a + low, b + low, b + high, c + high]),
            np.column_stack([a + low, a + high, b + high, c + high]),
        ]
    return points, _oriented(points, np.concatenate(tets))


def _simplex(n: int) -> Arrays:
    """The n^3 Kuhn tetrahedra of the grid inside n >= x >= y >= z >= 0: integer points (p, 3) and cells."""
    cubes = grid_points(np.array([n, n, n]))
    tets = (cubes[:, None, None] + _kuhn()).reshape(-1, 4, 3)
    inside = (tets[..., 0] >= tets[..., 1]) & (tets[..., 1] >= tets[..., 2])
    tets = tets[inside.all(axis=1)]
    grid, number = np.unique(tets.reshape(-1, 3), axis=0, return_inverse=True)
    return grid, number.reshape(-1, 4)


def _icosahedron() -> Arrays:
    golden = (1 + 5**0.5) / 2
    base = np.array([[0, s, t * golden] for s in (-1, 1) for t in (-1, 1)])
    corners = np.concatenate([np.roll(base, shift, axis=1) for shift in range(3)])
    near = np.isclose(np.linalg.norm(corners[:, None] - corners, axis=-1), 2)
    faces = [
        f for f in itertools.combinations(range(12), 3) if all(near[i, j] for i, j in itertools.combinations(f, 2))
    ]
    return corners, np.array(faces)
