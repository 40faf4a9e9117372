"""Contact of embedded vertices with rigid colliders, handed to the nodes of the mesh that they ride in.

A vertex at sum_a w_a x_a touches by the rule of `contact`: its springs push and hold it as those of a node do, and
are an element of four nodes to the solver, with w_a w_b times their stiffness between nodes a and b. The blocks of
these are in the matrix already, since a vertex lies in one tetrahedron; so they are added to what is assembled, and
taken out again when the next pass looks at the contacts anew.

A cage has far fewer nodes than its surface has vertices. Each of those that touch has the share |w_a| / sum_q |w_qa| of
node a, where q are all that touch, and the springs of its shares of nodes: so
however many touch, their stiffness stays about that of the nodes.
"""

import numpy as np

from taichifem.processes import contact, riders
from taichifem.processes.riders import CELLS, at
from taichifem.runtime import ti
from taichifem.transfer import dtype_of
from taichifem.world import Counts, World

FIRMNESS = 2.0
"""Times the stiffness of a vertex's shares: at the edge of a crowd, a vertex carries more than its share of the weight,
and is to sink in no deeper than a node would."""


@ti.func
def _stiffness(w: ti.template(), r: ti.template(), p: ti.i32, h):
    """Stiffness [N/m] of the contact springs of vertex p."""
    total = ti.cast(0.0, w.real)
    for a in range(4):
        total += r.share[p][a] * contact.stiffness(w, w.cell[r.cell[r.of[p]]][a], h)
    return ti.cast(FIRMNESS, w.real) * total


@ti.func
def _state(w: ti.template(), r: ti.template(), c: ti.i32, p: ti.i32, k, h, dt, velocity):
    start, base = at(w, r, p, w.x0), at(w, r, p, w.base_x)
    return contact.state_of(w, c, start, base, velocity, k, r.slip[c, p], r.pressed[c, p], h, dt)


@ti.func
def _mass(w: ti.template(), r: ti.template(), p: ti.i32):
    """The mass [kg] of vertex p's shares."""
    total = ti.cast(0.0, w.real)
    for a in range(4):
        total += r.share[p][a] * w.mass[w.cell[r.cell[r.of[p]]][a]]
    return total


@ti.kernel
def _touch(
    w: ti.template(),
    r: ti.template(),
    near: ti.i32,
    n_colliders: ti.i32,
    h: ti.f64,
    dt: ti.f64,
    weight: ti.f64,
    share: ti.f64,
) -> ti.i64:
    """What the springs of each vertex are at the end velocity guessed so far; as `contact.touch`."""
    total = ti.cast(0, ti.i64)
    for q in range(near):
        p = r.near[q]
        step, whole = ti.cast(h, w.real), ti.cast(dt, w.real)
        change = at(w, r, p, w.dv)
        end, k = at(w, r, p, w.v) + change, _stiffness(w, r, p, step)
        r.acting[p] = 0
        r.stiff[p] = ti.Matrix.zero(w.real, 3, 3)
        r.push[p] = ti.Vector.zero(w.real, 3)
        for c in range(n_colliders):
            state, force, normal, stretch = _state(w, r, c, p, k, step, whole, end)
            was, pressed = r.touching[c, p], r.pressed[c, p]
            springs, side = ti.Matrix.zero(w.real, 3, 3), ti.cast(0.0, w.real)
            if state != contact.NONE:
                springs, side = contact.springs_of(w, c, state, normal, stretch, k, pressed)
            wrong = contact.wrong_by(w, c, was, state, force, stretch, side, r.grip[c, p], pressed)
            if state != contact.NONE or was != contact.NONE:
                total += contact.excess(w, wrong, force, _mass(w, r, p), weight, share)
            r.touching[c, p], r.grip[c, p] = state, side
            if state != contact.NONE:
                r.acting[p] = 1
                r.stiff[p] += step * step * springs
                r.push[p] += step * (force * normal - side * stretch)
    return total


