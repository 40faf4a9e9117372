"""The bodies of a scene of reduced models at an instant: the same face as `Bodies`, with few unknowns behind it."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from taichifem import runtime
from taichifem.description import Scene
from taichifem.errors import InputError
from taichifem.layout import lay_out
from taichifem.mesh.connectivity import boundary_faces
from taichifem.reduced.modal_body import ModalBody
from taichifem.reduced.obstacles import Obstacles
from taichifem.reduced.parts import Parts, linear_twin, take_apart
from taichifem.reduced.refusals import check_reduced
from taichifem.reduced.surface_body import SurfaceBody
from taichifem.reduced.surface_models import BoundarySurface, CondensedSurface
from taichifem.supports import check_supports


class ReducedBodies:
    """All bodies, each of its model. Arrays in and out are NumPy, float64, SI units; z points up.

    dt: of the steps to come [s].
    """

    splits, more_splits = 0, False

    def __init__(self, scene: Scene, *, precision: str, arch: str | None, threads: int | None, dt: float) -> None:
        if precision not in runtime.PRECISIONS:
            raise InputError(f'precision is {precision!r}: choose "f32" or "f64"')
        check_reduced(scene)
        runtime.start(arch=arch, threads=threads)
        self.scene, self.precision = scene, precision
        self._twin = linear_twin(scene)
        self._obstacles = Obstacles(scene)
        if scene.integrator == "quasi-static":
            check_supports(scene, lay_out(scene))
        self.bodies = [self._body(parts, dt) for parts in take_apart(scene, self._twin)]
        starts = np.searchsorted(self.node_bodies, np.arange(len(self.bodies) + 1))
        self._range = list(zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True))

    def _body(self, parts: Parts, dt: float) -> ModalBody | SurfaceBody:
        if parts.material.model == "modal":
            return ModalBody(parts, dt=dt, precision=self.precision)
        if parts.material.model == "bem":
            return SurfaceBody(parts, dt=dt, model=BoundarySurface(parts))
        still = self.scene.integrator == "quasi-static"
        return SurfaceBody(parts, dt=dt, model=CondensedSurface(parts, None if still else dt))

    # What does not change

    @property
    def dimension(self) -> int:
        """3: tetrahedra."""
        return 3

    @property
    def rest_positions(self) -> np.ndarray:
        """Rest positions (n,3) [m]."""
        return self._twin.rest_positions

    @property
    def cells(self) -> np.ndarray:
        """Elements (m,4)."""
        return self._twin.cells

    @property
    def cell_bodies(self) -> np.ndarray:
        """Body of each element (m,)."""
        return self._twin.cell_bodies

    @property
    def cell_regions(self) -> np.ndarray:
        """Region of each element in its mesh (m,)."""
        return self._twin.cell_regions

    @property
    def node_bodies(self) -> np.ndarray:
        """Body of each node (n,)."""
        return self._twin.node_bodies

    @property
    def surface(self) -> np.ndarray:
        """Outward triangles of all bodies (k,3), as node indices."""
        return self._twin.surface

    @property
    def surface_bodies(self) -> np.ndarray:
        """Body of each surface triangle (k,)."""
        return self._twin.surface_bodies

    @property
    def masses(self) -> np.ndarray:
        """Lumped node masses (n,) [kg]."""
        return self._twin.masses

    @property
    def crack_faces(self) -> np.ndarray:
        """Nothing breaks (k,)."""
        return np.zeros(len(self.surface), dtype=bool)

    @property
    def piece_count(self) -> int:
        """Number of pieces: sets of elements that hang together."""
        return self._twin.piece_count

    @property
    def cell_pieces(self) -> np.ndarray:
        """Piece of each element (m,)."""
        return self._twin.cell_pieces

    @property
    def surface_pieces(self) -> np.ndarray:
        """Piece of each triangle of the surface (k,)."""
        return self._twin.surface_pieces

    # State

    @property
    def positions(self) -> np.ndarray:
        """Node positions (n,3) [m]; those of inner nodes are worked out here."""
        return np.concatenate([body.positions for body in self.bodies])

    @property
    def velocities(self) -> np.ndarray:
        """Node velocities (n,3) [m/s]."""
        return np.concatenate([body.velocities for body in self.bodies])

    @property
    def contacts(self) -> int:
        """Contacts between points and colliders in the last step."""
        return sum(body.contacts for body in self.bodies)

    def elastic_energy(self) -> float:
        """Elastic energy of everything [J]."""
        return sum(body.elastic_energy for body in self.bodies)

    def cauchy_stress(self) -> np.ndarray:
        """Cauchy stress of each element (m,3,3) [Pa]."""
        displacement = np.concatenate([body.displacement for body in self.bodies])
        self._twin.set_positions(self.rest_positions + displacement)
        turns = np.array([body.rotation for body in self.bodies])[self.cell_bodies]
        stress = turns @ self._twin.cauchy_stress() @ turns.transpose(0, 2, 1)
        for b, body in enumerate(self.bodies):
            # Boundary elements know the stress of the surface: elements that lie there have it.
            found = body.surface_stress()
            if found is not None:
                stress[self._surface_cells[self.surface_bodies == b]] = found
        return stress

    @cached_property
    def _surface_cells(self) -> np.ndarray:
        """The element of each triangle of the surface (k,)."""
        faces, owner = boundary_faces(self.cells)
        cell_of = dict(zip(map(frozenset, faces.tolist()), owner.tolist(), strict=True))
        return np.array([cell_of[frozenset(face)] for face in self.surface.tolist()])

    def von_mises(self) -> np.ndarray:
        """Equivalent (von Mises) stress of each element (m,) [Pa]."""
        stress = self.cauchy_stress()
        deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
        return np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))

    def plastic_strain(self) -> np.ndarray:
        """Nothing flows: zeros (m,3,3)."""
        return np.zeros((len(self.cells), 3, 3))

    def equivalent_plastic_strain(self) -> np.ndarray:
        """Nothing flows: zeros (m,)."""
        return np.zeros(len(self.cells))

    def critical_step(self) -> float:
        """No step [s] is too long."""
        return math.inf
