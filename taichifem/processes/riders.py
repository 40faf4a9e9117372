"""Embedded vertices beside a world: where they ride, which of them are near a collider, and their contacts."""

import numpy as np

from taichifem.formulas import collision
from taichifem.processes import contact
from taichifem.runtime import ti
from taichifem.transfer import dtype_of
from taichifem.world import World, round_up

_array = ti.types.ndarray

CELLS, RIDERS = 0, 1
"""Places in `Riders.near_count`: tetrahedra and vertices that are near."""

MARGIN = 0.5
"""Of a tetrahedron's size: what the forces of a step may at most add to its way towards a collider."""

NOTHING = 1e-5
"""Weights below this are round-off: of the node there is no share."""


@ti.data_oriented
class Riders:
    """Room for the embedded vertices of a world. They are sorted by their tetrahedra.

    Of a tetrahedron that holds some: `cell`, its number in the world; `first` of its vertices; `reach`, how far they
    lie from its middle at most, in terms of its farthest node; `close`, is it near a collider?  Of a vertex: `of`, its
    tetrahedron here; `weight`; `share` of each of its nodes that is its own (`riding`); what its contacts
    add to the matrix (`stiff`) and to the load (`push`); `acting`.  As in `World`: `slip`, `pressed`, `touching`,
    `grip`.
    `near_cell`, `near`, `near_count`: lists of what is near.  `crowd` of a node: weights that act on it.
    `kept`, `kept_at`, `kept_count`: blocks of the matrix as they were assembled.
    """

    def __init__(self, w: World, riders: int, cells: int) -> None:
        real, colliders = w.real, w.capacity.colliders
        self.riders, self.cells = riders, cells
        builder = ti.FieldsBuilder()

        def scalar(size, dtype=real):
            field = ti.field(dtype)
            builder.dense(ti.i, size).place(field)
            return field

        def vector(size, n):
            field = ti.Vector.field(n, real)
            builder.dense(ti.i, size).place(field)
            return field

        def matrix(size):
            field = ti.Matrix.field(3, 3, real)
            builder.dense(ti.i, size).place(field)
            return field

        self.cell, self.first, self.close = (scalar(k, ti.i32) for k in (cells, cells + 1, cells))
        self.reach = scalar(cells)
        self.of, self.acting, self.near = (scalar(riders, ti.i32) for _ in range(3))
        self.weight, self.share = vector(riders, 4), vector(riders, 4)
        self.stiff, self.push = matrix(riders), vector(riders, 3)
        self.near_cell, self.near_count = scalar(cells, ti.i32), scalar(2, ti.i32)
        self.crowd = scalar(w.capacity.nodes)
        self.kept, self.kept_at, self.kept_count = matrix(12 * cells), scalar(12 * cells, ti.i32), scalar(1, ti.i32)
        self.slip, self.pressed, self.touching = ti.Vector.field(3, real), ti.field(real), ti.field(ti.i32)
        self.grip = ti.field(real)
        builder.dense(ti.ij, (colliders, riders)).place(self.slip, self.pressed, self.touching, self.grip)
        builder.finalize()


@ti.func
def _distance(w: ti.template(), c: ti.i32, point):
    """At most how far [m] a point is from collider c, where that stands at the beginning of the step."""
    p = w.collider_rotation0[c].transpose() @ (point - w.collider_center0[c])
    distance = p[2]
    if w.collider_kind[c] == collision.SPHERE:
        distance = p.norm() - w.collider_size[c][0]
    elif w.collider_kind[c] == collision.BOX:
        distance = (ti.abs(p) - 0.5 * w.collider_size[c]).max()
    return distance


@ti.func
def _is_near(w: ti.template(), r: ti.template(), q: ti.i32, n_colliders: ti.i32, dt):
    """May a vertex in tetrahedron q meet a collider within the step?"""
    e = r.cell[q]
    middle, near = ti.Vector.zero(w.real, 3), 0
    for a in range(4):
        middle += 0.25 * w.x[w.cell[e][a]]
    size, fastest = ti.cast(0.0, w.real), ti.cast(0.0, w.real)
    for a in range(4):
        size = ti.max(size, (w.x[w.cell[e][a]] - middle).norm())
        fastest = ti.max(fastest, w.v[w.cell[e][a]].norm())
    for c in range(n_colliders):
        surface = w.collider_velocity[c] + w.collider_spin[c].cross(middle - w.collider_center0[c])
        way = dt * (fastest + surface.norm() + w.collider_spin[c].norm() * size)
        if _distance(w, c, middle) < r.reach[q] * (size + way) + ti.cast(MARGIN, w.real) * size:
            near = 1
    return near


@ti.func
def at(w: ti.template(), r: ti.template(), p: ti.i32, field: ti.template()):
    """A value of the nodes (vectors) where vertex p is."""
    value = ti.Vector.zero(w.real, 3)
    for a in range(4):
        value += r.weight[p][a] * field[w.cell[r.cell[r.of[p]]][a]]
    return value


