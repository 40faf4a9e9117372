"""Loops over plastic elements with an isotropic law: multiplicative plasticity, F = F_e F_p.

They come between `isotropic_elements.decompose`, which gives F_e with the F_p that the element keeps, and
`isotropic_elements.store_blocks`. A law sees F_e alone, with the gradients of `elements.gradients_of`. Where it yields
within a step, stress and tangent are those after the return, as functions of F_e before it: still an isotropic law, and
so told by stretches. In plane strain the third stretch, across the plane, is what plastic flow has left of 1.
"""

from taichifem import elements
from taichifem.formulas import finite_plasticity, isotropic
from taichifem.formulas.eigen import diagonal, symmetric_eigen
from taichifem.formulas.plasticity import CREEP
from taichifem.runtime import ti
from taichifem.yielding_elements import FIRM


@ti.func
def _stretches(w: ti.template(), e: ti.i32):
    """All three stretches of F_e (3,)."""
    return _all_stretches(w.stretch[e], w.plastic_inverse[e], w)


@ti.func
def _all_stretches(s, inverse, w: ti.template()):
    """Those in the plane (d,), and the one across that F_p^-1 leaves."""
    if ti.static(w.d == 3):
        return s
    else:
        return ti.Vector([s[0], s[1], inverse[1, 1]])


@ti.func
def _first(values, n: ti.template()):
    return ti.Vector([values[k] for k in ti.static(range(n))])


@ti.func
def _corner(M, n: ti.template()):
    return ti.Matrix([[M[i, j] for j in ti.static(range(n))] for i in ti.static(range(n))])


@ti.func
def _returned(w: ti.template(), law: ti.template(), e: ti.i32, row, s, dt):
    """`finite_plasticity.returned` from the stretches s (3,), which are all above `CRUSHED`."""
    kind = ti.cast(row[elements.PLASTICITY], ti.i32)
    limits = row[elements.LIMIT], row[elements.SLOPE], row[elements.RATE], ti.cast(dt, w.real)
    moduli = row[elements.LAMBDA], row[elements.MU]
    return finite_plasticity.returned(law, kind, ti.log(s), w.hardened[e], *moduli, *limits)


@ti.func
def _logarithm(M):
    """ln of the left stretch of M (3,3)."""
    values, Q = symmetric_eigen(M @ M.transpose())
    return Q @ diagonal(0.5 * ti.log(values)) @ Q.transpose()


@ti.func
def _flowed(w: ti.template(), law: ti.template(), e: ti.i32, row, s, dt):
    """F_p^-1 (3,3) after dt [s], and the growth of what has accumulated."""
    inverse, growth = w.plastic_inverse[e], 0 * s[0]
    if s.min() > finite_plasticity.CRUSHED:
        eps, more, _tangent = _returned(w, law, e, row, s, dt)
        growth = more
        if growth > 0:
            V, share = w.svd_v[e], ti.exp(eps) / s
            turned = elements.lifted_matrix(V @ diagonal(_first(share, w.d)) @ V.transpose(), w)
            if ti.static(w.d == 2):
                turned[1, 1] = share[2]
            inverse = inverse @ turned
            if row[elements.PLASTICITY] == CREEP:
                whole, most = _logarithm(inverse), row[elements.SLOPE]
                if whole.norm() > most:
                    # The same axes, less far: F_p^-1 = V exp(..) R, and R is left as it is.
                    values, Q = symmetric_eigen(whole)
                    inverse = Q @ diagonal(ti.exp((most / whole.norm() - 1) * values)) @ Q.transpose() @ inverse
                    moved = _logarithm(w.plastic_inverse[e].inverse() @ inverse)
                    growth = ti.sqrt(ti.cast(2 / 3, w.real)) * moved.norm()
            inverse /= ti.pow(inverse.determinant(), ti.cast(1 / 3, w.real))
    return inverse, growth


@ti.func
def _left(w: ti.template(), e: ti.i32, s, inverse):
    """U, stretches (d,) and V of the F_e that is left when F_p^-1 changes to `inverse`; s (3,): stretches before."""
    change = elements.seen_matrix(w.plastic_inverse[e].inverse() @ inverse, w)
    left = diagonal(_first(s, w.d)) @ w.svd_v[e].transpose() @ change
    squares, L = symmetric_eigen(left @ left.transpose())
    after = ti.sqrt(squares)
    return w.svd_u[e] @ L, after, left.transpose() @ L @ diagonal(1 / after)


@ti.kernel
def flow(w: ti.template(), law: ti.template(), number: ti.i32, n_elements: ti.i32, due: ti.f64):
    """What flows over `due` [s] at the present shape stays: F_p and F_e change, and F does not."""
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[elements.MODEL] == number:
            s = _stretches(w, e)
            inverse, growth = _flowed(w, law, e, row, s, due)
            if growth > 0:
                w.svd_u[e], w.stretch[e], w.svd_v[e] = _left(w, e, s, inverse)
                w.plastic_inverse[e] = inverse
                w.hardened[e] = w.hardened[e] + growth


