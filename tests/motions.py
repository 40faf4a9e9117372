"""Rigid motions, for comparing shapes."""

import numpy as np


def rigid_misfit(before: np.ndarray, after: np.ndarray) -> float:
    """Largest distance [m] between `after` and the best rigid motion of `before` (Kabsch)."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return float(np.abs(a @ turn - b).max())


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A rotation matrix, uniform over all."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))
