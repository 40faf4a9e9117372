"""Natural vibrations: the lowest modes of (K, M) with lumped masses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from taichifem.errors import InputError

DENSE = 900
"""Unknowns up to which all modes are computed at once."""

SHIFT = 1e-7
"""Of the spectrum's upper end: how far below zero the shifted matrix is factorised, so that it is regular."""

ZERO = 1e-11
"""Of the spectrum's upper end: an eigenvalue below this is that of a rigid motion."""


@dataclass(frozen=True)
class Modes:
    """frequencies: (k,) angular [1/s], rising, exactly 0 for rigid motions.

    shapes: (n,3,k) displacement of the nodes, of unit modal mass: sum_i m_i u_i u_i^T = I [kg^-1/2].
    """

    frequencies: np.ndarray
    shapes: np.ndarray

    @property
    def hertz(self) -> np.ndarray:
        """Frequencies (k,) [Hz]."""
        return self.frequencies / (2 * np.pi)

    @property
    def rigid(self) -> int:
        """How many of them are rigid motions; those come first."""
        return int((self.frequencies == 0).sum())

    def part(self, first: int, last: int) -> Modes:
        """The modes from `first` to before `last`."""
        return Modes(self.frequencies[first:last], self.shapes[:, :, first:last])


def lowest_modes(
    stiffness: scipy.sparse.spmatrix, masses: np.ndarray, count: int, *, free: np.ndarray | None = None
) -> Modes:
    """The `count` lowest modes of K u = omega^2 M u.

    stiffness: K (3n,3n) [N/m].  masses: (n,) [kg].  free: (n,3), True on the axes that no pin holds; None: all.
    Small systems are solved as a whole, large ones by Lanczos' method on the factorised shifted matrix.
    Raises InputError for more modes than there are degrees of freedom.
    """
    axes = np.arange(3 * len(masses)) if free is None else np.flatnonzero(np.asarray(free, dtype=bool).ravel())
    if count > len(axes):
        raise InputError(f"modes is {count}: the body has {len(axes)} degrees of freedom: ask for at most as many")
    root = np.sqrt(np.repeat(masses, 3)[axes])
    scale = scipy.sparse.diags_array(1 / root)
    scaled = (scale @ stiffness.tocsr()[axes][:, axes] @ scale).tocsc()
    top = float(abs(scaled).sum(axis=0).max())
    if len(axes) <= DENSE or 2 * count >= len(axes):
        values, vectors = scipy.linalg.eigh(scaled.toarray(), subset_by_index=(0, count - 1))
    else:
        values, vectors = _lanczos(scaled, count, SHIFT * top)
    shapes = np.zeros((3 * len(masses), count))
    shapes[axes] = vectors / root[:, None]
    frequencies = np.sqrt(np.where(values > ZERO * top, values, 0.0))
    return Modes(frequencies, shapes.reshape(-1, 3, count))


def _lanczos(matrix: scipy.sparse.csc_matrix, count: int, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """Lowest eigenpairs, always from the same start."""
    n = matrix.shape[0]
    shifted = (matrix + shift * scipy.sparse.identity(n, format="csc")).tocsc()
    # Positive definite: the order of elimination may be chosen for sparsity alone.
    factors = scipy.sparse.linalg.splu(
        shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    inverse = scipy.sparse.linalg.LinearOperator((n, n), matvec=factors.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(n)
    values, vectors = scipy.sparse.linalg.eigsh(matrix, k=count, sigma=-shift, OPinv=inverse, v0=start)
    order = np.argsort(values)
    return values[order], vectors[:, order]
