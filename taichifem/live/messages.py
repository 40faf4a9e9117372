"""What goes to the browser as bytes: the surface once, then where it is and how it is coloured, again and again.

All numbers are little-endian, arrays follow one another in the order of the arguments.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from taichifem.output.frame import Frame, Shape

TOPOLOGY, UPDATE = 1, 2
KINDS = ("plane", "sphere", "box")
CREASE = np.cos(np.radians(40.0))
"""Cosine of the angle between two triangles from which on the edge between them is drawn sharp."""


class Surface:
    """What of a frame is on the surface. Changes when bodies break.

    points (n,): those of the frame that are on it.  nodes (n,): of the scene, by which one takes hold of them.
    triangles (k,3): as numbers of these.
    corners (k,3): corners with the same number share a normal; there are `normals` of them.
    """

    def __init__(self, frame: Frame) -> None:
        self.of = frame.triangles
        self.points, local = np.unique(frame.triangles, return_inverse=True)
        self.nodes = self.points if frame.nodes is None else frame.nodes[self.points]
        self.triangles = local.reshape(-1, 3)
        self.corners = smoothing(np.asarray(frame.points, float)[self.points], self.triangles)
        self.normals = int(self.corners.max(initial=0)) + 1

    def shows(self, frame: Frame) -> bool:
        """Is it the surface of this frame, too?"""
        return self.of is frame.triangles or np.array_equal(self.of, frame.triangles)


def smoothing(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Numbers (k,3) of the corners: those around a node are one where the edges between them are smooth."""
    corners = triangles[:, [1, 2, 0]], triangles[:, [2, 0, 1]]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    # Edges, each as seen from its triangle, sorted so that the two sides of one follow each other.
    ends = np.stack([*corners], axis=-1).reshape(-1, 2)  # the edge opposite of corner 3 t + k
    owner = np.repeat(np.arange(len(triangles)), 3)
    key = np.sort(ends, axis=1) @ np.array([len(points), 1], dtype=np.int64)
    order = np.argsort(key, kind="stable")
    twins = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[twins], order[twins + 1]
    smooth = (normal[owner[one]] * normal[owner[two]]).sum(axis=1) > CREASE
    one, two = one[smooth], two[smooth]
    # Corner 3 t + k lies opposite of edge 3 t + k, so the edge's ends are the corners k + 1 and k + 2 of t.
    links = []
    for first in (0, 1):
        mine = 3 * owner[one] + (one + 1 + first) % 3
        node = ends[one, first]
        other = np.where(ends[two, 0] == node, 3 * owner[two] + (two + 1) % 3, 3 * owner[two] + (two + 2) % 3)
        links.append(np.stack([mine, other]))
    rows, columns = np.concatenate(links, axis=1)
    n = 3 * len(triangles)
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n, n))
    return connected_components(graph, directed=False)[1].reshape(-1, 3).astype(np.uint32)


def topology(surface: Surface, colors: np.ndarray, version: int) -> bytes:
    """Header of 6 uint32 (TOPOLOGY, version, nodes, triangles, normals, 0), then nodes, triangles, corners, colours.

    colors (k,3): sRGB in [0, 1]; they go as 4 bytes each.
    """
    n, k = len(surface.nodes), len(surface.triangles)
    head = np.array([TOPOLOGY, version, n, k, surface.normals, 0], "<u4")
    shades = np.zeros((k, 4), np.uint8)
    shades[:, :3] = np.rint(255 * np.clip(colors, 0, 1))
    parts = head, surface.nodes.astype("<u4"), surface.triangles.astype("<u4"), surface.corners.astype("<u4"), shades
    return b"".join(part.tobytes() for part in parts)


def update(frame: Frame, surface: Surface, *, version: int, number: int, time: float, hands: np.ndarray) -> bytes:
    """Header, then positions (n,3), colliders (c,16), hands (h,8), all float32, and values (n,) as bytes.

    Header: 8 uint32 (UPDATE, version, number, nodes, colliders, hands, has values, 0) and 4 float32 (time [s], low and
    high end of the colour bar, 0).  colliders: rows of R and c, the kind as in KINDS, and the size [m].
    hands: where they hold, where they want that, force [N], 1 if firm.
    """
    points = np.ascontiguousarray(frame.points[surface.points], "<f4")
    colliders = np.array([_collider(shape) for shape in frame.colliders], "<f4").reshape(-1, 16)
    shades = np.zeros(0, np.uint8)
    low, high = frame.value_range
    if frame.values is not None:
        share = (frame.values[surface.points] - low) / max(high - low, 1e-30)
        shades = np.rint(255 * np.clip(share, 0, 1)).astype(np.uint8)
    head = np.array([UPDATE, version, number, len(points), len(colliders), len(hands), len(shades) > 0, 0], "<u4")
    figures = np.array([time, low, high, 0], "<f4")
    parts = head, figures, points, colliders, np.asarray(hands, "<f4"), shades
    return b"".join(part.tobytes() for part in parts)


def _collider(shape: Shape) -> np.ndarray:
    size = np.full(3, shape.radius) if shape.kind == "sphere" else np.asarray(shape.size)
    pose = np.column_stack([shape.rotation, shape.center]).ravel()
    return np.concatenate([pose, [KINDS.index(shape.kind)], size])
