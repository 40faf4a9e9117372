"""Who touches whom in a mesh: boundary faces, edges, pieces. Whole-array NumPy throughout."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from taichifem.errors import InputError
from taichifem.mesh.validation import ELEMENTS, few

# The face opposite each vertex of a positively oriented tetrahedron, seen counter-clockwise from outside.
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
# The edge opposite each vertex of a counter-clockwise triangle: whoever follows it has the triangle on the left.
SIDES = np.array([[1, 2], [2, 0], [0, 1]])


def boundary_faces(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The faces that belong to one tetrahedron only, or the edges that belong to one triangle only.

    Args:
        cells: (m, 4) or (m, 3) vertex indices, positively oriented.

    Returns:
        Triangles (k, 3) whose normals point outward, or edges (k, 2) with the body on their left; and the cell (k,)
        that each belongs to.

    Raises:
        InputError: a face belongs to more than two cells.
    """
    corners = cells.shape[1]
    faces = cells[:, FACES if corners == 4 else SIDES].reshape(-1, corners - 1)
    order, starts, counts = _groups(np.sort(faces, axis=1))
    if np.any(counts > 2):
        crowded = np.repeat(counts > 2, counts)
        face = "a face" if corners == 4 else "an edge"
        raise InputError(
            f"{face} is shared by more than two {ELEMENTS[corners - 1]}, among them "
            f"{few(np.unique(order[crowded] // corners))}; remove the overlapping elements"
        )
    single = np.sort(order[starts[counts == 1]])
    return faces[single], single // corners


def across(cells: np.ndarray) -> np.ndarray:
    """The cell on the other side of the face, or edge, opposite each corner (m, d+1), or -1; of sound meshes."""
    corners = cells.shape[1]
    faces = cells[:, FACES if corners == 4 else SIDES].reshape(-1, corners - 1)
    order, starts, counts = _groups(np.sort(faces, axis=1))
    first = starts[counts == 2]
    beside = np.full(len(faces), -1, dtype=np.int32)
    beside[order[first]], beside[order[first + 1]] = order[first + 1] // corners, order[first] // corners
    return beside.reshape(-1, corners)


def overlapping(cells: np.ndarray) -> np.ndarray:
    """Counter-clockwise triangles (m, 3) that lie on the same side of an edge as another one: their numbers."""
    order, _, counts = _groups(cells[:, SIDES].reshape(-1, 2))
    return np.unique(order[np.repeat(counts > 1, counts)] // 3)


def edges(cells: np.ndarray) -> np.ndarray:
    """Every edge once: (e, 2) vertex indices, the smaller one first, in lexicographic order."""
    ends = EDGES if cells.shape[1] == 4 else SIDES
    pairs = np.sort(cells[:, ends].reshape(-1, 2), axis=1)
    order, starts, _ = _groups(pairs)
    return pairs[order[starts]]


def pieces(cells: np.ndarray, point_count: int) -> tuple[int, np.ndarray]:
    """Connected pieces of a mesh in which touching means sharing a vertex.

    Args:
        cells: (m, c) vertex indices of tetrahedra, triangles or edges.
        point_count: number n of points.

    Returns:
        The number of pieces, and for each point (n,) the number of its piece.
    """
    heads, tails = np.repeat(cells[:, 0], cells.shape[1] - 1), cells[:, 1:].reshape(-1)
    links = coo_array((np.ones(len(heads), np.int8), (heads, tails)), shape=(point_count, point_count))
    return connected_components(links, directed=False)


def _groups(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sort equal rows together: the order, where each group starts in it, and its length."""
    base = int(rows.max()) + 1
    if base ** rows.shape[1] < 2**63:  # the row fits into one integer, which sorts four times as fast
        key = np.zeros(len(rows), np.int64)
        for column in rows.T:
            key = key * base + column
        order = np.argsort(key, kind="stable")
        changes = np.diff(key[order]) != 0
    else:
        order = np.lexsort(rows.T[::-1])
        changes = np.any(np.diff(rows[order], axis=0) != 0, axis=1)
    starts = np.concatenate([[0], np.flatnonzero(changes) + 1])
    return order, starts, np.diff(starts, append=len(rows))
