"""What is seen of bodies: their surface. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.description import Scene
from taichifem.mesh.connectivity import FACES


@dataclass(frozen=True)
class Surface:
    """Outward triangles (k,3), by the nodes of the scene and their copies; all elements of planar bodies.

    bodies (k,): whose they are.  cracked (k,): has fracture opened them?
    """

    triangles: np.ndarray
    bodies: np.ndarray
    cracked: np.ndarray


def whole_surface(scene: Scene) -> Surface:
    """The surface of bodies as the scene gives them."""
    triangles, first = [], 0
    for body in scene.bodies:
        triangles.append(body.mesh.surface() + first)
        first += len(body.mesh.points)
    sizes = [len(t) for t in triangles]
    return Surface(np.concatenate(triangles), np.repeat(np.arange(len(sizes)), sizes), np.zeros(sum(sizes), dtype=bool))


def split_surface(cells: np.ndarray, beside: np.ndarray, intact: np.ndarray, cell_bodies: np.ndarray) -> Surface:
    """The surface of elements (m,d+1) that were parted; `beside` as in `Splitting`, `intact` as that was at first."""
    if cells.shape[1] == 3:
        return Surface(cells, cell_bodies, np.zeros(len(cells), dtype=bool))
    free = np.flatnonzero(beside.ravel() < 0)
    element, corner = np.divmod(free, 4)
    return Surface(cells[element[:, None], FACES[corner]], cell_bodies[element], intact.ravel()[free] >= 0)
