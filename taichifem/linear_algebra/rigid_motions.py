"""Rigid motions of aggregates: what both the coarse matrices and the cycle over them know of them.

Unknowns of an aggregate are the shift of its centre, and its turn times its `reach`, so that both are of one size.
"""

from taichifem.runtime import ti


@ti.func
def arm(w: ti.template(), n: ti.i32, level: ti.i32, item: ti.i32):
    """From the centre of its aggregate to a node (level 0) or an aggregate, in units of the reach there."""
    return w.arm[item if level == 0 else n + item]


@ti.func
def crossed(M, r):
    """The matrix whose column b is M (e_b x r): its rows are r x (rows of M)."""
    return ti.Matrix.rows([r.cross(ti.Vector([M[a, 0], M[a, 1], M[a, 2]])) for a in ti.static(range(3))])
