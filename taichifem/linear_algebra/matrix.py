"""Products with the block matrices of all levels."""

from taichifem.runtime import ti


@ti.func
def row(w: ti.template(), source: ti.template(), i: ti.i32):
    """Row i of the matrix times the field `source`."""
    total = ti.Vector.zero(w.real, 3)
    for k in range(w.row_start[i], w.row_start[i + 1]):
        total += w.block[k] @ source[w.column[k]]
    return total
