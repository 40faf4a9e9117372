"""A cycle over levels: rigid motions of aggregates of nodes, and of aggregates of those.

A smoother deals with errors that change from node to node; what it leaves, large groups of nodes that move almost
rigidly against each other, lies near the span Z of the aggregates' six rigid motions (Bulgakov 1993). The Galerkin
matrix Z^T A Z is again a block matrix, so the same is done to it, until what is left can be solved directly
(`coarse_factor`).

Each function does one operation for one row, node or aggregate; `program` tells in which order they come.
"""

from taichifem.linear_algebra.rigid_motions import arm
from taichifem.runtime import ti

WEIGHT = 0.49
"""Damping of the smoother. An element joins at most four nodes, or aggregates; so A <= 4 D for block diagonals D, and
any weight below 1/2 converges, which keeps the preconditioner positive definite."""


@ti.func
def _own(w: ti.template(), g: ti.i32, shift, turn):
    """The inverse of aggregate g's own matrix times a shift and a turn, damped."""
    weight = ti.cast(WEIGHT, w.real)
    return (
        weight * (w.own_inverse[4 * g] @ shift + w.own_inverse[4 * g + 1] @ turn),
        weight * (w.own_inverse[4 * g + 2] @ shift + w.own_inverse[4 * g + 3] @ turn),
    )


@ti.func
def restrict(w: ti.template(), n: ti.i32, level: ti.i32, g: ti.i32):
    """Right-hand side Z^T (r - A z) for aggregate g of `level`, from `w.left`; and its first smoothing."""
    shift, turn = ti.Vector.zero(w.real, 3), ti.Vector.zero(w.real, 3)
    for item in range(w.child_begin[g], w.child_end[g]):
        left, spin = ti.Vector.zero(w.real, 3), ti.Vector.zero(w.real, 3)
        if level == 1:
            left = w.free[item] * w.left[item]
        else:
            left = w.left[n + 2 * item]
            spin = (w.reach[item] / w.reach[g]) * w.left[n + 2 * item + 1]
        shift += left
        turn += arm(w, n, level - 1, item).cross(left) + spin
    w.residual[n + 2 * g], w.residual[n + 2 * g + 1] = shift, turn
    s, t = _own(w, g, shift, turn)
    w.z[n + 2 * g], w.z[n + 2 * g + 1] = s, t


@ti.func
def correct(w: ti.template(), n: ti.i32, level: ti.i32, item: ti.i32):
    """Add to z of a node (level 0) or an aggregate what the level above says of it."""
    across = arm(w, n, level, item)
    if level == 0:
        top = n + 2 * w.parent[item]
        w.z[item] = w.z[item] + w.free[item] * (w.z[top] + w.z[top + 1].cross(across))
    else:
        g, row = w.parent[n + item], n + 2 * item
        top = n + 2 * g
        w.z[row] = w.z[row] + w.z[top] + w.z[top + 1].cross(across)
        w.z[row + 1] = w.z[row + 1] + (w.reach[item] / w.reach[g]) * w.z[top + 1]


@ti.func
def smooth(w: ti.template(), n: ti.i32, level: ti.i32, item: ti.i32):
    """Smooth z of a node (level 0) or an aggregate, from `w.left`. Gives a node's r . z, 0 for an aggregate."""
    product = ti.cast(0.0, ti.f64)
    if level == 0:
        z = w.z[item] + ti.cast(WEIGHT, w.real) * (w.inverse[item] @ w.left[item])
        w.z[item] = z
        product = ti.cast(w.residual[item].dot(z), ti.f64)
    else:
        row = n + 2 * item
        s, t = _own(w, item, w.left[row], w.left[row + 1])
        w.z[row], w.z[row + 1] = w.z[row] + s, w.z[row + 1] + t
    return product
