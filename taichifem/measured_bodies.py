"""The mechanics that follows from the state of bodies: forces, stiffness, stress, energy, and how long steps may be."""

from __future__ import annotations

import numpy as np
import scipy.sparse

from taichifem import elements, transfer
from taichifem.bodies import Bodies
from taichifem.integrators import symplectic_euler
from taichifem.layout import AXES
from taichifem.linear_algebra import assembly, bandwidth
from taichifem.linear_algebra.bandwidth import Bandwidth
from taichifem.linear_algebra.spectrum import highest_frequency
from taichifem.structure.pattern import to_sparse


class MeasuredBodies(Bodies):
    """Bodies that can be asked about the mechanics of the moment."""

    def elastic_forces(self) -> np.ndarray:
        """Elastic forces on the nodes (n,3) [N] at the current positions, without damping."""
        with self._kernels():
            self._laws.deform(self._world, self._counts, stiffness=1.0, due=self._due)
            elements.gather_forces(self._world, self._counts.nodes)
        return self._read(self._world.force)

    def stiffness(self, *, projected: bool = False) -> scipy.sparse.csr_matrix:
        """Tangent stiffness K (3n,3n) [N/m] at the current positions, nothing pinned.

        projected: make every element's tangent positive semi-definite first, as the implicit step does.
        Corotational elements give the warped stiffness R K R^T (Mueller & Gross 2004), unless the scene's integrator
        solves by Newton's method; then they, and all others always, give the exact tangent. Those with rotation "qr"
        stay with the warped one.
        """
        pattern = self._plan.pattern
        with self._kernels():
            self._laws.deform(self._world, self._counts, stiffness=1.0, due=self._due, projected=projected)
            assembly.assemble(self._world, self._counts.pairs, self._counts.elements, 0.0, 0.0)
            blocks = transfer.read(self._world, self._world.block, pattern.n_blocks).astype(np.float64)
        return to_sparse(pattern, blocks, self._layout.node_order)

    def product_bandwidth(self) -> Bandwidth:
        """How fast the linear solver's matrix product is, against a plain read; after a step of an implicit method."""
        blocks = self._plan.pattern.n_blocks
        with self._kernels():
            return bandwidth.measure(self._world, self._counts, blocks)

    def _measure(self) -> None:
        with self._kernels():
            self._laws.measure(self._world, self._counts, due=self._due)

    def cauchy_stress(self) -> np.ndarray:
        """Cauchy stress of each element (m,3,3) [Pa]."""
        self._measure()
        return self._read(self._world.stress)

    def von_mises(self) -> np.ndarray:
        """Equivalent (von Mises) stress of each element (m,) [Pa]."""
        stress = self.cauchy_stress()
        deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
        return np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))

    def plastic_strain(self) -> np.ndarray:
        """Plastic strain of each element (m,3,3), in its rotated frame."""
        return self._plastic()[0]

    def equivalent_plastic_strain(self) -> np.ndarray:
        """Accumulated plastic strain of each element (m,), measured as in uniaxial tension."""
        return self._plastic()[1]

    def _plastic(self) -> tuple[np.ndarray, np.ndarray]:
        if not self._laws.plastic:
            m = self._counts.elements
            return np.zeros((m, 3, 3)), np.zeros(m)
        with self._kernels():
            self._laws.show_plastic(self._world, self._counts, due=self._due)
        return self._read(self._world.stress), self._read(self._world.energy)

    def elastic_energy(self) -> float:
        """Elastic energy of everything [J]."""
        self._measure()
        return float(self._read(self._world.energy).sum())

    def turned_inside_out(self) -> np.ndarray:
        """Elements (k,) whose volume is not positive now; never linear ones, whose shape has no such meaning."""
        corners = self.positions[self.cells][:, :, AXES[self.dimension]]
        volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
        linear = np.array([m.model == "linear" for m in self._materials])
        return np.flatnonzero((volume <= 0) & ~linear[self._given_cells(self._layout.cell_materials)])

    def critical_step(self) -> float:
        """The longest stable step [s] of symplectic Euler at the current positions; infinite without stiffness.

        From the highest frequency of the elements, with tangents projected to positive semi-definite, and masses, on
        the axes that no pin holds for ever; and the largest damping.
        """
        held = self._surroundings.held_for_ever
        free = np.ones((self._counts.nodes, 3))
        np.minimum.at(free, self._layout.node_order[held[:, 0].astype(int)], 1.0 - held[:, 2:])
        frequency = highest_frequency(self.stiffness(projected=True), self.masses, free)
        damping = [max(getattr(m, name) for m in self._materials) for name in ("mass_damping", "stiffness_damping")]
        return symplectic_euler.critical_step(frequency, *damping)

    def reactions(self) -> np.ndarray:
        """Forces (n,3) [N] with which pins and contact hold the nodes in balance, as far as nothing moves.

        What elastic forces, loads and gravity leave over, on every node: zero but for round-off where nothing holds.
        """
        outside = self._read(self._world.outside) + self.masses[:, None] * self._gravity
        return -(self.elastic_forces() + outside)
