"""Plastic laws for small strain: how much of an elastic strain stays when the load is gone.

    creep       of a strain larger than `limit` goes min(1, rate dt) (slides 30 to 33, with a norm that does not depend
                on the axes); the whole stays below `slope`
    von-mises   radial return to sqrt(3/2) |dev sigma| = Y + H alpha (Simo & Hughes, Computational Inelasticity, 3.3)
    tresca      return to sigma_max - sigma_min = Y + H alpha (de Souza Neto, Peric & Owen, 8.1), corners treated

The accumulated plastic strain alpha is that of uniaxial tension. A viscosity [Pa s] lets the stress overshoot the
yield stress by viscosity times the rate of alpha (Perzyna). The flow has the axes of the elastic strain e, so that
principal values are enough to tell stress and tangent; where only the flow is wanted, creep and von Mises do without
axes.
"""

from taichifem.formulas.eigen import diagonal
from taichifem.runtime import ti

NONE, CREEP, VON_MISES, TRESCA = range(4)
"""Kinds of laws."""


@ti.func
def creep_flow(e, limit, rate, dt):
    """Flow and growth of alpha; e: elastic strain, as a matrix (3,3) or by principal values (3,)."""
    size, share = e.norm(), 0.0 * limit
    if size > limit:
        share = ti.min(1.0, rate * dt)
    return share * e, ti.sqrt(2 / 3) * share * size


@ti.func
def creep_bound(plastic, most):
    """Plastic strain of Frobenius norm `most` at most."""
    size = plastic.norm()
    return plastic * (most / size if size > most else 1.0)


@ti.func
def von_mises_share(size, alpha, mu, limit, slope, viscosity, dt):
    """Part of the deviator that flows, and growth of alpha; size: |dev e|."""
    equivalent = ti.sqrt(6.0) * mu * size
    excess = equivalent - limit - slope * alpha
    share, growth = 0.0 * excess, 0.0 * excess
    if excess > 0:
        growth = excess / (3 * mu + slope + viscosity / dt)
        share = 3 * mu * growth / equivalent
    return share, growth


@ti.func
def deviator(e):
    """The matrix e (3,3) without its mean."""
    mean = e.trace() / 3
    return e - diagonal(ti.Vector([mean, mean, mean]))


@ti.func
def without_mean(values):
    """Principal values (3,) of the deviator."""
    return values - values.sum() / 3


@ti.func
def ranks(e):
    """Where the largest, the middle and the smallest of three values stand: three unit vectors."""
    x, y, z = e[0], e[1], e[2]
    top, low = ti.Vector([0.0, 0.0, 1.0]), ti.Vector([0.0, 0.0, 1.0])
    if x >= y and x >= z:
        top = ti.Vector([1.0, 0.0, 0.0])
    elif y >= z:
        top = ti.Vector([0.0, 1.0, 0.0])
    if x < y and x < z:
        low = ti.Vector([1.0, 0.0, 0.0])
    elif y < z:
        low = ti.Vector([0.0, 1.0, 0.0])
    return top, 1 - top - low, low


@ti.func
def _tresca(e, alpha, mu, limit, slope, viscosity, dt):
    """The two directions a, b that flow, and how far each goes; of one alone the second goes 0.

    They are (1, 0, -1) in the order of the stresses, and at a corner (1, -1, 0) or (0, 1, -1) too; else b is a.
    """
    top, middle, low = ranks(e)
    high, mean, least = e.dot(top), e.dot(middle), e.dot(low)
    h = slope + viscosity / dt
    yield_now = limit + slope * alpha
    a, b = top - low, top - low
    first, second = 0.0 * high, 0.0 * high
    excess = 2 * mu * (high - least) - yield_now
    if excess > 0:
        first = excess / (4 * mu + h)
        if high - first < mean or mean < least + first:
            other = 2 * mu * (high - mean) - yield_now
            b = top - middle
            if high + least < 2 * mean:
                other = 2 * mu * (mean - least) - yield_now
                b = middle - low
            total, gap = (excess + other) / (6 * mu + 2 * h), (excess - other) / (2 * mu)
            first, second = 0.5 * (total + gap), 0.5 * (total - gap)
    return a, b, first, second


@ti.func
def tresca_flow(e, alpha, mu, limit, slope, viscosity, dt):
    """Flow (3,) along the axes of the principal elastic strains e (3,) in dt [s], and the growth of alpha."""
    a, b, first, second = _tresca(e, alpha, mu, limit, slope, viscosity, dt)
    return first * a + second * b, first + second


@ti.func
def spring_flow(kind: ti.i32, length, rest, first_rest, alpha, youngs, limit, pressed, slope, rate, dt):
    """Growth of the rest length [m] of a spring of that length in dt [s], and of its accumulated plastic strain.

    first_rest: the rest length before anything flowed.  limit, pressed: yield stress in tension and in pressure [Pa],
    or for creep the strains beyond which the rest length follows (Clavet, Beaudoin & Poulin 2005); `slope` then bounds
    the plastic strain.
    """
    moved = 0.0 * length
    if kind == CREEP:
        share = ti.min(1.0, rate * dt)
        moved = share * (ti.max(length - rest * (1 + limit), 0.0) + ti.min(length - rest * (1 - pressed), 0.0))
        moved = ti.min(ti.max(rest + moved, first_rest * (1 - slope)), first_rest * (1 + slope)) - rest
    elif kind != NONE:
        stress = youngs * (length - rest) / first_rest
        stiff = youngs + slope + rate / dt
        over, under = stress - limit - slope * alpha, stress + pressed + slope * alpha
        moved = first_rest * (ti.max(over, 0.0) + ti.min(under, 0.0)) / stiff
    return moved, ti.abs(moved) / first_rest


@ti.func
def response(kind: ti.i32, e, alpha, la, mu, limit, slope, rate, dt):
    """Principal stresses (3,) [Pa] at the end of dt [s], and their derivatives (3,3) by the strains e (3,) before it.

    Creep has no part in this: the slides do it once a step.
    """
    stress, A = 2 * mu * e + la * e.sum(), diagonal(0 * e + 2 * mu) + la
    h = slope + rate / dt
    if kind == VON_MISES:
        shape = without_mean(e)
        size = shape.norm()
        share, growth = von_mises_share(size, alpha, mu, limit, slope, rate, dt)
        if growth > 0:
            n = shape / size
            stress -= 2 * mu * share * shape
            A -= 2 * mu * (share * (diagonal(0 * e + 1) - 1 / 3) + (3 * mu / (3 * mu + h) - share) * n.outer_product(n))
    elif kind == TRESCA:
        a, b, first, second = _tresca(e, alpha, mu, limit, slope, rate, dt)
        stress -= 2 * mu * (first * a + second * b)
        if first > 0 and (a - b).norm_sqr() > 0:
            g, o = 4 * mu + h, 2 * mu + h
            mixed = a.outer_product(b)
            own = g * (a.outer_product(a) + b.outer_product(b)) - o * (mixed + mixed.transpose())
            A -= (2 * mu / (6 * mu + 2 * h)) * own
        elif first > 0:
            A -= (4 * mu * mu / (4 * mu + h)) * a.outer_product(a)
    return stress, A