@ti.func
def _take_out(w: ti.template(), r: ti.template()):
    """Give the matrix back the blocks that it was assembled with."""
    for k in range(r.kept_count[0]):
        m = r.kept_count[0] - 1 - k
        w.block[r.kept_at[m]] = r.kept[m]


@ti.func
def _add(w: ti.template(), r: ti.template(), i: ti.i32, j: ti.i32, block):
    """Add a block to row i of the matrix, if column j of it is stored there."""
    for k in range(w.row_start[i], w.row_start[i + 1]):
        if w.column[k] == j:
            m = r.kept_count[0]
            r.kept_at[m], r.kept[m] = k, w.block[k]
            r.kept_count[0] = m + 1
            w.block[k] = w.block[k] + block


@ti.func
def _put_in(w: ti.template(), r: ti.template(), q: ti.i32):
    """Add the springs of the vertices in tetrahedron q to the matrix."""
    e = r.cell[q]
    for a in range(4):
        i = w.cell[e][a]
        for b in range(a, 4):
            total = ti.Matrix.zero(w.real, 3, 3)
            for p in range(r.first[q], r.first[q + 1]):
                if r.acting[p] == 1:
                    total += r.weight[p][a] * r.weight[p][b] * r.stiff[p]
            if a == b:
                w.spring[i] = w.spring[i] + total
            else:
                _add(w, r, i, w.cell[e][b], total)
                _add(w, r, w.cell[e][b], i, total)


@ti.func
def _put_on_nodes(w: ti.template(), r: ti.template(), q: ti.i32):
    """Add springs of single nodes that are at least as stiff: |w_a| sum |w_b| in place of w_a w_b."""
    e = r.cell[q]
    for a in range(4):
        i = w.cell[e][a]
        for p in range(r.first[q], r.first[q + 1]):
            if r.acting[p] == 1:
                lumped = ti.abs(r.weight[p][a]) * ti.abs(r.weight[p]).sum() * r.stiff[p]
                w.spring[i] = w.spring[i] + lumped
                w.spring_load[i] = w.spring_load[i] + lumped @ w.dv[i]


