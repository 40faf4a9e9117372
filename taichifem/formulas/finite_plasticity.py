"""Plastic flow at large strain: F = F_e F_p with det F_p = 1, for any isotropic law (Irving, Teran & Fedkiw 2004).

Written for the logarithms eps of the elastic stretches s and Kirchhoff's stresses tau_i = s_i dpsi/ds_i, which are
work-conjugate: what flows has the axes of F_e, is taken off eps, and has no trace, which keeps the volume (Simo &
Hughes, Computational Inelasticity, chapter 9). The laws are those of `plasticity`, with tau in place of sigma and eps
in place of e; creep takes from the part of eps without change of volume. As tau is not linear in eps, the return takes
a few iterations of Newton's method; its derivative gives the tangent.
"""

from taichifem.formulas.eigen import diagonal, epsilon
from taichifem.formulas.plasticity import CREEP, TRESCA, VON_MISES, creep_flow, ranks, without_mean
from taichifem.runtime import ti

CRUSHED = 0.3
"""Elements with an elastic stretch below this, inverted ones too, do not flow until they have pushed back: stress need
not grow with stretch there, and a return may find no end."""

ITERATIONS, LONGEST = 60, 0.1
"""Of a return; and how far a logarithm goes in one of them, at most."""


@ti.func
def kirchhoff(law: ti.template(), s, la, mu):
    """Stresses tau (3,) [Pa] at the stretches s (3,), and their derivatives (3,3) by the logarithms."""
    tau = s * law.slope(s, la, mu)
    return tau, diagonal(tau) + s.outer_product(s) * law.curvature(s, la, mu)


@ti.func
def _von_mises(law: ti.template(), trial, la, mu, limit, h):
    """Logarithms, growth of alpha and dtau/dtrial where sqrt(3/2) |dev tau| = limit + h growth."""
    eps, growth = trial, 0 * limit
    tau, T = kirchhoff(law, ti.exp(eps), la, mu)
    answer = T
    left = ITERATIONS
    if ti.sqrt(1.5 * without_mean(tau).norm_sqr()) <= limit:
        left = 0
    while left > 0:
        left -= 1
        shape = without_mean(tau)
        equivalent = ti.sqrt(1.5 * shape.norm_sqr())
        N, one = 1.5 * shape / equivalent, diagonal(0 * eps + 1)
        bend = (1.5 * (one - 1 / 3) - N.outer_product(N)) / equivalent
        off, f = eps - trial + growth * N, equivalent - limit - h * growth
        turned = (one + growth * bend @ T).inverse()
        row = turned.transpose() @ (T @ N)
        stiff = row.dot(N) + h
        more = (f - row.dot(off)) / stiff
        answer = T @ turned - (T @ (turned @ N)).outer_product(row) / stiff
        step = -(turned @ (off + more * N))
        size = ti.abs(step).max()
        part = ti.min(1.0, LONGEST / ti.max(size, 1e-30))
        eps += part * step
        growth = ti.max(growth + part * more, 0.0)
        tau, T = kirchhoff(law, ti.exp(eps), la, mu)
        if size < ti.static(8 * epsilon()):
            left = 0
    return eps, growth, answer


@ti.func
def _tresca(law: ti.template(), trial, la, mu, limit, h):
    """The same for tau_max - tau_min; what flows goes by the order that the stresses have at first."""
    tau, T = kirchhoff(law, ti.exp(trial), la, mu)
    top, middle, low = ranks(tau)
    a = top - low
    eps, growth, answer = trial, 0 * limit, T
    if a.dot(tau) > limit:
        # First to the face; if stresses change places there, to the corner with the next face; then to the other one.
        # A loop, as code is made once for what it holds.
        b, attempt, rises = a, 0, 0
        slack = ti.static(1e2 * epsilon()) * limit
        while attempt < 3:
            found, more, tangent, after, least = _along(law, trial, a, b, attempt, la, mu, limit, h)
            if attempt == 0 or least >= 0:
                eps, growth, answer = found, more, tangent
            attempt += 1
            high, mean = top.dot(after), middle.dot(after)
            if attempt == 1:
                rises = ti.cast(high < mean, ti.i32)
                if high >= mean - slack and mean >= low.dot(after) - slack:
                    attempt = 3
            elif least >= 0:
                attempt = 3
            b = top - middle
            if rises == ti.cast(attempt == 1, ti.i32):
                b = middle - low
    return eps, growth, answer


@ti.func
def _along(law: ti.template(), trial, a, b, corner: ti.i32, la, mu, limit, h):
    """Return along a, and at a corner b too, until a . tau = b . tau = limit + h growth.

    Gives logarithms, growth, dtau/dtrial, tau, and the lesser share of the two."""
    first, second = 0 * limit, 0 * limit
    tau, T = kirchhoff(law, ti.exp(trial), la, mu)
    answer = T
    left = ITERATIONS
    while left > 0:
        left -= 1
        over = limit + h * (first + second)
        Ta, Tb = T @ a, T @ b
        g, o, k = a.dot(Ta) + h, a.dot(Tb) + h, b.dot(Tb) + h
        f, f_b = a.dot(tau) - over, b.dot(tau) - over
        more, more_b = f / g, 0 * f
        answer = T - Ta.outer_product(Ta) / g
        if corner:
            det = g * k - o * o
            more, more_b = (k * f - o * f_b) / det, (g * f_b - o * f) / det
            mixed = Ta.outer_product(Tb)
            answer = T - (k * Ta.outer_product(Ta) + g * Tb.outer_product(Tb) - o * (mixed + mixed.transpose())) / det
        size = ti.max(ti.abs(more), ti.abs(more_b))
        part = ti.min(1.0, LONGEST / ti.max(size, 1e-30))
        first += part * more
        second += part * more_b
        tau, T = kirchhoff(law, ti.exp(trial - first * a - second * b), la, mu)
        if size < ti.static(8 * epsilon()):
            left = 0
    return trial - first * a - second * b, first + second, answer, tau, ti.min(first, second)


@ti.func
def returned(law: ti.template(), kind: ti.i32, trial, alpha, la, mu, limit, slope, rate, dt):
    """Logarithms (3,) of the elastic stretches that are left of `trial` after dt [s], growth of alpha, dtau/dtrial.

    Creep has no such derivative: it is done once a step, and T of what is left is given.
    """
    eps, growth, answer = trial, 0 * alpha, kirchhoff(law, ti.exp(trial), la, mu)[1]
    h = slope + rate / dt
    if kind == CREEP:
        flow, growth = creep_flow(without_mean(trial), limit, rate, dt)
        eps = trial - flow
        answer = kirchhoff(law, ti.exp(eps), la, mu)[1]
    elif kind == VON_MISES:
        eps, growth, answer = _von_mises(law, trial, la, mu, limit + slope * alpha, h)
    elif kind == TRESCA:
        eps, growth, answer = _tresca(law, trial, la, mu, limit + slope * alpha, h)
    # What flows has no trace, and round-off shall not give it one.
    return trial - without_mean(trial - eps), growth, answer
