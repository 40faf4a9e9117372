"""Boundary elements: homogeneous linear elastostatics from the surface alone (Bridson, p. 2; James & Pai 1999).

Collocation at the vertices, displacements linear on triangles: H u = G t, from which the displacements by any
tractions are worked out once. Tractions are constant on triangles where they are given, and linear around the vertices
where they are reactions, so that edges at which given tractions jump are no trouble.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg

from taichifem.errors import InputError
from taichifem.mesh.surfaces import closed_surface
from taichifem.reduced.compliance import Compliance
from taichifem.reduced.kelvin import integrals
from taichifem.supports import rigid_motions

CHUNK = 4_000_000
"""Numbers that integrals may take at a time."""


class BoundaryElements:
    """A body by its closed surface: points (n,3) [m], outward triangles (k,3), and E [Pa], nu.

    Raises InputError if the surface is open.
    """

    def __init__(self, points: np.ndarray, triangles: np.ndarray, *, youngs: float, poisson: float) -> None:
        try:
            closed_surface(points, triangles)
        except InputError as error:
            raise InputError(f'{error}; or use model = "condensed", which takes any solid mesh') from None
        self.points, self.triangles = np.asarray(points, dtype=float), np.asarray(triangles)
        self.youngs, self.poisson = youngs, poisson
        self.mu = youngs / (2 * (1 + poisson))
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        self.areas = 0.5 * np.linalg.norm(normal, axis=1)
        self.normals = normal / (2 * self.areas[:, None])
        self.rigid, _ = np.linalg.qr(rigid_motions(self.points, 3).reshape(-1, 6))
        self._assemble()

    def _assemble(self) -> None:
        """H (3n,3n), G for tractions around vertices (3n,3n) and on triangles (3n,3k)."""
        n, k = len(self.points), len(self.triangles)
        self.H, self.G, self.G_faces = np.zeros((n, 3, n, 3)), np.zeros((n, 3, n, 3)), np.zeros((n, 3, k, 3))
        rows = max(1, CHUNK // (54 * k))
        for first in range(0, n, rows):
            count = min(rows, n - first)
            U, T = integrals(
                self.points, self.points, self.triangles, mu=self.mu, nu=self.poisson, first=first, rows=count
            )
            part = slice(first, first + count)
            self.G_faces[part] = U.sum(axis=2).transpose(0, 2, 1, 3)
            for corner in range(3):
                to = self.triangles[:, corner]
                for target, source in ((self.G, U), (self.H, T)):
                    _add_columns(target[part], to, source[:, :, corner].transpose(0, 2, 1, 3))
        # A shift has no tractions: that gives the singular parts. Nor has a turn: what is left of one is the error of
        # the quadrature, and is taken out.
        self.H[np.arange(n), :, np.arange(n), :] = 0
        self.H[np.arange(n), :, np.arange(n), :] = -self.H.sum(axis=2)
        self.H, self.G = self.H.reshape(3 * n, 3 * n), self.G.reshape(3 * n, 3 * n)
        self.G_faces = self.G_faces.reshape(3 * n, 3 * k)
        turn = self.H @ self.rigid
        self.quadrature_error = float(np.abs(turn).max() / np.abs(self.H).max())
        self.H -= turn @ self.rigid.T

    @cached_property
    def weights(self) -> np.ndarray:
        """Area [m^2] that belongs to each vertex (n,)."""
        return np.bincount(self.triangles.ravel(), np.repeat(self.areas / 3, 3), minlength=len(self.points))

    @cached_property
    def _inverse(self) -> np.ndarray:
        """Displacements by right-hand sides of H u = b (3n,3n), without rigid motions."""
        m = len(self.H)
        weighted = np.repeat(self.weights / self.weights.mean(), 3)[:, None] * self.rigid
        bordered = np.block([[self.H, weighted], [self.rigid.T, np.zeros((6, 6))]])
        return scipy.linalg.inv(bordered, overwrite_a=True)[:m, :m]

    @cached_property
    def face_compliance(self) -> np.ndarray:
        """Displacement (3n,3k) by tractions on the triangles."""
        return self._inverse @ self.G_faces

    @cached_property
    def compliance(self) -> Compliance:
        """Displacement by tractions around the vertices [Pa], linear on the triangles next to them."""
        corners = self.triangles
        mass = np.zeros((len(self.points), len(self.points)))
        for a in range(3):
            for b in range(3):
                np.add.at(mass, (corners[:, a], corners[:, b]), self.areas * (1 / 6 if a == b else 1 / 12))
        motions = self.rigid.reshape(-1, 3, 6)
        balance = np.einsum("nm,nar->rma", mass, motions).reshape(6, -1)
        return Compliance(self._inverse @ self.G, self.rigid, balance)

    def stiffen(self, youngs: float) -> None:
        """Be of another Young's modulus [Pa]: tractions do less by as much, and nothing is integrated again."""
        softer = self.youngs / youngs
        self.youngs, self.mu = youngs, self.mu / softer
        # What was worked out from G, or is so now, before G is another.
        self.face_compliance *= softer
        self.compliance = replace(self.compliance, matrix=softer * self.compliance.matrix)
        self.G *= softer
        self.G_faces *= softer

    def resultant(self, tractions: np.ndarray) -> np.ndarray:
        """What tractions (k,3) [Pa] on the triangles do to the rigid motions (6,)."""
        middle = self.rigid.reshape(-1, 3, 6)[self.triangles].mean(axis=1)
        return np.einsum("kar,ka,k->r", middle, tractions, self.areas)

    def displacement(
        self, tractions: np.ndarray, *, held: np.ndarray = (), target: np.ndarray | None = None
    ) -> np.ndarray:
        """Of the vertices (n,3) [m] under tractions (k,3) [Pa] on the triangles.

        held: vertices (h,) at `target` (h,3) [m], at rest if None. Without them the tractions must be in balance, and
        there is no rigid motion.
        """
        held = np.asarray(held, dtype=int)
        free = self.face_compliance @ tractions.ravel()
        if not len(held):
            return free.reshape(-1, 3)
        axes = (3 * held[:, None] + np.arange(3)).ravel()
        target = np.zeros(len(axes)) if target is None else np.asarray(target, dtype=float).ravel()
        return self.compliance.displaced(free, self.resultant(tractions), axes, target).displacement.reshape(-1, 3)

    def reactions(self, displacement: np.ndarray) -> np.ndarray:
        """Tractions (n,3) [Pa] around the vertices that hold all of them at a displacement (n,3) [m]."""
        return np.linalg.solve(self.G, self.H @ displacement.ravel()).reshape(-1, 3)

    def stress(self, displacement: np.ndarray, tractions: np.ndarray) -> np.ndarray:
        """Stress of each triangle (k,3,3) [Pa], by how it is stretched and what acts on it (k,3) [Pa]."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        first = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
        axes = np.stack([first, np.cross(self.normals, first), self.normals], axis=1)
        flat = np.einsum("kab,kcb->kac", axes[:, :2], np.stack([b - a, c - a], axis=1))
        moved = displacement[self.triangles]
        rise = np.einsum("kab,kcb->kac", axes[:, :2], moved[:, 1:] - moved[:, :1])
        gradient = rise @ np.linalg.inv(flat)
        strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
        pushed = np.einsum("kab,kb->ka", axes, tractions)
        nu, local = self.poisson, np.zeros((len(strain), 3, 3))
        plane = self.youngs / (1 - nu**2)
        trace = np.trace(strain, axis1=1, axis2=2)
        local[:, :2, :2] = plane * ((1 - nu) * strain + (nu * trace)[:, None, None] * np.eye(2))
        local[:, [0, 1], [0, 1]] += nu / (1 - nu) * pushed[:, 2:]
        local[:, 2, :] = local[:, :, 2] = pushed
        return axes.transpose(0, 2, 1) @ local @ axes

    def inside(self, places: np.ndarray) -> Inside:
        """How places (m,3) [m] inside follow the surface (Somigliana's identity)."""
        m, n, k = len(places), len(self.points), len(self.triangles)
        by_displacement, by_vertex = np.zeros((2, m, 3, n, 3))
        by_face = np.zeros((m, 3, k, 3))
        rows = max(1, CHUNK // (54 * k))
        for first in range(0, m, rows):
            part = slice(first, min(first + rows, m))
            U, T = integrals(
                places,
                self.points,
                self.triangles,
                mu=self.mu,
                nu=self.poisson,
                first=first,
                rows=part.stop - first,
                vertices=False,
            )
            by_face[part] = U.sum(axis=2).transpose(0, 2, 1, 3)
            for corner in range(3):
                to = self.triangles[:, corner]
                _add_columns(by_vertex[part], to, U[:, :, corner].transpose(0, 2, 1, 3))
                _add_columns(by_displacement[part], to, -T[:, :, corner].transpose(0, 2, 1, 3))
        # Inside a body that is shifted, all is.
        excess = by_displacement.sum(axis=2) - np.eye(3)
        by_displacement -= excess[:, :, None, :] / n
        follows = by_displacement.reshape(3 * m, -1)
        return Inside(follows, *(np.ascontiguousarray(block.reshape(3 * m, -1).T) for block in (by_vertex, by_face)))


@dataclass(frozen=True)
class Inside:
    """Displacement of m places by that of the n vertices (3m,3n); rows of what tractions around them (3n,3m), and on
    the k triangles (3k,3m), do to it."""

    by_displacement: np.ndarray
    by_vertex: np.ndarray
    by_face: np.ndarray

    def displacement(self, u: np.ndarray, around: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """(m,3) [m] for displacements (n,3) and tractions (n,3), (k,3), of which many are zero."""
        real = self.by_displacement.dtype
        found = self.by_displacement @ u.ravel().astype(real)
        for rows, tractions in ((self.by_vertex, around.ravel()), (self.by_face, faces.ravel())):
            acts = np.flatnonzero(tractions)
            found += tractions[acts].astype(real) @ (rows if len(acts) == len(rows) else rows[acts])
        return found.reshape(-1, 3).astype(float)

    def scaled(self, softer: float) -> Inside:
        """Of a body in which tractions do `softer` times as much."""
        return Inside(self.by_displacement, self.by_vertex * softer, self.by_face * softer)

    def single(self) -> Inside:
        """In single precision: half as much to read."""
        return Inside(*(m.astype(np.float32) for m in (self.by_displacement, self.by_vertex, self.by_face)))


def _add_columns(target: np.ndarray, to: np.ndarray, values: np.ndarray) -> None:
    """target[:, :, to] += values, where `to` names columns several times. (m,3,n,3), (k,), (m,3,k,3)."""
    order = np.argsort(to, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(to[order]) > 0])
    target[:, :, to[order][starts]] += np.add.reduceat(values[:, :, order], starts, axis=2)
