"""Modes from few displacement fields: the Rayleigh-Ritz method with affine and quadratic ones (Bridson, p. 3)."""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse

from taichifem.errors import InputError
from taichifem.reduced.modes import ZERO, Modes

ROUND_OFF = 1e-9


def quadratic_fields(points: np.ndarray) -> np.ndarray:
    """Displacement fields (n,3,30) whose components are 1, x, y, z and their products, at points (n,3) [m]."""
    local = points - points.mean(axis=0)
    x, y, z = (local / max(np.abs(local).max(), 1e-300)).T
    monomials = np.stack([np.ones_like(x), x, y, z, x * x, y * y, z * z, x * y, y * z, z * x], axis=1)
    return np.einsum("np,ac->nacp", monomials, np.eye(3)).reshape(len(points), 3, 30)


def ritz_modes(
    stiffness: scipy.sparse.spmatrix,
    masses: np.ndarray,
    fields: np.ndarray,
    count: int,
    *,
    free: np.ndarray | None = None,
) -> Modes:
    """The `count` lowest modes among the combinations of `fields` (n,3,p); their frequencies are upper bounds.

    stiffness, masses, free: as for `lowest_modes`. Only combinations that leave the held axes at rest count.
    Raises InputError if there are fewer of them than modes.
    """
    n, _, p = fields.shape
    rows = fields.reshape(3 * n, p)
    if free is not None:
        # What the fields do on the held axes must vanish: keep the null space of that.
        held = rows[~np.asarray(free, dtype=bool).ravel()]
        rows = rows @ scipy.linalg.null_space(held, rcond=ROUND_OFF)
    root = np.sqrt(np.repeat(masses, 3))
    base, size, _ = scipy.linalg.svd(root[:, None] * rows, full_matrices=False)
    base = base[:, size > ROUND_OFF * size.max(initial=0.0)] / root[:, None]
    if count > base.shape[1]:
        raise InputError(
            f'modes is {count}: basis "quadratic" has {base.shape[1]} for this body: ask for at most as many, '
            'or take basis = "fem"'
        )
    values, mix = scipy.linalg.eigh(base.T @ (stiffness @ base))
    top = float(abs(stiffness).sum(axis=0).max()) / masses.min()
    frequencies = np.sqrt(np.where(values > ZERO * top, values, 0.0))[:count]
    return Modes(frequencies, (base @ mix[:, :count]).reshape(n, 3, count))
