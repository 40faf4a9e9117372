"""Triangle surfaces: merging seams, and making sure that they enclose something."""

import numpy as np
import trimesh

from taichifem.errors import InputError

COINCIDENT = 1e-8  # points nearer than this, over the diagonal of the bounding box, are one


def closed_surface(points, triangles) -> tuple[np.ndarray, np.ndarray]:
    """Weld a surface and check that it is closed, all its triangles facing outward.

    Args:
        points: (n, 3) positions [m].
        triangles: (k, 3) vertex indices.

    Returns:
        Points (p, 3) float64 without doubles, and triangles (q, 3) int64 without collapsed ones.

    Raises:
        InputError: the arrays have wrong shapes, indices or values, or the surface is open, twisted or flat.
    """
    points, triangles = np.asarray(points, np.float64), np.asarray(triangles)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError("the surface's points must be finite numbers of shape (n, 3)")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not np.issubdtype(triangles.dtype, np.integer):
        raise InputError("the surface's triangles must be integers of shape (k, 3)")
    if len(triangles) == 0 or triangles.min() < 0 or triangles.max() >= len(points):
        raise InputError("the surface has no triangles, or triangles that use points it does not have")
    points, triangles = _weld(points, triangles)

    open_edges, twisted_edges = _count_bad_edges(triangles)
    if open_edges:
        raise InputError(
            f"the surface is not closed: {open_edges} edges are open; "
            "fill its holes (in Blender: Mesh > Clean Up > Fill Holes) and export it again"
        )
    if twisted_edges:
        mesh = trimesh.Trimesh(points, triangles, process=False)
        trimesh.repair.fix_winding(mesh)
        triangles = np.array(mesh.faces)
        if _count_bad_edges(triangles)[1]:
            raise InputError(
                f"neighbouring triangles face opposite ways at {twisted_edges} edges; "
                "recalculate the normals (in Blender: Mesh > Normals > Recalculate Outside)"
            )
    volume = enclosed_volume(points, triangles)
    if abs(volume) <= 1e-9 * np.linalg.norm(np.ptp(points, axis=0)) ** 3:
        raise InputError("the surface encloses no volume; give it some thickness")
    return points, triangles if volume > 0 else triangles[:, ::-1].copy()


def enclosed_volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Volume [m^3] inside a closed surface by the divergence theorem; negative if it faces inward."""
    a, b, c = (points[triangles[:, i]] - points[triangles[0, 0]] for i in range(3))
    return float(np.einsum("ij,ij->", np.cross(a, b), c) / 6)


def _weld(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points = points - 0.0  # a copy, with -0 made 0
    step = COINCIDENT * np.linalg.norm(np.ptp(points, axis=0)) or 1.0
    _, first, number = np.unique(np.round(points / step), axis=0, return_index=True, return_inverse=True)
    triangles = number.reshape(-1)[triangles].astype(np.int64)
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    used, triangles = np.unique(triangles, return_inverse=True)
    return points[first][used], triangles.reshape(-1, 3)


def _count_bad_edges(triangles: np.ndarray) -> tuple[int, int]:
    """Edges that an odd number of triangles share, and edges passed more often one way than the other."""
    if len(triangles) == 0:
        return 0, 0
    heads, tails = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    pairs = np.column_stack([np.minimum(heads, tails), np.maximum(heads, tails)])
    _, number, uses = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    balance = np.bincount(number.reshape(-1), np.where(heads < tails, 1, -1))
    return int((uses % 2 == 1).sum()), int((balance != 0).sum())
