"""Products with the block matrix and its diagonal springs."""

from taichifem.runtime import ti


@ti.func
def row(w: ti.template(), source: ti.template(), i: ti.i32):
    """Row i of (A + springs) times the node field `source`."""
    total = w.spring[i] @ source[i]
    for k in range(w.row_start[i], w.row_start[i + 1]):
        total += w.block[k] @ source[w.column[k]]
    return total
