"""Loops over plastic elements with exact tangents: linear and corotational ones for Newton, and St. Venant-Kirchhoff.

The return to the yield surface is inside the iteration here: every look at the forces starts from the plastic strain
at the start of the step, and the tangent is that of the return. As the return keeps the axes of the strain, stress and
tangent are told along them, and stored as those of isotropic laws are. How the rotation of an element turns with its
corners is left out of the tangent, as it is of the fast road.

Green's strain E = (F^T F - I) / 2 follows the same lines, with F in place of the rotation: its plastic part is taken
off, S = C (E - E_p) follows, and F S are the forces. As F changes with the corners, so does S along: to the tangent
comes g_a . S g_b for each pair of corners, or its positive part.
"""

from taichifem import elements, plastic_strain
from taichifem.formulas import hooke, plasticity
from taichifem.formulas.eigen import diagonal, epsilon, symmetric_eigen
from taichifem.formulas.isotropic import PAIRS
from taichifem.runtime import ti

FIRM = 1e-6
"""Part of the elastic stiffness that a tangent has besides its own."""


@ti.func
def _is_here(model):
    return model >= elements.YIELDING_LINEAR and model < elements.FIRST_LAW


@ti.func
def _is_additive(model):
    return model != elements.SPRINGS and model < elements.FIRST_LAW


@ti.func
def _axes(strain, w: ti.template()):
    """Principal values (3,) of a strain (3,3), and the axes (d,d) that an element sees; in plane strain the last
    value is across."""
    values, Q = symmetric_eigen(elements.seen_matrix(strain, w))
    if ti.static(w.d == 3):
        return values, Q
    else:
        return ti.Vector([values[0], values[1], strain[1, 1]]), Q


@ti.func
def _first(values, n: ti.template()):
    return ti.Vector([values[k] for k in ti.static(range(n))])


@ti.func
def _quotients(stress, strain, A):
    """Of every pair of axes, the difference of stresses over that of strains; its limit where these nearly agree."""
    close = ti.static(epsilon() ** (1 / 3)) * ti.abs(strain).max()
    return ti.Vector(
        [
            (stress[i] - stress[j]) / (strain[i] - strain[j])
            if ti.abs(strain[i] - strain[j]) > close
            else 0.5 * (A[i, i] + A[j, j]) - A[i, j]
            for i, j in ti.static(PAIRS[strain.n])
        ]
    )


@ti.kernel
def respond(
    w: ti.template(),
    n_elements: ti.i32,
    stiffness_factor: ti.f64,
    damping_factor: ti.f64,
    rate_factor: ti.f64,
    rate_damping: ti.f64,
    within: ti.f64,
    most: ti.i32,
    keep: ti.i32,
    projected: ti.i32,
):
    """Corner forces, and the tangent for `isotropic_elements.store_blocks`.

    within: time over which it flows [s], 0 for not at all; the other arguments are those of `elements.deform`. Creep,
    which is done once a step, does not flow here. keep: of rotations alone.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if _is_here(row[elements.MODEL]):
            la, mu, kind = row[elements.LAMBDA], row[elements.MU], ti.cast(row[elements.PLASTICITY], ti.i32)
            gradients = w.gradients[e]
            F = elements.edges(w.x, w, e) @ gradients
            R = elements.frame_of(w, e, F, most, keep)
            e3, Q = _axes(elements.elastic_strain(F, R, w, e, row, 0.0, 0), w)
            if within == 0:
                kind = plasticity.NONE
            span = ti.cast(within if within > 0 else 1.0, w.real)
            limits = row[elements.LIMIT], row[elements.SLOPE], row[elements.RATE]
            s3, A3 = plasticity.response(kind, e3, w.hardened[e], la, mu, *limits, span)
            s, strain = _first(s3, w.d), _first(e3, w.d)
            A = ti.Matrix([[A3[i, j] for j in ti.static(range(w.d))] for i in ti.static(range(w.d))])
            elastic = diagonal(0 * s + 2 * mu) + la
            # Where stress can no longer grow nothing holds the nodes, and round-off would send them far.
            A += FIRM * elastic
            p = 0.5 * _quotients(s, strain, A) + FIRM * mu
            rate = elements.edges(w.v, w, e) @ gradients
            small = elements.lifted_matrix(elements.symmetric(R.transpose() @ rate), w)
            beta = row[elements.STIFFNESS_DAMPING]
            share = ti.cast(rate_factor, w.real) + ti.cast(rate_damping, w.real) * beta
            slowed = elements.seen_matrix(hooke.stress(small, la, mu), w)
            P = R @ (Q @ diagonal(s) @ Q.transpose() + share * slowed)
            forces = elements.with_first(-w.volume[e] * (gradients @ P.transpose()))
            elements.hand_out(forces, w.corner_force, w, e)
            own, extra = ti.cast(stiffness_factor, w.real), ti.cast(damping_factor, w.real) * beta
            w.svd_u[e], w.svd_v[e], w.stretch[e] = R @ Q, Q, own * (ti.max(s, 0.0) if projected else s)
            w.tangent_a[e] = own * A + extra * elastic
            w.tangent_p[e] = own * p + extra * mu
            w.tangent_q[e] = own * p + extra * mu


@ti.kernel
def settle(w: ti.template(), n_elements: ti.i32, due: ti.f64, most: ti.i32, from_model: ti.i32):
    """What flows over `due` [s] at the present shape becomes plastic strain, where MODEL is `from_model` or above."""
    for e in range(n_elements):
        row = w.table[w.material[e]]
        flows = row[elements.PLASTICITY] > 0 and row[elements.MODEL] >= from_model
        if flows and _is_additive(row[elements.MODEL]):
            F = elements.edges(w.x, w, e) @ w.gradients[e]
            R = elements.frame_of(w, e, F, most, 0)
            elements.elastic_strain(F, R, w, e, row, due, 1)


@ti.kernel
def show(w: ti.template(), n_elements: ti.i32, due: ti.f64, most: ti.i32):
    """Plastic strain (3,3), and how much has accumulated, after flow over `due`: to `w.stress` and `w.energy`."""
    for e in range(n_elements):
        row = w.table[w.material[e]]
        w.stress[e], w.energy[e] = ti.Matrix.zero(w.real, 3, 3), 0.0
        if row[elements.PLASTICITY] > 0 and _is_additive(row[elements.MODEL]):
            F = elements.edges(w.x, w, e) @ w.gradients[e]
            R = elements.frame_of(w, e, F, most, 0)
            strain = elements.elastic_strain(F, R, w, e, row, 0.0, 0)
            w.stress[e], w.energy[e] = plastic_strain.kept(w, e), w.hardened[e]
            if due > 0:
                law = elements.plastic_law(row)
                moved, growth = plastic_strain.flowed(w, e, strain, row[elements.MU], law, ti.cast(due, w.real))
                w.stress[e] = w.stress[e] + moved
                w.energy[e] = w.energy[e] + growth
