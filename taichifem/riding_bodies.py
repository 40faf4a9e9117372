"""Bodies in which surfaces ride that meet colliders in their mesh's place."""

from __future__ import annotations

import numpy as np

from taichifem import carrying, transfer
from taichifem.description import Body, Scene
from taichifem.layout import Layout
from taichifem.meeting_bodies import MeetingBodies
from taichifem.mesh.embedded import winding_number
from taichifem.processes.riding import Riding

INSIDE = 0.5
"""Winding number of the surface above which a node is inside of it: only where cracks bare it may it touch."""

FEW = 4
"""A piece with fewer vertices than this cannot lie on them: its nodes touch too."""

_RIDING = "riding_"


class RidingBodies(MeetingBodies):
    """Bodies whose embedded surfaces keep out of colliders; the nodes of the mesh around them do not."""

    _riding: Riding | None = None

    def __init__(self, scene: Scene, *, precision: str, arch: str | None, threads: int | None) -> None:
        super().__init__(scene, precision=precision, arch=arch, threads=threads)
        if any(body.embed is not None for body in scene.bodies):
            self._embed(self._whole)
            self._shield()

    def _embed(self, whole: Layout) -> None:
        """Give the world the embedded vertices. Elements keep their numbers when they part, so that is done once."""
        element, weights, outside = [], [], np.zeros(len(whole.rest), dtype=bool)
        first_node = first_cell = 0
        for body in self.scene.bodies:
            nodes, cells = len(body.mesh.points), len(body.mesh.cells)
            if body.embed is not None:
                element.append(first_cell + body.embedding.element)
                weights.append(body.embedding.weights)
                outside[first_node : first_node + nodes] = _outside(body)
            first_node, first_cell = first_node + nodes, first_cell + cells
        self._carriers, self._weights, self._outside = np.concatenate(element), np.concatenate(weights), outside
        with self._kernels():
            explicit = self.scene.integrator == "symplectic-euler"
            carriers = whole.cell_number[self._carriers]
            self._riding = Riding(self._world, carriers, self._weights, lumped=explicit)

    def _fill_topology(self) -> None:
        super()._fill_topology()
        if self._riding is not None:
            self._shield()

    def _shield(self) -> None:
        """Tell the world which nodes touch nothing themselves: those outside of a surface that touches for them."""
        count, of_cell, of_node = self._labelled
        carried = np.bincount(of_cell[self._carriers], minlength=count) >= FEW
        shielded = self._outside[self.origins] & carried[of_node]
        with self._kernels():
            transfer.write_integers(self._world.shielded, shielded[self._layout.node_order])

    def _meet(self, dt: float) -> None:
        super()._meet(dt)
        if self._riding is not None:
            with self._kernels():
                self._riding.find(self._world, self._counts, dt)

    def _read_contacts(self, n_colliders: int) -> dict[str, np.ndarray]:
        """State of the contacts of nodes (`carrying.read_contacts`) and of embedded vertices (`Riding.state`)."""
        with self._kernels():
            contacts = carrying.read_contacts(self._world, n_colliders, self._counts.nodes)
            if self._riding is not None:
                found = self._riding.state(self._world, n_colliders)
                contacts |= {_RIDING + name: values for name, values in found.items()}
        return contacts

    def _pressed_points(self, collider: int) -> tuple[np.ndarray, np.ndarray]:
        """Nodes and embedded vertices (m,3) [m], and how hard `collider` presses on each (m,) [N]."""
        contacts = self._read_contacts(collider + 1)
        with self._kernels():
            x = transfer.read(self._world, self._world.x, self._counts.nodes)
        points, pressed = [x], [contacts["pressed"][collider]]
        if self._riding is not None:
            corners = x[self._layout.cells[self._layout.cell_number[self._carriers]]]
            points.append(np.einsum("pa,pab->pb", self._weights, corners))
            pressed.append(contacts[_RIDING + "pressed"][collider])
        return np.concatenate(points), np.concatenate(pressed)

    def _write_contacts(self, contacts: dict[str, np.ndarray]) -> None:
        """The inverse of `_read_contacts`."""
        with self._kernels():
            carrying.write_contacts(self._world, contacts)
            if self._riding is not None:
                state = {name.removeprefix(_RIDING): v for name, v in contacts.items() if name.startswith(_RIDING)}
                self._riding.set_state(self._world, state)


def _outside(body: Body) -> np.ndarray:
    """Which nodes (n,) of a body's mesh are outside of its embedded surface."""
    points, triangles = np.asarray(body.embed.points, dtype=float), np.asarray(body.embed.triangles)
    return winding_number(body.mesh.points, points, triangles) < INSIDE
