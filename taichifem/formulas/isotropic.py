"""Stress and tangent of any isotropic law, from its derivatives by the stretches.

With F = U diag(s) V^T and G = U^T dF V, the change of stress dP = U dP^ V^T is nearly diagonal (Teran et al. 2005;
Smith, de Goes & Kim 2019):

    dP^_ii = sum_j A_ij G_jj,   dP^_ij = p_ij G_ij + q_ij G_ji  (i != j).

So A (d,d) and one p and one q per pair of axes, (3,) in 3-D and (1,) in 2-D, hold the whole tangent. The symmetric
part of G is stretched by p + q, the skew part by p - q. A law is a module of `models`, or one made by
`models.invertible.wrap`; which, is settled when the kernel is compiled.
"""

from taichifem.formulas.eigen import diagonal, epsilon, symmetric_eigen
from taichifem.runtime import ti

PAIRS = {2: ((0, 1),), 3: ((0, 1), (0, 2), (1, 2))}
"""The pairs i < j of axes in 2 and 3 dimensions; pair (i, j) has number i + j - 1."""

CANCELLED = 1e-4
"""Sum of two stretches below which they count as cancelled, for laws that are singular there."""


def _close() -> float:
    """Difference of stretches at which the errors of a quotient, epsilon / h, and of its limit, h^2, are alike."""
    return 2 * epsilon() ** (1 / 3)


@ti.func
def first_piola(U, slope, V):
    """P = U diag(slope) V^T (d,d) [Pa]; slope (d,) of the energy [Pa]."""
    return _scaled(U, slope) @ V.transpose()


@ti.func
def _signed(s):
    """The stretches, none of which counts as less than 1e-6 in size, and their product."""
    size = ti.max(ti.abs(s), 1e-6)
    signed = ti.select(s >= 0, size, -size)
    volume = 1.0
    for k in ti.static(range(s.n)):
        volume *= signed[k]
    return signed, volume


@ti.func
def cauchy(U, slope, s):
    """sigma = P F^T / det F (d,d) [Pa]; s (d,) stretches."""
    signed, volume = _signed(s)
    return _scaled(U, slope * signed / volume) @ U.transpose()


@ti.func
def cauchy_across(model: ti.template(), s, la, mu):
    """Stress [Pa] across the plane that holds the third stretch at 1, in plane strain; s (2,)."""
    _, volume = _signed(s)
    return model.slope(ti.Vector([s[0], s[1], 1.0]), la, mu)[2] / volume


@ti.func
def tangent(model: ti.template(), s, la, mu):
    """A (d,d), p and q, one per pair: the exact tangent at the stretches s (d,), all in Pa; moduli la, mu [Pa].

    Where two stretches nearly coincide, their quotient is replaced by its limit. Its error is of second order with
    the curvature at s itself, because along the line on which the two change places the mean curvature is even.
    The same holds where two stretches nearly cancel, if the law is even; if not, the true value grows without
    bound, and the quotient is bounded instead.
    """
    return tangent_of(model.slope(s, la, mu), model.curvature(s, la, mu), s, model.EVEN)


@ti.func
def tangent_of(slope, A, s, even: ti.template()):
    """The same from the first derivatives (d,) and A (d,d) of any function of the stretches s (d,)."""
    stretch = ti.Vector(
        [
            _quotient(slope[i] - slope[j], s[i] - s[j], 0.5 * (A[i, i] + A[j, j]) - A[i, j])
            for i, j in ti.static(PAIRS[s.n])
        ]
    )
    twist = ti.Vector(
        [
            _quotient(slope[i] + slope[j], s[i] + s[j], 0.5 * (A[i, i] + A[j, j]) + A[i, j])
            if ti.static(even)
            else (slope[i] + slope[j]) / ti.max(s[i] + s[j], CANCELLED)
            for i, j in ti.static(PAIRS[s.n])
        ]
    )
    return A, 0.5 * (stretch + twist), 0.5 * (stretch - twist)


@ti.func
def project(A, p, q):
    """The nearest positive semi-definite tangent: its negative eigenvalues become zero."""
    eigenvalues, Q = symmetric_eigen(A)
    stretch, twist = ti.max(p + q, 0.0), ti.max(p - q, 0.0)
    return _scaled(Q, ti.max(eigenvalues, 0.0)) @ Q.transpose(), 0.5 * (stretch + twist), 0.5 * (stretch - twist)


@ti.func
def stress_change(dF, U, V, A, p, q):
    """dP (d,d) [Pa] that goes with the change dF (d,d) of the deformation gradient."""
    G = U.transpose() @ dF @ V
    stretched = A @ ti.Vector([G[k, k] for k in ti.static(range(G.n))])
    return U @ (diagonal(stretched) + _paired(p) * G + _paired(q) * G.transpose()) @ V.transpose()


@ti.func
def stiffness_block(g_a, g_b, U, V, A, p, q):
    """K_ab / V (d,d) [Pa/m^2]: its entry ik is sum_jl dP_ij/dF_kl g_a[j] g_b[l], g (d,) the shape gradients [1/m]."""
    h_a, h_b = V.transpose() @ g_a, V.transpose() @ g_b
    block = A * h_a.outer_product(h_b) + _paired(q) * h_b.outer_product(h_a) + diagonal(_paired(p) @ (h_a * h_b))
    return U @ block @ U.transpose()


@ti.func
def _paired(values):
    """The symmetric matrix (d,d) with zeros on its diagonal and the value of each pair off it."""
    n, pairs = ti.static(2 if values.n == 1 else 3, values.n)
    # Taichi looks at both sides of a choice, so the index has to be valid on the diagonal as well.
    return ti.Matrix(
        [
            [values[(i + j - 1) % pairs] if ti.static(i != j) else 0.0 for j in ti.static(range(n))]
            for i in ti.static(range(n))
        ]
    )


@ti.func
def _quotient(rise, run, limit):
    """rise / run, or its limit where run is so small that the quotient is mostly round-off."""
    return ti.select(ti.abs(run) > ti.static(_close()), rise / run, limit)


@ti.func
def _scaled(M, factors):
    """M diag(factors): column k of M times factors[k]."""
    return M * ti.Matrix.rows([factors for _ in ti.static(range(M.n))])
