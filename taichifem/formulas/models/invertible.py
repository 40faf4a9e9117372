"""Any law, continued below a threshold so that crushed and inverted elements push back ever harder.

Irving, Teran & Fedkiw 2004 make the stress linear below the threshold; continuing the energy instead keeps the
force its gradient (Stomakhin et al. 2012). With c = max(s, threshold) and d = s - c, stretch by stretch,

    psi(s) = psi(c) + slope(c) . d + k/2 |d|^2,   k = la + 2 mu,

the stiffness k of small strains taking the place of the law's own, which may have faded away there. Energy and
stress are continuous, the curvature jumps at the threshold. Over the stable neo-Hookean law, whose tension grows with
the square of the other stretches, the energy is not bounded below where those are large and the third is negative:
what is scrambled to many times its size comes back with the other laws only.
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


@functools.cache
def wrap(model, threshold: float = 0.3) -> Law:
    """The law `model` continued below the stretch `threshold`, between 0 and 1."""

    @ti.func
    def energy(s, la, mu):
        c = ti.max(s, threshold)
        d = s - c
        return model.energy(c, la, mu) + model.slope(c, la, mu).dot(d) + (0.5 * la + mu) * d.norm_sqr()

    @ti.func
    def slope(s, la, mu):
        c = ti.max(s, threshold)
        d = s - c
        bend = model.curvature(c, la, mu) @ d
        return model.slope(c, la, mu) + (la + 2 * mu) * d + ti.select(s > threshold, bend, 0 * d)

    @ti.func
    def curvature(s, la, mu):
        c = ti.max(s, threshold)
        # Above the threshold c moves with s; where both stretches are below, nothing of the law's own is left.
        above = ti.select(s > threshold, 0 * s + 1, 0 * s)
        below = 1 - above
        own = (1 - below.outer_product(below)) * model.curvature(c, la, mu)
        change = above.outer_product(above) * model.curvature_along(c, s - c, la, mu)
        return own + change + diagonal((la + 2 * mu) * below)

    return Law(energy, slope, curvature)