@ti.kernel
def find(w: ti.template(), r: ti.template(), n_cells: ti.i32, n_colliders: ti.i32, dt: ti.f64) -> ti.i32:
    """List what is near, and share out stiffness among those that are about to touch; how many vertices are near."""
    for q in range(n_cells):
        near = _is_near(w, r, q, n_colliders, ti.cast(dt, w.real))
        if r.close[q] == 1 and near == 0:
            for p in range(r.first[q], r.first[q + 1]):
                r.acting[p] = 0
                for c in range(n_colliders):
                    r.touching[c, p] = contact.NONE
                    r.pressed[c, p] = 0.0
                    r.slip[c, p] = ti.Vector.zero(w.real, 3)
        r.close[q] = near
    ti.loop_config(serialize=True)
    for _ in range(1):
        cells, riders = 0, 0
        for q in range(n_cells):
            if r.close[q] == 1:
                r.near_cell[cells] = q
                cells += 1
                for a in range(4):
                    r.crowd[w.cell[r.cell[q]][a]] = 0.0
                for p in range(r.first[q], r.first[q + 1]):
                    r.near[riders] = p
                    riders += 1
        r.near_count[CELLS] = cells
        r.near_count[RIDERS] = riders
    for k in range(r.near_count[RIDERS]):
        p = r.near[k]
        start = at(w, r, p, w.x)
        end = start + ti.cast(dt, w.real) * at(w, r, p, w.v)
        r.acting[p] = 0
        for c in range(n_colliders):
            if contact.gap(w, c, start, end)[0] < 0:
                r.acting[p] = 1
    ti.loop_config(serialize=True)
    for k in range(r.near_count[RIDERS]):
        p = r.near[k]
        if r.acting[p] == 1:
            for a in range(4):
                i = w.cell[r.cell[r.of[p]]][a]
                r.crowd[i] = r.crowd[i] + ti.abs(r.weight[p][a])
    for k in range(r.near_count[RIDERS]):
        p = r.near[k]
        for a in range(4):
            own = ti.abs(r.weight[p][a])
            crowd = r.crowd[w.cell[r.cell[r.of[p]]][a]] + (own if r.acting[p] == 0 else 0.0)
            r.share[p][a] = own / crowd if own > ti.cast(NOTHING, w.real) else 0.0
    return r.near_count[RIDERS]


@ti.kernel
def _fill(w: ti.template(), r: ti.template(), cell: _array(), first: _array(), of: _array(), weight: _array()):
    for q in range(cell.shape[0]):
        r.cell[q] = cell[q]
        r.reach[q] = 0.0
        for p in range(first[q], first[q + 1]):
            total = ti.cast(0.0, w.real)
            for a in ti.static(range(4)):
                total += ti.abs(weight[p, a])
            r.reach[q] = ti.max(r.reach[q], total)
    for q in range(first.shape[0]):
        r.first[q] = first[q]
    for p in range(of.shape[0]):
        r.of[p] = of[p]
        for a in ti.static(range(4)):
            r.weight[p][a] = weight[p, a]


@ti.kernel
def read_contacts(r: ti.template(), order: _array(), slip: _array(), pressed: _array(), touching: _array()):
    """As `carrying.read_contacts`, for the vertices in another order."""
    for c, p in ti.ndrange(touching.shape[0], touching.shape[1]):
        for k in ti.static(range(3)):
            slip[c, p, k] = r.slip[c, order[p]][k]
        pressed[c, p] = r.pressed[c, order[p]]
        touching[c, p] = r.touching[c, order[p]]


@ti.kernel
def write_contacts(r: ti.template(), order: _array(), slip: _array(), pressed: _array(), touching: _array()):
    """The inverse of `read_contacts`. Whatever touches is near: what is not will be let go of."""
    for c, p in ti.ndrange(touching.shape[0], touching.shape[1]):
        for k in ti.static(range(3)):
            r.slip[c, order[p]][k] = slip[c, p, k]
        r.pressed[c, order[p]] = pressed[c, p]
        r.touching[c, order[p]] = touching[c, p]
    for q in range(r.cells):
        r.close[q] = 1


def riders_of(w: World, element: np.ndarray, weights: np.ndarray) -> Riders:
    """The vertices in the elements (p,), sorted, with weights (p,4); fields are made once for each room."""
    cells, first, of = np.unique(element, return_index=True, return_inverse=True)
    room = round_up(len(element), 256), round_up(len(cells), 64)
    if room not in w.companions:
        w.companions[room] = Riders(w, *room)
    riders = w.companions[room]
    first = np.append(first, len(element)).astype(np.int32)
    given = np.ascontiguousarray(weights, dtype=dtype_of(w))
    _fill(w, riders, cells.astype(np.int32), first, of.astype(np.int32), given)
    return riders
