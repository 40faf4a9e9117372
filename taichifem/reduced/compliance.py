"""A body that answers forces at once: displacements by a dense matrix, and what holds some of its axes.

u = C g + N a: g are loads, a the rigid motions N that nothing resists, while loads are balanced: B g = 0. Axes that are
held at given displacements are pulled there by reactions, one small dense system for them and the rigid motions; the
matrix C is never made again. That is the capacitance matrix of the Sherman-Morrison-Woodbury formula, by which James &
Pai (1999) change boundary conditions, and the dual interface problem of Farhat & Roux (1991) for floating bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from taichifem.errors import InputError


@dataclass(frozen=True)
class Compliance:
    """matrix: C (n,n).  rigid: N (n,r), no columns if something resists all motions.  balance: B (r,n)."""

    matrix: np.ndarray
    rigid: np.ndarray
    balance: np.ndarray

    def displaced(self, free: np.ndarray, out_of_balance: np.ndarray, axes: np.ndarray, target: np.ndarray) -> Held:
        """The displacements if the axes (h,) are held at `target` (h,).

        free: C g (n,) of the given loads.  out_of_balance: B g (r,) of them.
        Raises InputError where what is held leaves the body free to move.
        """
        return self.holding(axes).solve(free, out_of_balance, target)

    def holding(self, axes: np.ndarray, softness: np.ndarray | float = 0.0) -> Holding:
        """What holds the axes (h,), ready for any targets: one factorisation of h + r rows.

        softness: (h,) by how much [m/N] what holds them gives way: 0 for pins, 1/k for springs.
        """
        h, r = len(axes), self.rigid.shape[1]
        system = np.zeros((h + r, h + r))
        system[:h, :h] = self.matrix[np.ix_(axes, axes)] + np.diag(np.broadcast_to(softness, h))
        system[:h, h:], system[h:, :h] = self.rigid[axes], self.balance[:, axes]
        # Rigid motions and flexibilities have other units: bring them to one size.
        size = np.abs(np.diag(system[:h, :h])).max(initial=1e-300)
        scale = np.concatenate([np.full(h, 1 / np.sqrt(size)), np.full(r, np.sqrt(size))])
        if r and np.linalg.matrix_rank(self.rigid[axes], tol=1e-9 * np.abs(self.rigid).max()) < r:
            raise InputError("what is held leaves the body free to move: hold nodes that are not all in one line")
        factors = scipy.linalg.lu_factor(scale[:, None] * system * scale) if h + r else None
        return Holding(self, axes, factors, scale)

    def held_for_good(
        self, axes: np.ndarray, softness: np.ndarray | float = 0.0
    ) -> tuple[Compliance, np.ndarray, np.ndarray]:
        """The compliance with these axes held for good; how their targets move all axes (n,h), and how what is out of
        balance does (n,r): an update of rank h."""
        holding, h = self.holding(axes, softness), len(axes)
        back = holding.inverse()
        left = np.concatenate([self.matrix[:, axes], self.rigid], axis=1) @ back
        matrix = self.matrix - left @ np.concatenate([self.matrix[axes], self.balance])
        nothing = np.zeros((len(matrix), 0))
        return Compliance(matrix, nothing, nothing.T), left[:, :h], -left[:, h:]


@dataclass(frozen=True)
class Held:
    """displacement (n,), reactions (h,) on the held axes."""

    displacement: np.ndarray
    reactions: np.ndarray


@dataclass(frozen=True)
class Holding:
    """A set of held axes, factorised."""

    compliance: Compliance
    axes: np.ndarray
    factors: tuple | None
    scale: np.ndarray

    def solve(self, free: np.ndarray, out_of_balance: np.ndarray, target: np.ndarray) -> Held:
        """As `Compliance.displaced`."""
        if self.factors is None:
            return Held(free, np.zeros(0))
        c, h = self.compliance, len(self.axes)
        found = self._solve(target - free[self.axes], out_of_balance)
        reactions, motion = found[:h], found[h:]
        return Held(free + c.matrix[:, self.axes] @ reactions + c.rigid @ motion, reactions)

    def reactions(self, stretch: np.ndarray, out_of_balance: np.ndarray) -> np.ndarray:
        """Reactions (h,) that make good for `stretch` (h,), targets less free displacements."""
        return self._solve(stretch, out_of_balance)[: len(self.axes)]

    def _solve(self, stretch: np.ndarray, out_of_balance: np.ndarray) -> np.ndarray:
        if self.factors is None:
            return np.zeros(0)
        right = np.concatenate([stretch, -out_of_balance])
        return self.scale * scipy.linalg.lu_solve(self.factors, self.scale * right)

    def inverse(self) -> np.ndarray:
        """Of the small system (h+r,h+r)."""
        if self.factors is None:
            return np.zeros((0, 0))
        return self.scale[:, None] * scipy.linalg.lu_solve(self.factors, np.diag(self.scale))
