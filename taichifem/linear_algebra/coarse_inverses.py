"""Inverses of matrices of single aggregates."""

from taichifem.runtime import ti

FIRM = {"f32": 4e-6, "f64": 1e-12}
"""Added to the diagonal of an aggregate's matrix, in terms of its largest entry: well above what round-off leaves of
a motion without stiffness."""


@ti.func
def own(w: ti.template(), n: ti.i32, g: ti.i32):
    """An aggregate's own matrix [[A, B], [B^T, D]], as A, B and D; and its largest entry.

    In double precision: of a splinter that a stiff spring holds, single precision would leave nothing that is positive.
    """
    k = w.own_block[g]
    width = w.row_start[n + 2 * g + 1] - w.row_start[n + 2 * g]
    A, B, D = ti.cast(w.block[k], ti.f64), ti.cast(w.block[k + 1], ti.f64), ti.cast(w.block[k + width + 1], ti.f64)
    return A, B, D, ti.max(A[0, 0], A[1, 1], A[2, 2], D[0, 0], D[1, 1], D[2, 2])


@ti.func
def inverse_of(A, B, D, size, firmness):
    """The inverse of [[A, B], [B^T, D]], by Schur's complement of A, as its blocks above and on the diagonal.

    firmness: added to the diagonal, in terms of `size`.
    """
    # Motions that no node can follow (all pinned, or in a line) have nothing on the diagonal.
    scale = 1 / size if size > 0 else ti.cast(1.0, ti.f64)
    firm = firmness * ti.Matrix.identity(ti.f64, 3)
    inverse = (scale * A + firm).inverse()
    half = inverse @ (scale * B)
    rest = (scale * D + firm - scale * B.transpose() @ half).inverse()
    across = half @ rest
    return scale * (inverse + across @ half.transpose()), -scale * across, scale * rest


@ti.func
def invert_own(w: ti.template(), n: ti.i32, g: ti.i32):
    """The inverse of an aggregate's own matrix."""
    A, B, D, size = own(w, n, g)
    shift, right, both = inverse_of(A, B, D, size, ti.cast(FIRM[w.precision], ti.f64))
    w.own_inverse[4 * g] = ti.cast(shift, w.real)
    w.own_inverse[4 * g + 1] = ti.cast(right, w.real)
    w.own_inverse[4 * g + 2] = ti.cast(right.transpose(), w.real)
    w.own_inverse[4 * g + 3] = ti.cast(both, w.real)