@ti.kernel
def _hand_on(w: ti.template(), r: ti.template(), assembled: ti.i32, lumped: ti.i32):
    """Hand the springs to the nodes: one thread, so that sums repeat bit for bit.

    assembled: the matrix is new, nothing is to be taken out.  lumped: there is no matrix, every node is on its own.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        if assembled == 0:
            _take_out(w, r)
        r.kept_count[0] = 0
        for k in range(r.near_count[CELLS]):
            q = r.near_cell[k]
            e, acting = r.cell[q], 0
            for p in range(r.first[q], r.first[q + 1]):
                if r.acting[p] == 1:
                    acting = 1
                    push = r.push[p]
                    if lumped == 0:
                        # Written for dv = 0: what `dv` adds stands in the matrix.
                        push += r.stiff[p] @ at(w, r, p, w.dv)
                    for a in range(4):
                        i = w.cell[e][a]
                        w.sprung[i] = 1
                        w.spring_load[i] = w.spring_load[i] + r.weight[p][a] * push
            if acting == 1:
                if lumped == 1:
                    _put_on_nodes(w, r, q)
                else:
                    _put_in(w, r, q)


@ti.kernel
def _press(
    w: ti.template(),
    r: ti.template(),
    near: ti.i32,
    n_colliders: ti.i32,
    h: ti.f64,
    dt: ti.f64,
    weight: ti.f64,
    share: ti.f64,
) -> ti.i64:
    """As `contact.press`."""
    total = ti.cast(0, ti.i64)
    for q in range(near):
        p = r.near[q]
        step, whole = ti.cast(h, w.real), ti.cast(dt, w.real)
        end, k = at(w, r, p, w.v) + at(w, r, p, w.dv), _stiffness(w, r, p, step)
        for c in range(n_colliders):
            force = ti.max(_state(w, r, c, p, k, step, whole, end)[1], 0.0)
            if force > 0 or r.pressed[c, p] > 0:
                total += contact.excess(w, ti.abs(force - r.pressed[c, p]), force, _mass(w, r, p), weight, share)
            r.pressed[c, p] = force
    return total


@ti.kernel
def _slide(w: ti.template(), r: ti.template(), near: ti.i32, n_colliders: ti.i32, h: ti.f64, dt: ti.f64):
    """As `contact.slide`."""
    for q in range(near):
        p = r.near[q]
        step, whole = ti.cast(h, w.real), ti.cast(dt, w.real)
        end, k = at(w, r, p, w.v), _stiffness(w, r, p, step)
        for c in range(n_colliders):
            state, force, _, stretch = _state(w, r, c, p, k, step, whole, end)
            force = ti.max(force, 0.0)
            most, held = w.collider_friction[c] * force, k * stretch.norm()
            if held > most:
                stretch *= most / held
            r.touching[c, p] = state
            r.pressed[c, p] = force
            r.slip[c, p] = stretch


class Riding:
    """The embedded vertices of a world in contact.

    element, weights: (p,) tetrahedra of the world, and (p,4) weights of their nodes.  lumped: for explicit steps.
    """

    def __init__(self, w: World, element: np.ndarray, weights: np.ndarray, *, lumped: bool) -> None:
        order = np.argsort(element, kind="stable")
        self._order, self._lumped, self._assembled = np.argsort(order).astype(np.int32), lumped, True
        self._cells, self._riders = len(np.unique(element)), riders.riders_of(w, element[order], weights[order])
        self.set_state(w, self._nothing(w, w.capacity.colliders))

    def find(self, w: World, counts: Counts, dt: float) -> None:
        """Which vertices may touch in a step of dt [s]: their number goes to `counts.riding`."""
        counts.riding = riders.find(w, self._riders, self._cells, counts.colliders, dt) if counts.colliders else 0

    def begin(self) -> None:
        """The matrix has been assembled."""
        self._assembled = True

    def touch(self, w: World, counts: Counts, h: float, dt: float, weight: float, share: float) -> int:
        """As `contact.touch`."""
        if not counts.riding:
            return 0
        excess = _touch(w, self._riders, counts.riding, counts.colliders, h, dt, weight, share)
        _hand_on(w, self._riders, self._assembled, self._lumped)
        self._assembled = False
        return excess

    def press(self, w: World, counts: Counts, h: float, dt: float, weight: float, share: float) -> int:
        """As `contact.press`."""
        return _press(w, self._riders, counts.riding, counts.colliders, h, dt, weight, share) if counts.riding else 0

    def slide(self, w: World, counts: Counts, h: float, dt: float) -> None:
        """As `contact.slide`."""
        if counts.riding:
            _slide(w, self._riders, counts.riding, counts.colliders, h, dt)

    def state(self, w: World, n_colliders: int) -> dict[str, np.ndarray]:
        """slip (colliders,p,3) [m], pressed (colliders,p) [N] and touching (colliders,p), of vertices as given."""
        arrays = self._nothing(w, n_colliders)
        if n_colliders:
            riders.read_contacts(self._riders, self._order, *arrays.values())
        return arrays

    def set_state(self, w: World, state: dict[str, np.ndarray]) -> None:
        """The inverse of `state`; what it does not speak of touches nothing."""
        arrays = self._nothing(w, w.capacity.colliders)
        for name, values in arrays.items():
            if name in state:
                values[: len(state[name])] = state[name]
        riders.write_contacts(self._riders, self._order, *arrays.values())

    def _nothing(self, w: World, n_colliders: int) -> dict[str, np.ndarray]:
        shape, real = (n_colliders, len(self._order)), dtype_of(w)
        return {
            "slip": np.zeros((*shape, 3), real),
            "pressed": np.zeros(shape, real),
            "touching": np.zeros(shape, np.int32),
        }
