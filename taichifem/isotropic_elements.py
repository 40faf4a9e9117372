"""Loops over the elements of isotropic laws: forces, tangent blocks, stress and energy.

Which law, is settled when a kernel is compiled: one small kernel for each law that a scene uses, between two that all
laws share. Tangents are projected to positive semi-definite, element by element, so that the matrix of an implicit
step stays so.
"""

from taichifem import elements
from taichifem.formulas import eigen, isotropic
from taichifem.runtime import ti


@ti.func
def corner_pair(w: ti.template(), a: ti.i32, b: ti.i32):
    """Number of the pair a <= b of corners among 00 01 02 03 11 12 13 22 23 33, or 00 01 02 11 12 22."""
    return a * w.corners + b - a * (a + 1) // 2


@ti.kernel
def decompose(w: ti.template(), n_elements: ti.i32, most: ti.i32, keep: ti.i32):
    """F = U diag(s) V^T of every element with an isotropic law; of plastic ones, F_e."""
    for e in range(n_elements):
        if w.table[w.material[e]][elements.MODEL] >= elements.FIRST_LAW:
            F = elements.edges(w.x, w, e) @ elements.gradients_of(w, e)
            U, s, V = eigen.signed_svd(F, elements.frame_of(w, e, F, most, keep))
            w.svd_u[e] = U
            w.svd_v[e] = V
            w.stretch[e] = s


@ti.kernel
def push(w: ti.template(), law: ti.template(), number: ti.i32, n_elements: ti.i32):
    """After `decompose`: the elastic corner forces of the elements of law `number`, and nothing else."""
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[elements.MODEL] == number:
            slope = law.slope(w.stretch[e], row[elements.LAMBDA], row[elements.MU])
            P = isotropic.first_piola(w.svd_u[e], slope, w.svd_v[e])
            forces = elements.with_first(-w.volume[e] * (w.gradients[e] @ P.transpose()))
            elements.hand_out(forces, w.corner_force, w, e)


@ti.kernel
def respond(
    w: ti.template(),
    law: ti.template(),
    number: ti.i32,
    n_elements: ti.i32,
    stiffness_factor: ti.f64,
    damping_factor: ti.f64,
    rate_factor: ti.f64,
    rate_damping: ti.f64,
    projected: ti.i32,
):
    """After `decompose`: corner forces, and the tangent of the elements of law `number`, as in `elements.deform`.

    projected: 0 takes the exact tangent, which may be indefinite. Damping has the projected one always: with the
    exact one it would feed crushed elements energy.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[elements.MODEL] == number:
            la, mu = row[elements.LAMBDA], row[elements.MU]
            U, s, V = w.svd_u[e], w.stretch[e], w.svd_v[e]
            A, p, q = isotropic.tangent(law, s, la, mu)
            damping_a, damping_p, damping_q = isotropic.project(A, p, q)
            if projected:
                A, p, q = damping_a, damping_p, damping_q
            rate, beta = elements.edges(w.v, w, e) @ w.gradients[e], row[elements.STIFFNESS_DAMPING]
            share = ti.cast(rate_factor, w.real) + ti.cast(rate_damping, w.real) * beta
            P = isotropic.first_piola(U, law.slope(s, la, mu), V)
            P += share * isotropic.stress_change(rate, U, V, damping_a, damping_p, damping_q)
            forces = elements.with_first(-w.volume[e] * (w.gradients[e] @ P.transpose()))
            elements.hand_out(forces, w.corner_force, w, e)
            own, extra = ti.cast(stiffness_factor, w.real), ti.cast(damping_factor, w.real) * beta
            w.tangent_a[e] = own * A + extra * damping_a
            w.tangent_p[e] = own * p + extra * damping_p
            w.tangent_q[e] = own * q + extra * damping_q


@ti.kernel
def store_blocks(w: ti.template(), n_elements: ti.i32):
    """After `respond`: blocks V K_ab of what it made the tangent, in `w.tangent`."""
    for k in range(n_elements * w.corner_pairs):
        e = k // w.corner_pairs
        if w.table[w.material[e]][elements.MODEL] >= elements.YIELDING_LINEAR:
            # Pair number back to corners: rows of 4, 3, 2 and 1, or of 3, 2 and 1.
            left, a = k % w.corner_pairs, 0
            while left >= w.corners - a:
                left -= w.corners - a
                a += 1
            b = a + left
            D = elements.gradients_of(w, e)
            g_a, g_b = elements.gradient(D, w, a), elements.gradient(D, w, b)
            block = isotropic.stiffness_block(
                g_a, g_b, w.svd_u[e], w.svd_v[e], w.tangent_a[e], w.tangent_p[e], w.tangent_q[e]
            )
            if w.table[w.material[e]][elements.MODEL] == elements.YIELDING_GREEN:
                Q, stress = w.svd_v[e], w.stretch[e]
                turning = (stress * (Q.transpose() @ g_a)).dot(Q.transpose() @ g_b)
                for j in ti.static(range(w.d)):
                    block[j, j] += turning
            w.tangent[k] = w.volume[e] * block


@ti.kernel
def measure(w: ti.template(), law: ti.template(), number: ti.i32, n_elements: ti.i32):
    """After `decompose`: Cauchy stress `w.stress` [Pa] and energy `w.energy` [J] of the elements of law `number`."""
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[elements.MODEL] == number:
            la, mu = row[elements.LAMBDA], row[elements.MU]
            s, slope = w.stretch[e], law.slope(w.stretch[e], la, mu)
            w.stress[e] = elements.lifted_matrix(isotropic.cauchy(w.svd_u[e], slope, s), w)
            if ti.static(w.d == 2):
                w.stress[e][1, 1] = isotropic.cauchy_across(law, s, la, mu)
            w.energy[e] = w.volume[e] * law.energy(s, la, mu)
