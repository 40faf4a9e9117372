"""The level that is solved directly: its matrix as L D L^T, in the order that `structure.elimination` found.

Blocks are 6x6, four of 3x3 each: of shifts and turns with shifts and turns. Everything is in double precision: the
matrices of rigid motions of stiff pieces that fly have little left in single, and sums of many forces that cancel less.
Each function does one part of the order, which has nothing to do with the others.
"""

from taichifem.linear_algebra.coarse_inverses import inverse_of, own
from taichifem.runtime import ti

FIRM = {"f32": 4e-7, "f64": 1e-13}
"""Added to the diagonal of an aggregate's matrix, in terms of its largest entry: about what round-off leaves there.
Motions of many aggregates together are far softer than any of one."""


@ti.func
def _fill(w: ti.template(), n: ti.i32, begin: ti.i32, end: ti.i32):
    """Columns `begin` to `end` of the level's matrix, to `w.pivot` and `w.factor`."""
    for k in range(begin, end):
        A, B, D, _size = own(w, n, w.eliminated[k])
        w.pivot[4 * k], w.pivot[4 * k + 1], w.pivot[4 * k + 2], w.pivot[4 * k + 3] = A, B, B.transpose(), D
        for p in range(w.factor_start[k], w.factor_start[k + 1]):
            block, row = w.factor_source[p], n + 2 * w.eliminated[w.factor_row[p]]
            width = w.row_start[row + 1] - w.row_start[row]
            for a in ti.static(range(2)):
                for b in ti.static(range(2)):
                    w.factor[4 * p + 2 * a + b] = ti.Matrix.zero(ti.f64, 3, 3)
                    if block >= 0:
                        w.factor[4 * p + 2 * a + b] = ti.cast(w.block[block + a * width + b], ti.f64)


@ti.func
def _subtract(target: ti.template(), at: ti.i32, left: ti.template(), p: ti.i32, right):
    """Take block p of `left` times the transpose of `right`, four blocks of it in a row, from block `at` of target."""
    for a in ti.static(range(2)):
        one, other = left[4 * p + 2 * a], left[4 * p + 2 * a + 1]
        for b in ti.static(range(2)):
            product = one @ right[2 * b].transpose() + other @ right[2 * b + 1].transpose()
            target[4 * at + 2 * a + b] = target[4 * at + 2 * a + b] - product


@ti.func
def factorise(w: ti.template(), n: ti.i32, c: ti.i32):
    """Part c of the factors: L to `w.factor`, the inverse of D to `w.pivot`."""
    begin, end = w.factor_part[c], w.factor_part[c + 1]
    _fill(w, n, begin, end)
    for k in range(begin, end):
        _A, _B, _D, size = own(w, n, w.eliminated[k])
        firmness = ti.cast(FIRM[w.precision], ti.f64)
        # What round-off leaves of asymmetry would grow a thousandfold from column to column.
        A, B = w.pivot[4 * k], 0.5 * (w.pivot[4 * k + 1] + w.pivot[4 * k + 2].transpose())
        D = w.pivot[4 * k + 3]
        A, B, D = inverse_of(0.5 * (A + A.transpose()), B, 0.5 * (D + D.transpose()), size, firmness)
        C = B.transpose()
        w.pivot[4 * k], w.pivot[4 * k + 1], w.pivot[4 * k + 2], w.pivot[4 * k + 3] = A, B, C, D
        for q in range(w.factor_start[k], w.factor_start[k + 1]):
            # Of what is left of the matrix, the rows and columns from this one's on, as its column still stands.
            above, below = w.factor[4 * q], w.factor[4 * q + 2]
            right, beside = w.factor[4 * q + 1], w.factor[4 * q + 3]
            L = [above @ A + right @ C, above @ B + right @ D, below @ A + beside @ C, below @ B + beside @ D]
            row = w.factor_row[q]
            _subtract(w.pivot, row, w.factor, q, L)
            at = w.factor_start[row]
            for p in range(q + 1, w.factor_start[k + 1]):
                while w.factor_row[at] != w.factor_row[p]:
                    at += 1
                _subtract(w.factor, at, w.factor, p, L)
            for a in ti.static(range(4)):
                w.factor[4 * q + a] = L[a]


@ti.func
def solve(w: ti.template(), n: ti.i32, c: ti.i32):
    """Part c of the solution, from `w.residual` to `w.z`."""
    begin, end = w.factor_part[c], w.factor_part[c + 1]
    for k in range(begin, end):
        for a in ti.static(range(2)):
            w.settled[2 * k + a] = ti.cast(w.residual[n + 2 * w.eliminated[k] + a], ti.f64)
    for k in range(begin, end):
        shift, turn = w.settled[2 * k], w.settled[2 * k + 1]
        for p in range(w.factor_start[k], w.factor_start[k + 1]):
            row = 2 * w.factor_row[p]
            w.settled[row] = w.settled[row] - w.factor[4 * p] @ shift - w.factor[4 * p + 1] @ turn
            w.settled[row + 1] = w.settled[row + 1] - w.factor[4 * p + 2] @ shift - w.factor[4 * p + 3] @ turn
    for back in range(begin, end):
        k = begin + end - 1 - back
        shift = w.pivot[4 * k] @ w.settled[2 * k] + w.pivot[4 * k + 1] @ w.settled[2 * k + 1]
        turn = w.pivot[4 * k + 2] @ w.settled[2 * k] + w.pivot[4 * k + 3] @ w.settled[2 * k + 1]
        for p in range(w.factor_start[k], w.factor_start[k + 1]):
            one, other = w.settled[2 * w.factor_row[p]], w.settled[2 * w.factor_row[p] + 1]
            shift -= w.factor[4 * p].transpose() @ one + w.factor[4 * p + 2].transpose() @ other
            turn -= w.factor[4 * p + 1].transpose() @ one + w.factor[4 * p + 3].transpose() @ other
        w.settled[2 * k], w.settled[2 * k + 1] = shift, turn
        row = n + 2 * w.eliminated[k]
        w.z[row], w.z[row + 1] = ti.cast(shift, w.real), ti.cast(turn, w.real)
