"""Loops over mass-spring elements: every edge of an element is a spring, and springs on a shared edge act together.

The stiffness k of a spring follows from E such that a body stretched evenly answers like one with that Young's
modulus: k = E V / L^2 for each element around the edge, L its length at rest (Van Gelder 1998). Such a network has
Poisson's ratio 1/4 in space and 1/3 in the plane, whatever the material says, and no way to hold its volume.
"""

from taichifem import elements
from taichifem.formulas import plasticity
from taichifem.isotropic_elements import corner_pair
from taichifem.runtime import ti


@ti.func
def _youngs(row):
    la, mu = row[elements.LAMBDA], row[elements.MU]
    return mu * (3 * la + 2 * mu) / (la + mu)


@ti.func
def _spring(w: ti.template(), e: ti.i32, a: ti.template(), b: ti.template(), number: ti.template()):
    """Length at rest and now [m], direction from a to b, and stiffness [N/m] of spring `number`, corners a and b."""
    row = w.table[w.material[e]]
    i, j = w.cell[e][a], w.cell[e][b]
    rest = elements.seen(w.rest[j] - w.rest[i], w).norm()
    along = elements.seen(w.x[j] - w.x[i], w)
    length = along.norm()
    stiffness = _youngs(row) * w.volume[e] / (rest * rest)
    if row[elements.SPRING] > 0:
        stiffness = row[elements.SPRING] * w.spring_share[e][number]
    # Two nodes in one place have no direction, and no force along it.
    return rest, length, along / ti.max(length, 1e-9 * rest), stiffness


@ti.func
def _flow(w: ti.template(), e: ti.i32, number: ti.template(), kind, rest, first_rest, length, dt):
    """Growth of the rest length [m] and of the plastic strain of spring `number` in dt [s]."""
    row, alpha = w.table[w.material[e]], w.spring_hardened[e][number]
    limit, pressed = row[elements.LIMIT], row[elements.PRESSED]
    stress = _youngs(row), limit, pressed, row[elements.SLOPE], row[elements.RATE]
    return plasticity.spring_flow(kind, length, rest, first_rest, alpha, *stress, ti.cast(dt, w.real))


@ti.func
def _rest(w: ti.template(), e: ti.i32, number: ti.template(), first_rest, length, due, keep: ti.i32):
    """Rest length [m] of a spring after flow over the time `due` [s]; keep: what has flowed stays."""
    rest = first_rest
    if ti.static(w.capacity.plastic):
        kind = ti.cast(w.table[w.material[e]][elements.PLASTICITY], ti.i32)
        rest += w.spring_growth[e][number]
        if kind > 0 and due > 0:
            moved, growth = _flow(w, e, number, kind, rest, first_rest, length, due)
            rest += moved
            if keep:
                w.spring_growth[e][number] = rest - first_rest
                w.spring_hardened[e][number] = w.spring_hardened[e][number] + growth
    return rest


@ti.func
def _yielding(w: ti.template(), e: ti.i32, number: ti.template(), rest, first_rest, length, within):
    """Rest length [m] when it flows over the time `within` [s], and the part of the stiffness that is left then."""
    firm = ti.cast(1.0, w.real)
    if ti.static(w.capacity.plastic):
        row = w.table[w.material[e]]
        kind = ti.cast(row[elements.PLASTICITY], ti.i32)
        if kind > plasticity.CREEP and within > 0:
            moved = _flow(w, e, number, kind, rest, first_rest, length, within)[0]
            if moved != 0:
                h = row[elements.SLOPE] + row[elements.RATE] / ti.cast(within, w.real)
                firm = h / (_youngs(row) + h)
                rest += moved
    return rest, firm


