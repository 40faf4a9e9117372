"""Products with the block matrices of all levels."""

from taichifem.runtime import ti


@ti.func
def _shared(block, x):
    """Entries of `block` times those of x: the rows' sums are the product. Sums of these have nine chains of additions
    where that of the products has three, which have to wait for one another."""
    return ti.Matrix([[block[a, b] * x[b] for b in ti.static(range(3))] for a in ti.static(range(3))])


@ti.func
def multiply(w: ti.template(), source: ti.template(), target: ti.template(), begin: ti.i32, end: ti.i32):
    """The rows `begin` to `end` of A times `source`, to `target`; rows of nodes must be a piece of `BlockPattern`."""
    for i in range(begin, end):
        target[i] = ti.zero(source[i])
    for i in range(begin, end):
        own, total = source[i], ti.zero(source[i])
        if ti.static(source.m == 1):
            parts = ti.Matrix.zero(w.real, 3, 3)
            for k in range(w.row_start[i], w.near[i]):
                parts += _shared(w.block[k], source[w.column[k]])
            for k in range(w.near[i], w.row_start[i + 1]):
                j, block = w.column[k], w.block[k]
                parts += _shared(block, source[j])
                target[j] = target[j] + block.transpose() @ own
            total = parts @ ti.Vector.one(w.real, 3)
        else:
            for k in range(w.row_start[i], w.near[i]):
                total += w.block[k] @ source[w.column[k]]
            for k in range(w.near[i], w.row_start[i + 1]):
                j, block = w.column[k], w.block[k]
                total += block @ source[j]
                target[j] = target[j] + block.transpose() @ own
        target[i] = target[i] + total
