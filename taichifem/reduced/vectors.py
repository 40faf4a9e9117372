"""Cross products of few vectors: `numpy.cross` takes longer than a whole contact does."""

import numpy as np


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of vectors (n,3)."""
    (x, y, z), (u, v, w) = a.T, b.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)


def skew(v: np.ndarray) -> np.ndarray:
    """The matrix (3,3) with skew(v) @ a = v x a."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
