"""Products with the block matrices of all levels."""

from taichifem.runtime import ti


@ti.func
def multiply(w: ti.template(), source: ti.template(), target: ti.template(), begin: ti.i32, end: ti.i32):
    """The rows `begin` to `end` of A times `source`, to `target`; rows of nodes must be a piece of `BlockPattern`."""
    for i in range(begin, end):
        target[i] = ti.zero(source[i])
    for i in range(begin, end):
        own, total = source[i], ti.zero(source[i])
        for k in range(w.row_start[i], w.near[i]):
            total += w.block[k] @ source[w.column[k]]
        for k in range(w.near[i], w.row_start[i + 1]):
            j, block = w.column[k], w.block[k]
            total += block @ source[j]
            target[j] = target[j] + block.transpose() @ own
        target[i] = target[i] + total