@ti.func
def _answer(w: ti.template(), law: ti.template(), flows: ti.template(), e: ti.i32, row, within):
    """First derivatives (d,) and tangent A (d,d) by the stretches, after flow over `within` [s]."""
    la, mu, s = row[elements.LAMBDA], row[elements.MU], _stretches(w, e)
    slope, A = law.slope(s, la, mu), law.curvature(s, la, mu)
    if ti.static(flows):  # noqa: SIM102
        if row[elements.PLASTICITY] > CREEP and s.min() > finite_plasticity.CRUSHED:
            eps, growth, T = _returned(w, law, e, row, s, within)
            if growth > 0:
                tau, _elastic = finite_plasticity.kirchhoff(law, ti.exp(eps), la, mu)
                slope = tau / s
                by_logarithm = T - diagonal(tau)
                # As in `yielding_elements`: where nothing else does, this holds the nodes.
                A = by_logarithm / s.outer_product(s) + FIRM * A
    return _first(slope, w.d), _corner(A, w.d)


@ti.kernel
def respond(
    w: ti.template(),
    law: ti.template(),
    flows: ti.template(),
    number: ti.i32,
    n_elements: ti.i32,
    stiffness_factor: ti.f64,
    damping_factor: ti.f64,
    rate_factor: ti.f64,
    rate_damping: ti.f64,
    within: ti.f64,
    projected: ti.i32,
):
    """Corner forces and tangent, as `isotropic_elements.respond`.

    flows: does it flow before it answers?  within: for how long [s], if so.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[elements.MODEL] == number:
            U, s, V = w.svd_u[e], w.stretch[e], w.svd_v[e]
            slope, A = _answer(w, law, flows, e, row, within)
            A, p, q = isotropic.tangent_of(slope, A, s, law.EVEN)
            damping_a, damping_p, damping_q = isotropic.project(A, p, q)
            if projected:
                A, p, q = damping_a, damping_p, damping_q
            gradients, beta = elements.gradients_of(w, e), row[elements.STIFFNESS_DAMPING]
            rate = elements.edges(w.v, w, e) @ gradients
            share = ti.cast(rate_factor, w.real) + ti.cast(rate_damping, w.real) * beta
            P = isotropic.first_piola(U, slope, V)
            P += share * isotropic.stress_change(rate, U, V, damping_a, damping_p, damping_q)
            elements.hand_out(elements.with_first(-w.volume[e] * (gradients @ P.transpose())), w.corner_force, w, e)
            own, extra = ti.cast(stiffness_factor, w.real), ti.cast(damping_factor, w.real) * beta
            w.tangent_a[e] = own * A + extra * damping_a
            w.tangent_p[e] = own * p + extra * damping_p
            w.tangent_q[e] = own * q + extra * damping_q


@ti.kernel
def measure(w: ti.template(), law: ti.template(), number: ti.i32, n_elements: ti.i32, due: ti.f64):
    """Cauchy stress `w.stress` [Pa] and energy `w.energy` [J] after flow over `due` [s], which does not stay."""
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[elements.MODEL] == number:
            s, U, la, mu = _stretches(w, e), w.svd_u[e], row[elements.LAMBDA], row[elements.MU]
            if due > 0:
                inverse, growth = _flowed(w, law, e, row, s, due)
                if growth > 0:
                    turned, after, _V = _left(w, e, s, inverse)
                    U, s = turned, _all_stretches(after, inverse, w)
            # Stress along the axes in the plane, and across it.
            slope = law.slope(s, la, mu)
            volume = s[0] * s[1] * s[2]
            volume = ti.select(volume >= 0, ti.max(volume, 1e-6), ti.min(volume, -1e-6))
            principal = slope * s / volume
            w.stress[e] = elements.lifted_matrix(U @ diagonal(_first(principal, w.d)) @ U.transpose(), w)
            if ti.static(w.d == 2):
                w.stress[e][1, 1] = principal[2]
            w.energy[e] = w.volume[e] * law.energy(s, la, mu)


@ti.kernel
def show(w: ti.template(), law: ti.template(), number: ti.i32, n_elements: ti.i32, due: ti.f64):
    """Plastic strain ln U_p (3,3) to `w.stress` and what has accumulated to `w.energy`, after flow over `due`."""
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[elements.MODEL] == number:
            inverse, total = w.plastic_inverse[e], w.hardened[e]
            if due > 0:
                inverse, growth = _flowed(w, law, e, row, _stretches(w, e), due)
                total += growth
            w.stress[e], w.energy[e] = -_logarithm(inverse), total
