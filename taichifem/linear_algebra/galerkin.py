"""The matrices Z^T A Z of the coarse levels, made anew for every solve, one level from that below.

Z are the rigid motions of aggregates (see `multilevel`). Every block is gathered in a fixed order: no atomics.
"""

from taichifem import elements
from taichifem.linear_algebra.rigid_motions import arm, crossed
from taichifem.runtime import ti
from taichifem.structure.aggregates import Aggregates
from taichifem.structure.levels import Levels
from taichifem.world import World


@ti.kernel
def relax(w: ti.template(), n: ti.i32, n_elements: ti.i32):
    """Where nodes would be with strain taken out of the elements around, to `w.relaxed`; spends `w.corner_force`.

    A linear or corotational element does not resist turns of its rest shape, rotated as it is now; the turns of a
    strained shape it does. So the motions that cost a splinter nothing are those of the former. Each node takes the
    mean, by volume, of where such elements want it; all others want it where it is.
    """
    for e in range(n_elements):
        now = elements.edges(w.x, w, e)
        rest = now
        if w.table[w.material[e]][elements.MODEL] <= elements.QUICK:
            # The rows of the rotated gradients are the inverse of the rotated rest edges.
            rest = ti.Matrix.rows([w.h[e * w.corners + 1 + b] for b in ti.static(range(w.d))]).inverse()
        corner = elements.seen(w.x[w.cell[e][0]], w)
        for b in ti.static(range(w.d)):
            for a in ti.static(range(w.d)):
                corner[a] += (now[a, b] - rest[a, b]) / w.corners
        w.corner_force[e * w.corners] = corner
        for b in ti.static(range(w.d)):
            w.corner_force[e * w.corners + 1 + b] = corner + ti.Vector([rest[a, b] for a in ti.static(range(w.d))])
    for i in range(n):
        total, volume = ti.Vector.zero(w.real, w.d), ti.cast(0.0, w.real)
        for k in range(w.incident_start[i], w.incident_start[i + 1]):
            e, a = w.incident[k] >> 2, w.incident[k] & 3
            total += w.volume[e] * w.corner_force[e * w.corners + a]
            volume += w.volume[e]
        w.relaxed[i] = elements.lifted(total / volume, w)


@ti.kernel
def stay(w: ti.template(), n: ti.i32):
    """In place of `relax` where nothing has come apart: turns of large aggregates cost far more than their strain."""
    ti.loop_config(serialize=ti.static(w.alone(5)))
    for i in range(n):
        w.relaxed[i] = w.x[i]


@ti.func
def _place(w: ti.template(), n: ti.i32, position: ti.template(), of_nodes: ti.template(), g: ti.i32):
    """Centre and reach (root mean square of the arms) of an aggregate of nodes or aggregates, and their arms."""
    begin, end = w.child_begin[g], w.child_end[g]
    centre, square = ti.Vector.zero(w.real, 3), ti.cast(0.0, w.real)
    for k in range(begin, end):
        centre += position[k]
    centre /= ti.cast(end - begin, w.real)
    for k in range(begin, end):
        square += (position[k] - centre).norm_sqr()
        if ti.static(not of_nodes):
            square += w.reach[k] ** 2
    w.centre[g] = centre
    reach = ti.sqrt(square / ti.cast(end - begin, w.real))
    # A single node has arms of round-off: they must not be made large.
    if reach <= ti.cast(1e-5, w.real) * centre.norm():
        reach = ti.cast(1.0, w.real)
    w.reach[g] = reach
    first = 0 if ti.static(of_nodes) else n
    for k in range(begin, end):
        w.arm[first + k] = (position[k] - centre) / reach


@ti.func
def _store(w: ti.template(), n: ti.i32, q: ti.i32, shift, right, turned, both):
    """The four blocks of pair q, and those of its mirror image.

    Of an aggregate with itself, one half has been gathered: the other is its mirror image. Springs are still missing.
    """
    g, o, at, mirror = w.coarse_pair[q][0], w.coarse_pair[q][1], w.coarse_pair[q][2], w.coarse_pair[q][3]
    if g == o:
        shift += shift.transpose()
        both += both.transpose()
        right += turned.transpose()
        turned = right.transpose()
        w.bare[3 * g], w.bare[3 * g + 1], w.bare[3 * g + 2] = shift, right, both
    width = w.row_start[n + 2 * g + 1] - w.row_start[n + 2 * g]
    w.block[at], w.block[at + 1] = shift, right
    w.block[at + width], w.block[at + width + 1] = turned, both
    if g != o:
        width = w.row_start[n + 2 * o + 1] - w.row_start[n + 2 * o]
        w.block[mirror], w.block[mirror + 1] = shift.transpose(), turned.transpose()
        w.block[mirror + width], w.block[mirror + width + 1] = right.transpose(), both.transpose()


