"""What stands behind a body that is known by its surface: condensed finite elements, or boundary elements.

Both say how the surface gives way to forces on its vertices, how far loads move it, and where that takes inner nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from taichifem.description import Material
from taichifem.errors import InputError
from taichifem.reduced.boundary_elements import BoundaryElements, Inside
from taichifem.reduced.compliance import Compliance
from taichifem.reduced.condensation import Condensation
from taichifem.reduced.parts import Parts

Shares = Mapping[int, float]
"""Which part of each load of the body acts."""


class CondensedSurface:
    """Finite elements without inner nodes; dt: of implicit steps [s], None for balance."""

    def __init__(self, parts: Parts, dt: float | None) -> None:
        self._parts, self._dt = parts, dt
        # Nodes that pins or handles take hold of stay as well.
        self.nodes = np.unique(np.concatenate([parts.skin, *(g.nodes for g in (*parts.pins, *parts.handles))]))
        self._body = Condensation(parts.stiffness, parts.rest, parts.masses, self.nodes)
        self._inner = np.zeros((len(self._body.inner), 3))
        self._answer_to(parts.material)

    def _answer_to(self, material: Material) -> None:
        """Invert what resists forces."""
        dt = self._dt
        if dt is None:
            self.compliance = self._body.compliance()
        else:
            self.compliance = self._body.step_compliance(
                dt, mass_damping=material.mass_damping, stiffness_damping=material.stiffness_damping
            )
            # Where a step goes from where the last one was, worked out once: one product a step, two with damping.
            mass = self._body.mass()
            self._by_inertia = self.compliance.matrix @ mass / dt
            self._by_drag = None
            if material.mass_damping or material.stiffness_damping:
                drag = material.mass_damping * mass + material.stiffness_damping * self._body.stiffness
                self._by_drag = self.compliance.matrix @ drag / dt
        self._acting: tuple | None = None

    def set_material(self, material: Material) -> None:
        """Another Young's modulus, other damping: inner nodes follow as before, and what is inverted is so anew."""
        self._body.stiffen(material.youngs / self._parts.material.youngs)
        self._parts = replace(self._parts, material=material)
        self._answer_to(material)

    def free(self, gravity: np.ndarray, shares: Shares, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (3s,) [m] by the loads and, in motion, inertia, with what is out of balance (r,)."""
        acting = gravity.tolist(), dict(shares)
        if acting != self._acting:
            self._acting, self._free = acting, self._loaded(gravity, shares)
        found, out_of_balance = self._free
        if self._dt is not None:
            found = found + self._by_inertia @ (u / self._dt + v)
            if self._by_drag is not None:
                found += self._by_drag @ u
        return found, out_of_balance

    def _loaded(self, gravity: np.ndarray, shares: Shares) -> tuple[np.ndarray, np.ndarray]:
        forces = self._parts.masses[:, None] * gravity
        for k, share in shares.items():
            forces = forces + share * self._parts.loads[k].forces
        if self._dt is None and len(self._body.inner):
            self._inner = self._body.inner_displacement(np.zeros(3 * len(self.nodes)), forces)
        load = self._body.load(forces)
        return self.compliance.matrix @ load, self.compliance.balance @ load

    def everywhere(self, u: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Displacement of all nodes (n,3) for that of the surface (3s,)."""
        found = np.empty_like(self._parts.rest)
        found[self.nodes] = u.reshape(-1, 3)
        found[self._body.inner] = self._body.inner_displacement(u) + self._inner
        return found

    def velocities(self, v: np.ndarray) -> np.ndarray:
        """Of all nodes (n,3) [m/s] for those of the surface (3s,)."""
        found = np.empty_like(self._parts.rest)
        found[self.nodes], found[self._body.inner] = v.reshape(-1, 3), self._body.inner_displacement(v)
        return found

    def energy(self, u: np.ndarray, forces: np.ndarray) -> float:
        """Elastic energy [J] of what the surface says."""
        return 0.5 * float(u @ (self._body.stiffness @ u))


class BoundarySurface:
    """Boundary elements on the surface of the mesh. Gravity enters by a particular solution, that of a hanging bar.

    Pins and handles take hold of the surface only; around the edge of what they hold, reactions reach out an element.
    """

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self.nodes, triangles = np.unique(parts.surface, return_inverse=True)
        m = parts.material
        try:
            self.elements = BoundaryElements(
                parts.rest[self.nodes], triangles.reshape(-1, 3), youngs=m.youngs, poisson=m.poisson
            )
        except InputError as error:
            raise InputError(f"{parts.label}: {error}") from None
        self._by_force = np.repeat(1 / self.elements.weights, 3)
        self._invert()
        self.tractions = np.zeros((len(parts.surface), 3))
        self._gravity = np.zeros(3)
        self._acting: tuple | None = None
        self._inner = np.setdiff1d(np.arange(len(parts.rest)), self.nodes)
        self._inside: Inside | None = None

    def _invert(self) -> None:
        bare = self.elements.compliance
        self.compliance: Compliance = replace(
            bare, matrix=bare.matrix * self._by_force, balance=bare.balance * self._by_force
        )

    def set_material(self, material: Material) -> None:
        """Another Young's modulus."""
        softer = self._parts.material.youngs / material.youngs
        self._parts = replace(self._parts, material=material)
        self.elements.stiffen(material.youngs)
        self._invert()
        self._acting = None
        if self._inside is not None:
            self._inside = self._inside.scaled(softer)

    @cached_property
    def _loads(self) -> list[np.ndarray]:
        """Each load as tractions on the triangles (k,3): forces of the vertices shared out by area."""
        e = self.elements
        per_area = 1 / np.maximum(e.weights, 1e-300)
        found = []
        for field in self._parts.loads:
            inside = np.linalg.norm(field.forces[self._inner], axis=1).max(initial=0.0)
            if inside > 0:
                raise InputError(f'{self._parts.label}: a force acts on inner nodes: use model = "condensed"')
            density = field.forces[self.nodes] * per_area[:, None]
            found.append(density[e.triangles].mean(axis=1))
        return found

    def free(self, gravity: np.ndarray, shares: Shares, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (3s,) [m] by the loads, with what is out of balance (6,)."""
        acting = gravity.tolist(), dict(shares)
        if acting != self._acting:
            self._acting, self._free = acting, self._loaded(gravity, shares)
        return self._free

    def _loaded(self, gravity: np.ndarray, shares: Shares) -> tuple[np.ndarray, np.ndarray]:
        e = self.elements
        tractions = np.zeros((len(e.triangles), 3))
        for k, share in shares.items():
            tractions += share * self._loads[k]
        self._gravity = gravity
        weight = self._parts.material.density * np.linalg.norm(gravity)
        if weight > 0:
            down = gravity / np.linalg.norm(gravity)
            depth = (e.points[e.triangles].mean(axis=1) - e.points.mean(axis=0)) @ down
            tractions += (weight * depth * (e.normals @ down))[:, None] * down
        self.tractions = tractions
        own = e.face_compliance @ tractions.ravel() + self._hanging(e.points).ravel()
        return own, e.resultant(tractions)

    def _hanging(self, places: np.ndarray) -> np.ndarray:
        """Displacement (m,3) [m] whose stress -w z along gravity is all that gravity of weight w asks for."""
        size = np.linalg.norm(self._gravity)
        if size == 0:
            return np.zeros_like(places)
        m, down = self._parts.material, self._gravity / size
        arm = places - self.elements.points.mean(axis=0)
        depth = arm @ down
        aside = arm - depth[:, None] * down
        w = m.density * size / m.youngs
        along = -0.5 * w * (depth**2 + m.poisson * (aside**2).sum(axis=1))
        return along[:, None] * down + (m.poisson * w * depth)[:, None] * aside

    def everywhere(self, u: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Displacement of all nodes (n,3) for that of the surface (3s,) and forces on its vertices (3s,) [N]."""
        e, rest = self.elements, self._parts.rest
        found = np.empty_like(rest)
        found[self.nodes] = u.reshape(-1, 3)
        around = (self._by_force * forces).reshape(-1, 3)
        own = found[self.nodes] - self._hanging(e.points)
        if len(self._inner):
            if self._inside is None:  # for whoever asks for inner nodes: made when that happens first
                self._inside = e.inside(rest[self._inner]).single()
            found[self._inner] = self._inside.displacement(own, around, self.tractions)
            found[self._inner] += self._hanging(rest[self._inner])
        return found

    def velocities(self, v: np.ndarray) -> np.ndarray:
        """Of all nodes (n,3) [m/s]: inner ones do not count, the model has no inertia."""
        found = np.zeros_like(self._parts.rest)
        found[self.nodes] = v.reshape(-1, 3)
        return found

    def energy(self, u: np.ndarray, forces: np.ndarray) -> float:
        """Elastic energy [J]: half of the work of all that acts on the surface (Clapeyron), that of weight left out."""
        e = self.elements
        own = u - self._hanging(e.points).ravel()
        faces = own.reshape(-1, 3)[e.triangles].mean(axis=1)
        return 0.5 * (float(forces @ own) + float(((self.tractions * faces).sum(axis=1) * e.areas).sum()))

    def surface_stress(self, u: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Stress of each triangle (k,3,3) [Pa] in the order of `Parts.surface`."""
        e = self.elements
        own = u.reshape(-1, 3) - self._hanging(e.points)
        around = (self._by_force * forces).reshape(-1, 3)[e.triangles].mean(axis=1)
        stress = e.stress(own, self.tractions + around)
        size = np.linalg.norm(self._gravity)
        if size > 0:
            down = self._gravity / size
            depth = (e.points[e.triangles].mean(axis=1) - e.points.mean(axis=0)) @ down
            stress -= (self._parts.material.density * size * depth)[:, None, None] * np.outer(down, down)
        return stress
