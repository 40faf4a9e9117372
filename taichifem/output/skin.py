"""What of the bodies is seen: their surface, or the one that is embedded in them. It follows cracks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from taichifem.mesh.clipping import Inside, clip
from taichifem.mesh.connectivity import boundary_faces
from taichifem.mesh.embedded import Embedding, barycentric, embed


@dataclass(frozen=True)
class Seen:
    """Triangles (k,3) int32 of nodes, which come first, and of points that ride in elements.

    riders: shares (p,n) of the nodes in those points, or None.  nodes (n+p,): the node that moves most like each point,
    or None where all are nodes.  bodies, pieces, cracked: of each triangle (k,).
    colors (k,3) sRGB of its own, NaN where the surface has none.
    paint (n+p,5): sRGB and place in a texture of each point, NaN where the surface has none; None: no surface has any.
    """

    triangles: np.ndarray
    riders: csr_array | None
    nodes: np.ndarray | None
    bodies: np.ndarray
    pieces: np.ndarray
    cracked: np.ndarray
    colors: np.ndarray
    paint: np.ndarray | None = None

    def follow(self, values: np.ndarray) -> np.ndarray:
        """Values of all points, from those of the nodes (n,) or (n,3)."""
        return values if self.riders is None else np.concatenate([values, self.riders @ values])


class Skin:
    """The seen surface of one simulation; worked out again when its mesh changes, which has another surface then."""

    def __init__(self) -> None:
        self._surface: np.ndarray | None = None
        self._with_pieces = False
        self._riding: list[_Rider] | None = None

    def of(self, simulation: Any) -> Seen:
        """What is seen of `simulation` now; the same object as long as that stays."""
        surface, with_pieces = simulation.surface, simulation.scene.view.color == "piece"
        if self._surface is not surface or (with_pieces and not self._with_pieces):
            if self._riding is None:
                self._riding = _riders(simulation)
            if self._riding:
                self._seen = self._work_out(simulation, np.asarray(simulation.cells))
            else:
                self._seen = _plain(simulation, with_pieces)
            self._surface, self._with_pieces = surface, with_pieces or bool(self._riding)
        return self._seen

    def _work_out(self, simulation: Any, cells: np.ndarray) -> Seen:
        surface, bodies = np.asarray(simulation.surface), np.asarray(simulation.surface_bodies)
        shown = ~np.isin(bodies, [rider.body for rider in self._riding])
        cracked = np.asarray(simulation.crack_faces)
        parts = [(surface[shown], bodies[shown], np.asarray(simulation.surface_pieces)[shown], cracked[shown])]
        colors, elements, weights = [np.full((shown.sum(), 3), np.nan)], [], []
        first = len(simulation.rest_positions)
        paint = [np.full((first, 5), np.nan)]
        for rider in self._riding:
            triangles, element, weight = rider.corners(cells, np.asarray(simulation.cell_pieces))
            pieces = np.asarray(simulation.cell_pieces)[rider.home]
            parts.append(
                (triangles + first, np.full(len(triangles), rider.body), pieces, np.zeros(len(triangles), bool))
            )
            colors.append(rider.colors)
            paint.append(rider.paint[rider.vertices(triangles)])
            elements.append(element), weights.append(weight)
            first += len(element)
            opened = cracked & (bodies == rider.body)
            if opened.any():
                triangles, element, weight, kept = rider.crack(surface[opened], cells)
                pieces = np.asarray(simulation.surface_pieces)[opened][kept]
                parts.append((triangles + first, bodies[opened][kept], pieces, np.ones(len(triangles), bool)))
                colors.append(np.tile(rider.colors.mean(axis=0), (len(triangles), 1)))  # what was inside goes with it
                paint.append(np.full((len(element), 5), np.nan))
                elements.append(element), weights.append(weight)
                first += len(element)
        riding = Embedding(np.concatenate(elements), np.concatenate(weights))
        n = len(simulation.rest_positions)
        riders, main = riding.matrix(cells, n), riding.weights.argmax(axis=1)
        nodes = np.concatenate([np.arange(n), cells[riding.element, main]])
        columns = (np.concatenate(column) for column in zip(*parts, strict=True))
        triangles, bodies, pieces, cracked = columns
        colors, paint = np.concatenate(colors), np.concatenate(paint)
        painted = paint if np.isfinite(paint).any() else None
        return Seen(triangles.astype(np.int32), riders, nodes, bodies, pieces, cracked, colors, painted)


def _plain(simulation: Any, with_pieces: bool) -> Seen:
    triangles = np.asarray(simulation.surface, np.int32)
    colors = np.full((len(triangles), 3), np.nan)
    pieces = simulation.surface_pieces if with_pieces else np.zeros(len(triangles), dtype=int)
    bodies, cracked = np.asarray(simulation.surface_bodies), np.asarray(simulation.crack_faces)
    return Seen(triangles, None, None, bodies, pieces, cracked, colors)


def _riders(simulation: Any) -> list[_Rider]:
    """The embedded surfaces of the scene; the mesh of the simulation may have broken already."""
    found = []
    for b, body in enumerate(simulation.scene.bodies):
        if getattr(body, "embed", None) is not None:
            own = np.flatnonzero(np.asarray(simulation.cell_bodies) == b)
            found.append(_Rider(b, body, own))
    return found


class _Rider:
    """An embedded surface in its mesh at rest. home: the element (k,) that each triangle goes with."""

    def __init__(self, number: int, body: Any, cells: np.ndarray) -> None:
        self.body, self._of = number, cells
        self._nodes, self._whole = body.placed_points(), np.asarray(body.mesh.cells)
        self.points, self.triangles = body.placed(np.asarray(body.embed.points)), np.asarray(body.embed.triangles)
        self._clipped: dict[tuple, np.ndarray] = {}
        self._own, self._weights = body.embedding.element, body.embedding.weights
        self._home = embed(self.points[self.triangles].mean(axis=1), self._nodes, self._whole).element
        self.home = cells[self._home]
        shades, uv = body.embed.colors, body.embed.uv
        self.paint = np.full((len(self.points), 5), np.nan)
        self.paint[:, :3], self.paint[:, 3:] = np.nan if shades is None else shades, np.nan if uv is None else uv
        self.colors = (
            np.full((len(self.triangles), 3), np.nan) if shades is None else shades[self.triangles].mean(axis=1)
        )

    @cached_property
    def _inside(self) -> Inside:
        return Inside(self.points, self.triangles)

    def _in(self, points: np.ndarray, element: np.ndarray) -> np.ndarray:
        corners = self._nodes[self._whole[element]]
        edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
        return barycentric(points, corners[:, 0], np.linalg.inv(edges))

    def vertices(self, triangles: np.ndarray) -> np.ndarray:
        """Of which vertex of the surface each riding point of `corners` is (or is a copy)."""
        found = np.arange(max(len(self.points), int(triangles.max()) + 1))
        found[triangles] = self.triangles
        return found

    def corners(self, cells: np.ndarray, pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Triangles (k,3) of riding points, and those points' elements and weights.

        A corner that a crack has parted from its triangle goes with the triangle.
        """
        k = len(self.triangles)
        own, home = self._own[self.triangles], np.repeat(self._home[:, None], 3, axis=1)
        now, before = cells[self._of], self._whole
        touched = (before[own][..., :, None] == before[home][..., None, :]).any(axis=(2, 3))
        touches = (now[own][..., :, None] == now[home][..., None, :]).any(axis=(2, 3))
        parted = np.where(touched, ~touches, pieces[self._of[own]] != pieces[self._of[home]])
        lost = np.flatnonzero(parted.ravel())
        triangles = self.triangles.copy().ravel()
        vertices, carriers = triangles[lost], home.ravel()[lost]
        triangles[lost] = len(self.points) + np.arange(len(lost))
        element = np.concatenate([self._own, carriers])
        weights = np.concatenate([self._weights, self._in(self.points[vertices], carriers)])
        return triangles.reshape(k, 3), self._of[element], weights

    def crack(self, faces: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """What of the faces (f,3) that cracks opened lies inside of the surface.

        Triangles (k,3) of riding points, those points' elements and weights, and the face (k,) each triangle is of.
        """
        boundary, owner = boundary_faces(cells[self._of])
        place = {frozenset(face): e for face, e in zip(boundary.tolist(), owner.tolist(), strict=True)}
        element = np.array([place[frozenset(face)] for face in faces.tolist()])
        corner = (cells[self._of][element][:, None] == faces[:, :, None]).argmax(axis=2)
        # Where a face lies in the mesh at rest never changes.
        names = list(zip(element.tolist(), map(tuple, corner.tolist()), strict=True))
        new = np.array([f for f, name in enumerate(names) if name not in self._clipped], dtype=int)
        if len(new):
            at = self._nodes[self._whole[element[new, None], corner[new]]]
            parts, of = clip(at, self._inside)
            for k, f in enumerate(new):
                self._clipped[names[f]] = parts[of == k]
        parts = [self._clipped[name] for name in names]
        of = np.repeat(np.arange(len(faces)), [len(part) for part in parts])
        weights = np.zeros((len(of), 3, 4))
        weights[np.arange(len(of))[:, None, None], np.arange(3)[:, None], corner[of][:, None]] = np.concatenate(parts)
        triangles = np.arange(3 * len(of)).reshape(-1, 3)
        return triangles, self._of[np.repeat(element[of], 3)], weights.reshape(-1, 4), of
