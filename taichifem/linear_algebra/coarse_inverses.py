"""Inverses of the aggregates' own matrices, and of the matrix of the last level."""

from taichifem.runtime import ti

FIRM = {"f32": 4e-6, "f64": 1e-12}
"""Added to the diagonal of an aggregate's matrix, in terms of its largest entry: well above what round-off leaves of
a motion without stiffness."""


@ti.func
def invert_own(w: ti.template(), n: ti.i32, g: ti.i32):
    """The inverse of an aggregate's own matrix [[A, B], [B^T, D]], by Schur's complement of A.

    In double precision: of a splinter that a stiff spring holds, single precision would leave nothing that is positive.
    """
    k = w.own_block[g]
    width = w.row_start[n + 2 * g + 1] - w.row_start[n + 2 * g]
    A, B, D = ti.cast(w.block[k], ti.f64), ti.cast(w.block[k + 1], ti.f64), ti.cast(w.block[k + width + 1], ti.f64)
    size = ti.max(A[0, 0], A[1, 1], A[2, 2], D[0, 0], D[1, 1], D[2, 2])
    # Motions that no node can follow (all pinned, or in a line) have nothing on the diagonal.
    scale = 1 / size if size > 0 else ti.cast(1.0, ti.f64)
    firm = ti.cast(FIRM[w.precision], ti.f64) * ti.Matrix.identity(ti.f64, 3)
    inverse = (scale * A + firm).inverse()
    half = inverse @ (scale * B)
    rest = (scale * D + firm - scale * B.transpose() @ half).inverse()
    across = half @ rest
    w.own_inverse[4 * g] = ti.cast(scale * (inverse + across @ half.transpose()), w.real)
    w.own_inverse[4 * g + 1] = ti.cast(-scale * across, w.real)
    w.own_inverse[4 * g + 2] = ti.cast(-scale * across.transpose(), w.real)
    w.own_inverse[4 * g + 3] = ti.cast(scale * rest, w.real)


@ti.func
def _fill_last(w: ti.template(), n: ti.i32, first: ti.i32, end: ti.i32):
    """Write the whole matrix of the last level, aggregates `first` to `end`, to `last_inverse`."""
    size = 6 * (end - first)
    for k in range(size * size):
        w.last_inverse[k] = 0.0
    for row in range(2 * (end - first)):
        for k in range(w.row_start[n + 2 * first + row], w.row_start[n + 2 * first + row + 1]):
            column = w.column[k] - n - 2 * first
            for a in ti.static(range(3)):
                for b in ti.static(range(3)):
                    w.last_inverse[(3 * row + a) * size + 3 * column + b] = ti.cast(w.block[k][a, b], ti.f64)


@ti.func
def _invert_last(w: ti.template(), size: ti.i32):
    """Invert `last_inverse` in its place, by Gauss and Jordan. A motion without stiffness but round-off is left out."""
    tiny = ti.cast(ti.static({"f32": 1e-5, "f64": 1e-11}[w.precision]), ti.f64)
    for k in range(size):
        w.pivot[k] = w.last_inverse[k * size + k]
    for k in range(size):
        pivot = w.last_inverse[k * size + k]
        if pivot > tiny * w.pivot[k]:
            w.last_inverse[k * size + k] = 1.0
            for j in range(size):
                w.last_inverse[k * size + j] = w.last_inverse[k * size + j] / pivot
            for i in range(size):
                if i != k:
                    factor = w.last_inverse[i * size + k]
                    w.last_inverse[i * size + k] = 0.0
                    for j in range(size):
                        at = i * size + j
                        w.last_inverse[at] = w.last_inverse[at] - factor * w.last_inverse[k * size + j]
        else:
            w.pivot[k] = -1.0
    for k in range(size):
        if w.pivot[k] < 0:
            for j in range(size):
                w.last_inverse[k * size + j] = 0.0
                w.last_inverse[j * size + k] = 0.0


@ti.func
def invert_whole(w: ti.template(), n: ti.i32, first: ti.i32, end: ti.i32):
    """The inverse of the last level's matrix, aggregates `first` to `end`."""
    _fill_last(w, n, first, end)
    _invert_last(w, 6 * (end - first))
