"""Corotated linear elasticity: psi = mu |F - R|^2 + la/2 tr(R^T F - I)^2 (Mueller & Gross 2004).

It is Hooke's law in the frame of R, the proper rotation nearest to F. R jumps where two stretches cancel.
"""

from taichifem.formulas.eigen import diagonal
from taichifem.runtime import ti

EVEN = False


@ti.func
def energy(s, la, mu):
    """mu |s - 1|^2 + la/2 (sum (s - 1))^2 [J/m^3]."""
    strain = s - 1
    return mu * strain.norm_sqr() + 0.5 * la * strain.sum() ** 2


@ti.func
def slope(s, la, mu):
    """(d,) first derivatives [Pa]."""
    strain = s - 1
    return 2 * mu * strain + la * strain.sum()


@ti.func
def curvature(s, la, mu):
    """(d,d) second derivatives [Pa]; they are constant."""
    return diagonal(0 * s + 2 * mu) + la


@ti.func
def curvature_along(s, direction, la, mu):
    """(d,d) change of the curvature: none."""
    return 0 * s.outer_product(direction)
