"""Loads on the coordinates of a modal body."""

import numpy as np

from taichifem.reduced.parts import LoadField


class ModalLoad:
    """A load on the coordinates of a body: its forces keep their direction, or turn with the frame."""

    def __init__(self, field: LoadField, shapes: np.ndarray, local: np.ndarray) -> None:
        self.load, self._turns = field.load, field.turns
        self._on_modes = np.einsum("nak,nb->abk", shapes, field.forces)
        self._total = field.forces.sum(axis=0)
        self._arms = local.T @ field.forces

    def modal(self, rotation: np.ndarray) -> np.ndarray:
        """Modal forces (k,)."""
        turn = np.eye(3) if self._turns else rotation.T
        return np.einsum("ab,abk->k", turn, self._on_modes)

    def rigid(self, rotation: np.ndarray) -> np.ndarray:
        """Force and torque (6,) about the origin of the frame."""
        total = rotation @ self._total if self._turns else self._total
        arms = rotation @ self._arms @ (rotation.T if self._turns else np.eye(3))
        return np.concatenate([total, [arms[1, 2] - arms[2, 1], arms[2, 0] - arms[0, 2], arms[0, 1] - arms[1, 0]]])
