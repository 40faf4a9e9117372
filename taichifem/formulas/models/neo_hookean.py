"""Stable Neo-Hookean solid (Smith, de Goes & Kim 2018): defined, and smooth, for every F, inverted ones included.

psi = m/2 (I - 3) + b/2 (J - a)^2 - m/2 ln(I + 1) + const, with I = |F|^2 and J = det F. The parameters m, b and a
of the paper are chosen such that rest is free of stress and small strains obey Hooke's law with la and mu.
"""

from taichifem.formulas.eigen import diagonal
from taichifem.runtime import ti

EVEN = True


@ti.func
def _parameters(la, mu):
    """m and b [Pa], and a."""
    m, b = mu * 4 / 3, la + mu * 5 / 6
    return m, b, 1 + 0.75 * m / b


@ti.func
def _square(s):
    """I = |F|^2; in plane strain the third stretch is 1."""
    return s.norm_sqr() + ti.static(3 - s.n)


@ti.func
def _volume(s):
    """J, the product of the stretches."""
    return s[0] * s[1] * (s[s.n - 1] if ti.static(s.n == 3) else 1.0)


@ti.func
def _volume_slope(s):
    """(d,) dJ / ds_i: the product of the others."""
    n = ti.static(s.n)
    return ti.Vector([s[(i + 1) % n] * (s[(i + 2) % n] if ti.static(n == 3) else 1.0) for i in ti.static(range(n))])


@ti.func
def _volume_curvature(s):
    """(d,d) d2J / ds_i ds_j: the stretch of the axis that is neither i nor j."""
    n = ti.static(s.n)
    other = s if ti.static(n == 3) else 0 * s + 1
    return ti.Matrix(
        [
            [other[(2 * n - i - j) % n] if ti.static(i != j) else 0.0 for j in ti.static(range(n))]
            for i in ti.static(range(n))
        ]
    )


@ti.func
def energy(s, la, mu):
    """psi [J/m^3]."""
    m, b, a = _parameters(la, mu)
    square, excess = _square(s), _volume(s) - a
    return 0.5 * (m * (square - 3 - ti.log(0.25 * (square + 1))) + b * (excess * excess - (1 - a) ** 2))


@ti.func
def slope(s, la, mu):
    """(d,) first derivatives [Pa]."""
    m, b, a = _parameters(la, mu)
    return m * (1 - 1 / (_square(s) + 1)) * s + b * (_volume(s) - a) * _volume_slope(s)


@ti.func
def curvature(s, la, mu):
    """(d,d) second derivatives [Pa]."""
    m, b, a = _parameters(la, mu)
    share = 1 / (_square(s) + 1)
    J1 = _volume_slope(s)
    by_square = diagonal(0 * s + (1 - share)) + 2 * share * share * s.outer_product(s)
    by_volume = J1.outer_product(J1) + (_volume(s) - a) * _volume_curvature(s)
    return m * by_square + b * by_volume


@ti.func
def curvature_along(s, direction, la, mu):
    """(d,d) change of the curvature per length of `direction` (d,) [Pa]."""
    m, b, a = _parameters(la, mu)
    share = 1 / (_square(s) + 1)
    fall = 2 * share * share * s.dot(direction)  # of the share
    J1, J2 = _volume_slope(s), _volume_curvature(s)
    J3 = _volume_curvature(direction) if ti.static(s.n == 3) else 0 * J2  # J2 is linear in s in 3-D, constant in 2-D
    mixed, J_mixed = s.outer_product(direction), J1.outer_product(J2 @ direction)
    by_square = diagonal(0 * s + fall) - 4 * share * fall * s.outer_product(s)
    by_square += 2 * share * share * (mixed + mixed.transpose())
    by_volume = J_mixed + J_mixed.transpose() + J1.dot(direction) * J2 + (_volume(s) - a) * J3
    return m * by_square + b * by_volume
