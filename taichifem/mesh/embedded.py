"""Surfaces that ride in a mesh of tetrahedra: any triangles, open, self-touching or with holes, and where they lie."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from taichifem.errors import InputError
from taichifem.mesh import reading
from taichifem.mesh.connectivity import boundary_faces

NEAR, FAR = 24, 400
"""Elements looked at around a point: first, and where none of those holds it."""

INSIDE = -1e-9
"""Barycentric coordinates above this count as inside."""

REACH = 0.15
"""Of the cage's extent: how far outside a surface may be."""

CHUNK = 2_000_000


@dataclass(frozen=True, eq=False)
class EmbeddedSurface:
    """points (p,3) [m], triangles (k,3), colors (p,3) sRGB in [0, 1] or None; file: where it came from.

    uv: (p,2) places in a texture, or None.
    """

    points: np.ndarray
    triangles: np.ndarray
    colors: np.ndarray | None = None
    file: str | None = None
    uv: np.ndarray | None = None

    @classmethod
    def from_file(cls, path: str | PathLike) -> EmbeddedSurface:
        """Read a surface (.obj .stl .ply .glb ...), or take that of a volume mesh or of `asset:NAME`.

        Raises InputError: there is no such file, or it has no triangles.
        """
        content = reading.read(path, surface_wanted=True)
        if isinstance(content, reading.Surface):
            return cls(content.points, content.triangles, content.colors, str(path), content.uv)
        triangles, _ = boundary_faces(np.asarray(content.cells))
        nodes, triangles = np.unique(triangles, return_inverse=True)
        return cls(np.asarray(content.points)[nodes], triangles.reshape(-1, 3), None, str(path))


@dataclass(frozen=True)
class Embedding:
    """Where points lie in a mesh: element (p,) and weights (p,d+1) of its nodes, which add up to 1."""

    element: np.ndarray
    weights: np.ndarray

    def points(self, positions: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """The points (p,3) for node positions (n,3) (or any node values) and elements (m,4)."""
        return np.einsum("pa,pab->pb", self.weights, positions[cells[self.element]])

    def matrix(self, cells: np.ndarray, nodes: int) -> csr_array:
        """The same as a sparse matrix (p,nodes): for meshes that are asked again and again."""
        p, corners = self.weights.shape
        starts = corners * np.arange(p + 1)
        return csr_array((self.weights.ravel(), cells[self.element].ravel(), starts), shape=(p, nodes))


def embed(points: np.ndarray, nodes: np.ndarray, cells: np.ndarray, *, reach: float = REACH) -> Embedding:
    """Barycentric weights of points (p,3) in the elements `cells` (m,4) of `nodes` (n,3) [m].

    Points outside take the element that they are nearest to, with weights below 0.
    Raises InputError for points farther outside than `reach` times the extent of the mesh.
    """
    origin = nodes[cells[:, 0]]
    inverse = np.linalg.inv((nodes[cells[:, 1:]] - origin[:, None]).transpose(0, 2, 1))
    tree = cKDTree(nodes[cells].mean(axis=1))
    element, weights = np.zeros(len(points), dtype=np.int64), np.full((len(points), 4), -np.inf)
    todo = np.arange(len(points))
    for count in (min(NEAR, len(cells)), min(FAR, len(cells))):
        for part in np.array_split(todo, max(1, len(todo) * count // CHUNK + 1)):
            if len(part):
                element[part], weights[part] = _best(points[part], tree, origin, inverse, count)
        todo = np.flatnonzero(weights.min(axis=1) < INSIDE)
    if len(todo):
        near, away = _nearest(points[todo], nodes, cells)
        farthest, extent = float(away.max()), float(np.linalg.norm(np.ptp(nodes, axis=0)))
        if farthest > reach * extent:
            raise InputError(
                f"the embedded surface reaches {farthest:.3g} m out of its mesh: use one that encloses it, as made by "
                "`taichifem mesh SURFACE --cage 500 -o CAGE.vtu`"
            )
        element[todo], weights[todo] = near, barycentric(points[todo], origin[near], inverse[near])
    return Embedding(element, weights)


def barycentric(points: np.ndarray, origin: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Coordinates (p,4) of points (p,3) in elements with first corners (p,3) and inverses of their edges (p,3,3)."""
    rest = np.einsum("pab,pb->pa", inverse, points - origin)
    return np.column_stack([1 - rest.sum(axis=1), rest])


def _best(points, tree, origin, inverse, count) -> tuple[np.ndarray, np.ndarray]:
    """Of the `count` nearest elements the one that holds each point, or comes nearest to that."""
    _, near = tree.query(points, k=count)
    near = near.reshape(len(points), -1)
    rest = np.einsum("pkab,pkb->pka", inverse[near], points[:, None] - origin[near])
    weights = np.concatenate([1 - rest.sum(axis=2, keepdims=True), rest], axis=2)
    best = weights.min(axis=2).argmax(axis=1)
    at = np.arange(len(points))
    return near[at, best], weights[at, best]


def _nearest(points: np.ndarray, nodes: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The element (p,) whose face on the boundary is nearest to each point, and how far it is [m]."""
    faces, owner = boundary_faces(cells)
    corners = nodes[faces]
    tree = cKDTree(corners.mean(axis=1))
    _, near = tree.query(points, k=min(32, len(faces)))
    near = near.reshape(len(points), -1)
    away = np.linalg.norm(closest_point(points[:, None], corners[near]) - points[:, None], axis=2)
    best = away.argmin(axis=1)
    at = np.arange(len(points))
    return owner[near[at, best]], away[at, best]


def closest_point(p: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The point (...,3) of each triangle (...,3,3) that is nearest to p (...,3): the best of its plane and sides."""
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    normal = np.cross(b - a, c - a)
    height = ((p - a) * normal).sum(-1, keepdims=True) / np.maximum((normal**2).sum(-1, keepdims=True), 1e-300)
    flat = p - height * normal
    inside = np.ones(flat.shape[:-1], dtype=bool)
    best, least = flat, np.full(inside.shape, np.inf)
    for s, t in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(t - s, flat - s) * normal).sum(-1) >= 0
        way = t - s
        share = ((p - s) * way).sum(-1, keepdims=True) / np.maximum((way**2).sum(-1, keepdims=True), 1e-300)
        on = s + np.clip(share, 0, 1) * way
        away = ((on - p) ** 2).sum(-1)
        best, least = np.where((away < least)[..., None], on, best), np.minimum(away, least)
    return np.where(inside[..., None], flat, best)


def winding_number(places: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """How often a surface winds around places (m,): about 1 inside and 0 outside, also where it has holes.

    A. Jacobson, L. Kavan, O. Sorkine-Hornung, Robust Inside-Outside Segmentation using Generalized Winding Numbers,
    2013; solid angles by Van Oosterom & Strackee, 1983.
    """
    total = np.zeros(len(places))
    for part in np.array_split(np.arange(len(places)), max(1, len(places) * len(triangles) // CHUNK + 1)):
        a, b, c = (points[triangles[:, k]][None] - places[part][:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(side, axis=2) for side in (a, b, c))
        top = (a * np.cross(b, c)).sum(-1)
        below = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
        total[part] = np.arctan2(top, below).sum(axis=1) / (2 * np.pi)
    return total
