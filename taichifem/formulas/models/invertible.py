"""Any law, continued below a threshold so that crushed and inverted elements push back ever harder.

Irving, Teran & Fedkiw 2004 make the stress linear below the threshold; continuing the energy instead keeps the
force its gradient (Stomakhin et al. 2012). With c = max(s, threshold) and d = s - c, stretch by stretch,

    psi(s) = psi(c) + slope(c) . d + k/2 |d|^2 + p(slope(c)) . g(d),   k = la + 2 mu,

the stiffness k of small strains taking the place of the law's own, which may have faded away there. The last term
concerns tension alone, which a law has there where the other stretches are large: drawn out linearly, it would give
energy without bound as they grow. So it fades away towards zero stretch: g(d) = d^2 / (2 threshold), going over to
-d - threshold/2 below zero, and p is the positive part of the slope, rounded over a width k. Energy and stress are
continuous, the curvature jumps at the threshold.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass

from taichifem.formulas.eigen import diagonal
from taichifem.runtime import ti


@dataclass(frozen=True, eq=False)
class Law:
    """The same functions as the module of a law has, but for the third derivatives."""

    energy: Callable
    slope: Callable
    curvature: Callable
    EVEN: bool = False


@ti.func
def _tension(slope, k):
    """The rounded positive part of a slope (d,), and its first and second derivative."""
    x = ti.max(slope, 0.0)
    within = 0 * x + 1 / k
    return (
        ti.select(x < k, 0.5 * x * x / k, x - 0.5 * k),
        ti.min(x / k, 1.0),
        ti.select(x > 0, ti.select(x < k, within, 0 * x), 0 * x),
    )


@ti.func
def _fading(d, threshold):
    """What takes tension away at the depth d (d,) below the threshold, and its first and second derivative."""
    return (
        ti.select(d > -threshold, 0.5 * d * d / threshold, -d - 0.5 * threshold),
        ti.max(d / threshold, -1.0),
        ti.select(d < 0, ti.select(d > -threshold, 0 * d + 1 / threshold, 0 * d), 0 * d),
    )


@functools.cache
def wrap(model, threshold: float = 0.3) -> Law:
    """The law `model` continued below the stretch `threshold`, between 0 and 1."""

    @ti.func
    def energy(s, la, mu):
        c = ti.max(s, threshold)
        d, k, own = s - c, la + 2 * mu, model.slope(c, la, mu)
        p, _, _ = _tension(own, k)
        g, _, _ = _fading(d, threshold)
        return model.energy(c, la, mu) + own.dot(d) + 0.5 * k * d.norm_sqr() + p.dot(g)

    @ti.func
    def slope(s, la, mu):
        c = ti.max(s, threshold)
        d, k, own = s - c, la + 2 * mu, model.slope(c, la, mu)
        p, p1, _ = _tension(own, k)
        g, g1, _ = _fading(d, threshold)
        bend = model.curvature(c, la, mu) @ (d + p1 * g)
        return own + k * d + p * g1 + ti.select(s > threshold, bend, 0 * d)

    @ti.func
    def curvature(s, la, mu):
        c = ti.max(s, threshold)
        d, k, C = s - c, la + 2 * mu, model.curvature(c, la, mu)
        p, p1, p2 = _tension(model.slope(c, la, mu), k)
        g, g1, g2 = _fading(d, threshold)
        # Above the threshold c moves with s; where both stretches are below, nothing of the law's own is left.
        above = ti.select(s > threshold, 0 * s + 1, 0 * s)
        below = 1 - above
        mixed = above.outer_product(below * p1 * g1)
        own = (1 - below.outer_product(below) + mixed + mixed.transpose()) * C
        change = model.curvature_along(c, d + p1 * g, la, mu) + C @ diagonal(p2 * g) @ C
        return own + above.outer_product(above) * change + diagonal(below * (k + p * g2))

    return Law(energy, slope, curvature)
