"""The plastic strain of an element: kept with it, and how it grows.

Strains are those of the rotated frame, as (3,3) matrices also in plane strain, where plastic flow has a part across
the plane though the whole strain has none.
"""

from taichifem.formulas import plasticity
from taichifem.formulas.eigen import diagonal, symmetric_eigen
from taichifem.runtime import ti

_PLACE = ((0, 3, 5), (3, 1, 4), (5, 4, 2))


@ti.func
def kept(w: ti.template(), e: ti.i32):
    """Plastic strain of element e."""
    p = w.plastic[e]
    return ti.Matrix([[p[_PLACE[i][j]] for j in ti.static(range(3))] for i in ti.static(range(3))])


@ti.func
def flowed(w: ti.template(), e: ti.i32, elastic, mu, law, dt):
    """What of the elastic strain becomes plastic in dt [s], and by how much the accumulated plastic strain grows.

    law: the last columns of the material table, from PLASTICITY on.
    """
    kind, limit, slope, rate = ti.cast(law[0], ti.i32), law[1], law[2], law[3]
    alpha = w.hardened[e]
    moved, growth = 0 * elastic, 0 * alpha
    if kind == plasticity.CREEP:
        before = kept(w, e)
        moved = plasticity.creep_flow(elastic, limit, rate, dt)[0]
        moved = plasticity.creep_bound(before + moved, slope) - before
        growth = ti.sqrt(ti.cast(2 / 3, w.real)) * moved.norm()
    elif kind == plasticity.VON_MISES:
        shape = plasticity.deviator(elastic)
        share, more = plasticity.von_mises_share(shape.norm(), alpha, mu, limit, slope, rate, dt)
        moved, growth = share * shape, more
    # Axes are dear, and Tresca's stress is 2/sqrt(3) of von Mises' at most.
    elif ti.sqrt(8.0) * mu * plasticity.deviator(elastic).norm() > limit + slope * alpha:
        values, Q = symmetric_eigen(elastic)
        along, more = plasticity.tresca_flow(values, alpha, mu, limit, slope, rate, dt)
        moved, growth = Q @ diagonal(along) @ Q.transpose(), more
    return moved, growth


@ti.func
def add(w: ti.template(), e: ti.i32, moved, growth):
    """Keep what has flowed."""
    after = kept(w, e) + moved
    w.plastic[e] = ti.Vector([after[0, 0], after[1, 1], after[2, 2], after[0, 1], after[1, 2], after[2, 0]])
    w.hardened[e] = w.hardened[e] + growth