@ti.kernel
def settle(w: ti.template(), n_elements: ti.i32, due: ti.f64):
    """Keep what flows over the time `due` [s] at the present lengths."""
    for e in range(n_elements):
        if w.table[w.material[e]][elements.MODEL] == elements.SPRINGS:
            for a in ti.static(range(w.corners)):
                for b in ti.static(range(a + 1, w.corners)):
                    number = ti.static(a * w.d + b - 1 - a * (a + 1) // 2)
                    first_rest, length, _n, _k = _spring(w, e, a, b, number)
                    _rest(w, e, number, first_rest, length, due, 1)


@ti.kernel
def show(w: ti.template(), n_elements: ti.i32, due: ti.f64):
    """Plastic strain (3,3), the mean of n n^T times that of each spring, and how much has accumulated, on average."""
    for e in range(n_elements):
        if w.table[w.material[e]][elements.MODEL] == elements.SPRINGS:
            strain, sum_ = ti.Matrix.zero(w.real, w.d, w.d), ti.cast(0.0, w.real)
            share = ti.static(1 / (w.corner_pairs - w.corners))
            for a in ti.static(range(w.corners)):
                for b in ti.static(range(a + 1, w.corners)):
                    number = ti.static(a * w.d + b - 1 - a * (a + 1) // 2)
                    first_rest, length, n, _k = _spring(w, e, a, b, number)
                    rest = _rest(w, e, number, first_rest, length, due, 0)
                    grown = (rest - first_rest) / first_rest
                    strain += share * grown * n.outer_product(n)
                    fresh = (rest - first_rest - w.spring_growth[e][number]) / first_rest
                    sum_ += share * (w.spring_hardened[e][number] + ti.abs(fresh))
            w.stress[e] = elements.lifted_matrix(strain, w)
            w.energy[e] = sum_


@ti.kernel
def stretch(
    w: ti.template(),
    n_elements: ti.i32,
    stiffness_factor: ti.f64,
    damping_factor: ti.f64,
    rate_factor: ti.f64,
    rate_damping: ti.f64,
    due: ti.f64,
    within: ti.f64,
    keep: ti.i32,
    projected: ti.i32,
):
    """Corner forces and stiffness blocks; the arguments are those of `elements.deform`.

    Damping acts along the spring. projected: the part of the stiffness that turns a pressed spring away is left out.
    within: time [s] over which what yields flows before it answers, for Newton's method.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[elements.MODEL] == elements.SPRINGS:
            beta = row[elements.STIFFNESS_DAMPING]
            factor = ti.cast(stiffness_factor, w.real) + ti.cast(damping_factor, w.real) * beta
            damping = ti.cast(rate_factor, w.real) + ti.cast(rate_damping, w.real) * beta
            force = ti.Matrix.zero(w.real, w.corners, w.d)
            for k in ti.static(range(w.corner_pairs)):
                w.tangent[e * w.corner_pairs + k] = ti.Matrix.zero(w.real, w.d, w.d)
            for a in ti.static(range(w.corners)):
                for b in ti.static(range(a + 1, w.corners)):
                    number = ti.static(a * w.d + b - 1 - a * (a + 1) // 2)
                    first_rest, length, n, k = _spring(w, e, a, b, number)
                    rest = _rest(w, e, number, first_rest, length, due, keep)
                    rest, firm = _yielding(w, e, number, rest, first_rest, length, within)
                    side = 1 - rest / ti.max(length, 1e-9 * rest)
                    if projected:
                        side = ti.max(side, 0.0)
                    rate = elements.seen(w.v[w.cell[e][b]] - w.v[w.cell[e][a]], w)
                    along = n.outer_product(n)
                    across = ti.Matrix.identity(w.real, w.d) - along
                    pull = k * ((length - rest) * n + damping * (along @ rate))
                    # What linearisation brings holds for the part across the spring too; damping does not.
                    pull += k * ti.cast(rate_factor, w.real) * side * (across @ rate)
                    block = k * (factor * firm * along + ti.cast(stiffness_factor, w.real) * side * across)
                    for c in ti.static(range(w.d)):
                        force[a, c] += pull[c]
                        force[b, c] -= pull[c]
                    w.tangent[e * w.corner_pairs + corner_pair(w, a, a)] += block
                    w.tangent[e * w.corner_pairs + corner_pair(w, b, b)] += block
                    w.tangent[e * w.corner_pairs + corner_pair(w, a, b)] -= block
            elements.hand_out(force, w.corner_force, w, e)


@ti.kernel
def measure(w: ti.template(), n_elements: ti.i32, due: ti.f64):
    """Cauchy stress `w.stress` [Pa], the mean over the element of what its springs carry, and energy `w.energy` [J]."""
    for e in range(n_elements):
        if w.table[w.material[e]][elements.MODEL] == elements.SPRINGS:
            total = ti.Matrix.zero(w.real, w.d, w.d)
            energy = ti.cast(0.0, w.real)
            for a in ti.static(range(w.corners)):
                for b in ti.static(range(a + 1, w.corners)):
                    number = ti.static(a * w.d + b - 1 - a * (a + 1) // 2)
                    first_rest, length, n, k = _spring(w, e, a, b, number)
                    rest = _rest(w, e, number, first_rest, length, due, 0)
                    total += k * (length - rest) * length * n.outer_product(n)
                    energy += 0.5 * k * (length - rest) ** 2
            det = (elements.edges(w.x, w, e) @ w.gradients[e]).determinant()
            volume = w.volume[e] * ti.max(ti.abs(det), 1e-6)
            w.stress[e] = elements.lifted_matrix(total / volume, w)
            w.energy[e] = energy
