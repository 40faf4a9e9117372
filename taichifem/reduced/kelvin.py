"""Kelvin's solution (a point force in an infinite elastic body), and its integrals over triangles.

Brebbia, Telles & Wrobel, Boundary Element Techniques, 1984, sections 5.3 and 5.7: displacement and traction at y by a
unit force at x, r = |y - x|. Integrals are taken with linear shape functions phi_c over flat triangles: by Gauss
points far away, by finer and finer parts of the triangle nearby, and where x is a corner by Duffy's coordinates, in
which 1/r is cancelled by the area element.
"""

import numpy as np

from taichifem import runtime
from taichifem.runtime import ti

DUFFY = 8
"""Gauss points along each of Duffy's coordinates."""

FINEST = 8
"""Parts of a triangle's side at most, where x is near."""

_array = ti.types.ndarray

# Seven points of degree five on a triangle (Radon 1948): barycentric coordinates and weights.
_A, _B = (6 + np.sqrt(15)) / 21, (6 - np.sqrt(15)) / 21
_SEVEN = np.array(
    [[1 / 3, 1 / 3, 9 / 40]]
    + [[s, t, (155 + np.sqrt(15)) / 1200] for s, t in ((_A, _A), (1 - 2 * _A, _A), (_A, 1 - 2 * _A))]
    + [[s, t, (155 - np.sqrt(15)) / 1200] for s, t in ((_B, _B), (1 - 2 * _B, _B), (_B, 1 - 2 * _B))]
)


@ti.func
def displacement(r, mu, nu):
    """U (3,3) [m/N]: row by the direction of the force, column of the displacement, r = y - x."""
    d = r.norm()
    e = r / d
    return ((3 - 4 * nu) * ti.Matrix.identity(ti.f64, 3) + e.outer_product(e)) / (16 * np.pi * mu * (1 - nu) * d)


@ti.func
def traction(r, n, nu):
    """T (3,3) [1/m^2] on a surface with normal n at y."""
    d = r.norm()
    e = r / d
    slope, k = e.dot(n), 1 - 2 * nu
    along = slope * (k * ti.Matrix.identity(ti.f64, 3) + 3 * e.outer_product(e))
    return (k * (e.outer_product(n) - n.outer_product(e)) - along) / (8 * np.pi * (1 - nu) * d * d)


@ti.func
def _point(P: ti.template(), t, c):
    return ti.Vector([P[t, c, 0], P[t, c, 1], P[t, c, 2]])


@ti.kernel
def _integrate(
    X: _array(),
    own: _array(),
    P: _array(),
    seven: _array(),
    gauss: _array(),
    mu: ti.f64,
    nu: ti.f64,
    first: ti.i32,
    U: _array(),
    T: _array(),
):
    """U, T (rows,triangles,3 corners,3,3) for places X from `first` on; own (k,3): vertices of the triangles."""
    for row, t in ti.ndrange(U.shape[0], P.shape[0]):
        x = ti.Vector([X[first + row, 0], X[first + row, 1], X[first + row, 2]])
        a, b, c = _point(P, t, 0), _point(P, t, 1), _point(P, t, 2)
        double = (b - a).cross(c - a)
        area = double.norm()  # twice that of the triangle
        n = double / area
        total_u = ti.Matrix.zero(ti.f64, 9, 3)
        total_t = ti.Matrix.zero(ti.f64, 9, 3)
        corner = -1
        for k in range(3):
            if own[t, k] == first + row:
                corner = k
        if corner >= 0:
            for i, j in ti.ndrange(gauss.shape[0], gauss.shape[0]):
                u, v = gauss[i, 0], gauss[j, 0]
                phi = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
                for k in ti.static(range(3)):
                    if k == corner:
                        phi[k] = 1 - u
                    elif k == (corner + 1) % 3:
                        phi[k] = u * (1 - v)
                    else:
                        phi[k] = u * v
                r = phi[0] * a + phi[1] * b + phi[2] * c - x
                w = gauss[i, 1] * gauss[j, 1] * u * area
                uu, tt = displacement(r, mu, nu), traction(r, n, nu)
                for k in ti.static(range(3)):
                    for p, q in ti.static(ti.ndrange(3, 3)):
                        total_u[3 * k + p, q] += w * phi[k] * uu[p, q]
                        if k != corner:  # its own part is strongly singular: it comes from rigid motions
                            total_t[3 * k + p, q] += w * phi[k] * tt[p, q]
        else:
            size = ti.sqrt(ti.max((b - a).norm_sqr(), (c - b).norm_sqr(), (a - c).norm_sqr()))
            away = ti.max((x - (a + b + c) / 3).norm() - 0.58 * size, 0.05 * size)
            parts = ti.min(ti.max(ti.cast(ti.ceil(1.2 * size / away), ti.i32), 1), FINEST)
            for i, j in ti.ndrange(parts, parts):
                for half in range(2):
                    if (half == 0 and i + j < parts) or (half == 1 and i + j < parts - 1):
                        for g in range(seven.shape[0]):
                            s, v = seven[g, 0], seven[g, 1]
                            if half == 1:
                                s, v = 1 - s, 1 - v
                            s, v = (i + s) / parts, (j + v) / parts
                            phi = ti.Vector([1 - s - v, s, v])
                            r = phi[0] * a + phi[1] * b + phi[2] * c - x
                            w = seven[g, 2] * 0.5 * area / (parts * parts)
                            uu, tt = displacement(r, mu, nu), traction(r, n, nu)
                            for k in ti.static(range(3)):
                                for p, q in ti.static(ti.ndrange(3, 3)):
                                    total_u[3 * k + p, q] += w * phi[k] * uu[p, q]
                                    total_t[3 * k + p, q] += w * phi[k] * tt[p, q]
        for k in ti.static(range(3)):
            for p, q in ti.static(ti.ndrange(3, 3)):
                U[row, t, k, p, q] = total_u[3 * k + p, q]
                T[row, t, k, p, q] = total_t[3 * k + p, q]


def integrals(
    places: np.ndarray,
    points: np.ndarray,
    triangles: np.ndarray,
    *,
    mu: float,
    nu: float,
    first: int,
    rows: int,
    vertices: bool = True,
) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of U phi_c and T phi_c over each triangle, (rows,k,3,3,3) each, for places `first` to `first` + rows.

    places: (m,3) [m], the points themselves if `vertices`, else points off the surface.
    The part of T phi_c of a place's own corners is left out: it follows from rigid motions.
    """
    runtime.start()
    nodes, weights = np.polynomial.legendre.leggauss(DUFFY)
    gauss = np.column_stack([0.5 * (nodes + 1), 0.5 * weights])
    own = triangles if vertices else np.full_like(triangles, -1)
    U, T = np.zeros((2, rows, len(triangles), 3, 3, 3))
    with runtime.precision_of("f64"):
        _integrate(
            np.ascontiguousarray(places, dtype=np.float64),
            np.ascontiguousarray(own, dtype=np.int32),
            np.ascontiguousarray(points[triangles], dtype=np.float64),
            _SEVEN,
            gauss,
            mu,
            nu,
            first,
            U,
            T,
        )
    return U, T