@ti.kernel
def _gather_nodes(w: ti.template(), n: ti.i32, aggregates: ti.i32, pairs: ti.i32):
    """Level 1, from the matrix of the nodes."""
    ti.loop_config(serialize=ti.static(w.alone(10)))
    for g in range(aggregates):
        _place(w, n, w.relaxed, True, g)
    for q in range(pairs):
        shift, right = ti.Matrix.zero(w.real, 3, 3), ti.Matrix.zero(w.real, 3, 3)
        turned, both = ti.Matrix.zero(w.real, 3, 3), ti.Matrix.zero(w.real, 3, 3)
        for m in range(w.member_start[q], w.member_start[q + 1]):
            i, k = w.member[m][0], w.member[m][1]
            j = w.column[k]
            # Of the diagonal, a half: see `_store`.
            block = w.block[k]
            if i == j:
                block = 0.5 * w.own[i]
            block *= w.free[i].outer_product(w.free[j])
            # Columns of the turns: A (e_b x arm); rows in the same way.
            block_right = crossed(block, arm(w, n, 0, j))
            arm_i = arm(w, n, 0, i)
            shift += block
            right += block_right
            turned += crossed(block.transpose(), arm_i).transpose()
            both += crossed(block_right.transpose(), arm_i).transpose()
        _store(w, n, q, shift, right, turned, both)


@ti.kernel
def _gather_level(w: ti.template(), n: ti.i32, level: ti.i32, first: ti.i32, end: ti.i32, begin: ti.i32, last: ti.i32):
    """A level from that below: aggregates `first` to `end`, pairs `begin` to `last`."""
    ti.loop_config(serialize=ti.static(w.alone(2)))
    for g in range(first, end):
        _place(w, n, w.centre, False, g)
    ti.loop_config(serialize=ti.static(w.alone(20)))
    for q in range(begin, last):
        shift, right = ti.Matrix.zero(w.real, 3, 3), ti.Matrix.zero(w.real, 3, 3)
        turned, both = ti.Matrix.zero(w.real, 3, 3), ti.Matrix.zero(w.real, 3, 3)
        for m in range(w.member_start[q], w.member_start[q + 1]):
            i, k = w.member[m][0], w.member[m][1]
            j = (w.column[k] - n) // 2
            width = w.row_start[n + 2 * i + 1] - w.row_start[n + 2 * i]
            # A turn of the parent shifts a child by its arm, and turns it: less, in units of their reaches.
            arm_i, share_i = arm(w, n, level - 1, i), w.reach[i] / w.reach[w.parent[n + i]]
            arm_j, share_j = arm(w, n, level - 1, j), w.reach[j] / w.reach[w.parent[n + j]]
            part = 0.5 if i == j else 1.0
            block, mixed = part * w.block[k], part * w.block[k + width]
            block_right = crossed(block, arm_j) + part * share_j * w.block[k + 1]
            mixed_right = crossed(mixed, arm_j) + part * share_j * w.block[k + width + 1]
            shift += block
            right += block_right
            turned += crossed(block.transpose(), arm_i).transpose() + share_i * mixed
            both += crossed(block_right.transpose(), arm_i).transpose() + share_i * mixed_right
        _store(w, n, q, shift, right, turned, both)


class Galerkin:
    """Makes the coarse matrices of a world, up to a level `last`."""

    def __init__(self, aggregates: Aggregates, levels: Levels, last: int) -> None:
        self._last = last
        self._n, self._first, self._pair = len(aggregates.order), aggregates.first.tolist(), levels.first_pair.tolist()

    def renew(self, w: World) -> None:
        """All coarse matrices, from `w.block` and `w.own` of the nodes at `w.relaxed`: still without springs."""
        n, first, pair = self._n, self._first, self._pair
        _gather_nodes(w, n, first[1], pair[1])
        for level in range(2, self._last + 1):
            _gather_level(w, n, level, first[level - 1], first[level], pair[level - 1], pair[level])
