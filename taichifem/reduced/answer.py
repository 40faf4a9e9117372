"""How a surface answers forces at once, while hands hold some of it: updates of low rank of a matrix that stays."""

from __future__ import annotations

import numpy as np
import scipy.linalg

FIRM = 1e-9
"""Of the largest flexibility: axes that give way less are held by pins."""


class Answer:
    """columns (3s,3s): row i says where a force on axis i takes all axes [m/N], while pins and handles hold.

    Hands hold `axes` (h,) besides: what they pull with is worked out from the few rows that are theirs.
    unpinned (3s,): axes that pins leave free.  gives (3s,): those that firm hands leave free as well.
    """

    def __init__(self, columns: np.ndarray) -> None:
        self._columns = columns
        own = np.diag(columns)
        self.unpinned = own > FIRM * own.max()
        self.hold(np.zeros(0, dtype=int), np.zeros(0))

    def hold(self, axes: np.ndarray, softness: np.ndarray) -> None:
        """Have hands on the axes (h,) from now on, which give way by `softness` (h,) [m/N]; 0 is firm."""
        self.axes, self._softness = axes, softness
        self.gives = self.unpinned.copy()
        self.gives[axes[softness == 0]] = False
        if len(axes):
            self._rows = self._columns[axes]
            held = self._rows[:, axes].T + np.diag(softness)
            held[np.diag_indices(len(axes))] += 1e-12 * np.abs(held).max()
            self._factors = scipy.linalg.lu_factor(held)

    def holds(self, axes: np.ndarray, softness: np.ndarray) -> bool:
        """Are these the hands that it knows?"""
        return np.array_equal(axes, self.axes) and np.array_equal(softness, self._softness)

    def pull(self, alone: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces (h,) of the hands that want their axes at `targets` (h,), and where all is then (3s,).

        alone: where all axes are without hands (3s,).
        """
        forces = scipy.linalg.lu_solve(self._factors, targets - alone[self.axes])
        return forces, alone + forces @ self._rows

    def moved(self, axes: np.ndarray, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where forces on axes (m,) take all axes (3s,), and the forces (h,) of the hands against that."""
        moved = forces @ self._columns[axes]
        if not len(self.axes):
            return moved, np.zeros(0)
        against = -scipy.linalg.lu_solve(self._factors, moved[self.axes])
        return moved + against @ self._rows, against

    def block(self, axes: np.ndarray) -> np.ndarray:
        """Displacement of the axes (m,) by forces on them (m,m)."""
        found = self._columns[np.ix_(axes, axes)].T
        if len(self.axes):
            there = self._columns[np.ix_(axes, self.axes)].T
            found = found - self._rows[:, axes].T @ scipy.linalg.lu_solve(self._factors, there)
        return found
