"""St. Venant-Kirchhoff: psi = mu E:E + la/2 tr(E)^2 with Green's strain E = (F^T F - I) / 2.

It softens in compression: a bar pressed below 1/sqrt(3) of its length gives way.
"""

from taichifem.formulas.eigen import diagonal
from taichifem.runtime import ti

EVEN = True


@ti.func
def energy(s, la, mu):
    """psi [J/m^3]."""
    strain = 0.5 * (s * s - 1)
    return mu * strain.norm_sqr() + 0.5 * la * strain.sum() ** 2


@ti.func
def slope(s, la, mu):
    """(d,) first derivatives [Pa]: stretch times second Piola-Kirchhoff stress."""
    strain = 0.5 * (s * s - 1)
    return s * (2 * mu * strain + la * strain.sum())


@ti.func
def curvature(s, la, mu):
    """(d,d) second derivatives [Pa]."""
    strain = 0.5 * (s * s - 1)
    return la * s.outer_product(s) + diagonal(2 * mu * (strain + s * s) + la * strain.sum())


@ti.func
def curvature_along(s, direction, la, mu):
    """(d,d) change of the curvature per length of `direction` (d,) [Pa]."""
    mixed = direction.outer_product(s)
    return la * (mixed + mixed.transpose()) + diagonal(6 * mu * s * direction + la * s.dot(direction))
