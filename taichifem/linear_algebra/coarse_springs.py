"""What springs on single nodes, of contact and handles, add to the matrices of the coarse levels.

They change with every pass of contact, and all else does not. They stand on the diagonal, so that on every level they
change the own matrices of aggregates only.
"""

from taichifem.linear_algebra.rigid_motions import arm, crossed
from taichifem.runtime import ti


@ti.func
def _add(w: ti.template(), g: ti.i32, shift, right, both, across, share):
    """To aggregate g, the matrix [[shift, right], [right^T, both]] of a child.

    A turn of g shifts the child along `across`, and turns it by `share`.
    """
    block_right = crossed(shift, across) + share * right
    mixed_right = crossed(right.transpose(), across) + share * both
    w.sprung_on[3 * g] = w.sprung_on[3 * g] + shift
    w.sprung_on[3 * g + 1] = w.sprung_on[3 * g + 1] + block_right
    turned = crossed(block_right.transpose(), across).transpose() + share * mixed_right
    w.sprung_on[3 * g + 2] = w.sprung_on[3 * g + 2] + turned


@ti.func
def lean(w: ti.template(), n: ti.i32, level: ti.i32, g: ti.i32):
    """The own blocks of aggregate g of a level: `w.bare`, and what springs add, which is known of the level below."""
    for k in ti.static(range(3)):
        w.sprung_on[3 * g + k] = ti.Matrix.zero(w.real, 3, 3)
    for item in range(w.child_begin[g], w.child_end[g]):
        if level == 1:
            if w.spring[item].trace() > 0:
                spring, nothing = w.spring[item] * w.free[item].outer_product(w.free[item]), 0 * w.spring[item]
                _add(w, g, spring, nothing, nothing, arm(w, n, 0, item), ti.cast(0.0, w.real))
        elif w.sprung_on[3 * item].trace() > 0:
            shift, right, both = w.sprung_on[3 * item], w.sprung_on[3 * item + 1], w.sprung_on[3 * item + 2]
            _add(w, g, shift, right, both, arm(w, n, level - 1, item), w.reach[item] / w.reach[g])
    k, width = w.own_block[g], w.row_start[n + 2 * g + 1] - w.row_start[n + 2 * g]
    right = w.bare[3 * g + 1] + w.sprung_on[3 * g + 1]
    w.block[k] = w.bare[3 * g] + w.sprung_on[3 * g]
    w.block[k + 1] = right
    w.block[k + width] = right.transpose()
    w.block[k + width + 1] = w.bare[3 * g + 2] + w.sprung_on[3 * g + 2]
