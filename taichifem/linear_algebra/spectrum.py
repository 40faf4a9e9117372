"""The highest frequency of (K, M), which limits explicit steps."""

from __future__ import annotations

import numpy as np
import scipy.sparse
import scipy.sparse.linalg


def highest_frequency(stiffness: scipy.sparse.spmatrix, masses: np.ndarray, free: np.ndarray) -> float:
    """The highest angular frequency [1/s] of K u = omega^2 M u on the free axes.

    stiffness: K (3n,3n) [N/m].  masses: (n,) [kg].  free: (n,3) 1 where a node may move.
    Lanczos' method, always from the same start: what it returns is below the true value by much less than its
    tolerance of 1e-3.
    """
    scale = (free / np.sqrt(masses)[:, None]).ravel()
    scaled = scipy.sparse.diags_array(scale) @ stiffness @ scipy.sparse.diags_array(scale)
    if scaled.nnz == 0 or abs(scaled).max() == 0:
        return 0.0
    if len(scale) < 32:
        values = np.linalg.eigvalsh(scaled.toarray())
    else:
        start = np.where(scale > 0, np.random.default_rng(0).standard_normal(len(scale)), 0.0)
        values = scipy.sparse.linalg.eigsh(scaled, k=1, which="LA", v0=start, tol=1e-3, return_eigenvectors=False)
    return float(np.sqrt(max(values[-1], 0.0)))
