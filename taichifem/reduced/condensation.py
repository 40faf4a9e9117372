"""Condensation: linear elasticity of the surface nodes alone, inner nodes eliminated by the Schur complement.

K_ss u_s + K_si u_i = f_s, K_is u_s + K_ii u_i = f_i gives S u_s = f_s - K_si K_ii^-1 f_i with S = K_ss - K_si K_ii^-1
K_is: exact in balance. In motion inner nodes follow the surface as they would in balance (Guyan 1965): u_i = T u_s.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from taichifem.reduced.compliance import Compliance
from taichifem.supports import rigid_motions

COLUMNS = 256


class Condensation:
    """A body of n nodes seen from s of them.

    stiffness: K (3n,3n) [N/m].  rest: (n,3) [m].  masses: (n,) [kg].  skin: (s,) the nodes that stay.
    Arrays of the surface are (3s,).
    """

    def __init__(
        self, stiffness: scipy.sparse.spmatrix, rest: np.ndarray, masses: np.ndarray, skin: np.ndarray
    ) -> None:
        n = len(rest)
        inner = np.setdiff1d(np.arange(n), skin)
        self.skin, self.inner = skin, inner
        s, i = ((3 * nodes[:, None] + np.arange(3)).ravel() for nodes in (skin, inner))
        K = stiffness.tocsr()
        schur = K[s][:, s].toarray()
        self.follow = np.zeros((len(i), len(s)))
        self._solve_inner = None
        if len(i):
            # Inner nodes are surrounded by others: K_ii is positive definite.
            self._solve_inner = scipy.sparse.linalg.splu(
                K[i][:, i].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            ).solve
            across = K[i][:, s].tocsc()
            for first in range(0, len(s), COLUMNS):
                part = slice(first, first + COLUMNS)
                self.follow[:, part] = -self._solve_inner(across[:, part].toarray())
            schur += K[s][:, i] @ self.follow
        self.stiffness = 0.5 * (schur + schur.T)
        self._stiffer = 1.0
        self._masses_skin, self._masses_inner = np.repeat(masses[skin], 3), np.repeat(masses[inner], 3)
        self.rigid, _ = np.linalg.qr(rigid_motions(rest[skin], 3).reshape(len(s), 6))

    def stiffen(self, factor: float) -> None:
        """Be `factor` times as stiff everywhere: inner nodes follow the surface as before."""
        self.stiffness = factor * self.stiffness
        self._stiffer *= factor

    def load(self, forces: np.ndarray) -> np.ndarray:
        """Forces on all nodes (n,3) as they act on the surface (3s,)."""
        return forces[self.skin].ravel() + self.follow.T @ forces[self.inner].ravel()

    def mass(self) -> np.ndarray:
        """Mass matrix (3s,3s) of surface nodes that carry the inner ones along."""
        carried = self.follow.T @ (self._masses_inner[:, None] * self.follow)
        return np.diag(self._masses_skin) + 0.5 * (carried + carried.T)

    def inner_displacement(self, surface: np.ndarray, forces: np.ndarray | None = None) -> np.ndarray:
        """Displacement (i,3) of the inner nodes for that of the surface (3s,) and forces on all nodes (n,3)."""
        moved = self.follow @ surface
        if forces is not None and self._solve_inner is not None:
            moved = moved + self._solve_inner(forces[self.inner].ravel()) / self._stiffer
        return moved.reshape(-1, 3)

    def compliance(self) -> Compliance:
        """Of the surface in balance: the inverse of S on what strains the body."""
        N = self.rigid
        stiff = np.trace(self.stiffness) / len(self.stiffness)
        factors = scipy.linalg.cho_factor(self.stiffness + stiff * (N @ N.T))
        inverse = scipy.linalg.cho_solve(factors, np.eye(len(N)), overwrite_b=True)
        inverse -= N @ (N.T @ inverse)  # what the added stiffness answered
        inverse -= (inverse @ N) @ N.T
        return Compliance(0.5 * (inverse + inverse.T), N, N.T)

    def step_compliance(self, dt: float, *, mass_damping: float, stiffness_damping: float) -> Compliance:
        """Of an implicit step of dt [s]: the inverse of M / dt^2 + C / dt + K. Inertia resists rigid motions too."""
        matrix = (1 / dt**2 + mass_damping / dt) * self.mass() + (1 + stiffness_damping / dt) * self.stiffness
        inverse = scipy.linalg.cho_solve(scipy.linalg.cho_factor(matrix), np.eye(len(matrix)), overwrite_b=True)
        nothing = np.zeros((len(inverse), 0))
        return Compliance(0.5 * (inverse + inverse.T), nothing, nothing.T)
