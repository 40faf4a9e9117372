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
def _clear(w: ti.template(), g: ti.i32):
    for k in ti.static(range(3)):
        w.sprung_on[3 * g + k] = ti.Matrix.zero(w.real, 3, 3)


@ti.kernel
def lean(w: ti.template(), n: ti.i32, first: ti.i32, count: ti.i32):
    """The own blocks of all `count` aggregates from `w.bare` and `w.spring`; the first level has `first` of them."""
    ti.loop_config(serialize=ti.static(w.alone(10)))
    for g in range(first):
        _clear(w, g)
        nothing = ti.Matrix.zero(w.real, 3, 3)
        for i in range(w.child_begin[g], w.child_end[g]):
            if w.spring[i].trace() > 0:
                spring = w.spring[i] * w.free[i].outer_product(w.free[i])
                _add(w, g, spring, nothing, nothing, arm(w, n, 0, i), ti.cast(0.0, w.real))
    ti.loop_config(serialize=True)
    for g in range(first, count):
        _clear(w, g)
        for c in range(w.child_begin[g], w.child_end[g]):
            if w.sprung_on[3 * c].trace() > 0:
                shift, right, both = w.sprung_on[3 * c], w.sprung_on[3 * c + 1], w.sprung_on[3 * c + 2]
                _add(w, g, shift, right, both, arm(w, n, 1, c), w.reach[c] / w.reach[g])
    ti.loop_config(serialize=True)
    for g in range(count):
        k, width = w.own_block[g], w.row_start[n + 2 * g + 1] - w.row_start[n + 2 * g]
        right = w.bare[3 * g + 1] + w.sprung_on[3 * g + 1]
        w.block[k] = w.bare[3 * g] + w.sprung_on[3 * g]
        w.block[k + 1] = right
        w.block[k + width] = right.transpose()
        w.block[k + width + 1] = w.bare[3 * g + 2] + w.sprung_on[3 * g + 2]
