"""Isotropic elastic laws, one small file each; a law is its energy as a function of the stretches.

A law is a module of four functions of the signed singular values s (d,) of F and the Lame parameters la, mu [Pa].
d is 3, or 2 for plane strain:

    energy(s, la, mu)                       psi, zero at rest [J/m^3]
    slope(s, la, mu)                        (d,)  d psi / d s_i [Pa]
    curvature(s, la, mu)                    (d,d) d2 psi / d s_i d s_j [Pa]
    curvature_along(s, direction, la, mu)   (d,d) sum_k direction_k d3 psi / d s_k d s_i d s_j [Pa]

and a constant EVEN: whether psi stays the same when two stretches change sign, as it does where it is a smooth
function of F. The last function serves `invertible` only. A new law needs its file and a line in MODELS.
"""

from taichifem.formulas.models import corotated, neo_hookean, stvk

MODELS = {"corotational": corotated, "stvk": stvk, "neo-hookean": neo_hookean}
"""The laws by the name a material gives."""
