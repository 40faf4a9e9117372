"""Eigenvalues of small symmetric matrices, and the signed singular values of a deformation gradient."""

from taichifem.runtime import impl, ti

TURNS = 30
"""A bound only: convergence is quadratic, and some twelve turns reach round-off."""

TINY = 1e-30
"""Keeps 0 / 0 from being formed; a normal number in single precision too."""


def epsilon() -> float:
    """Spacing of the reals next to 1 in the precision that kernels are being compiled for."""
    return 2.0**-52 if impl.get_runtime().default_fp == ti.f64 else 2.0**-23


@ti.func
def diagonal(values):
    """The matrix (d,d) with `values` (d,) on its diagonal. Made in one piece: entries set later compile slowly."""
    return ti.Matrix(
        [
            [values[i] if ti.static(i == j) else 0.0 for j in ti.static(range(values.n))]
            for i in ti.static(range(values.n))
        ]
    )


@ti.func
def _turn(a, b, off):
    """Tangent, cosine and sine of the smaller of the angles that make [[a, off], [off, b]] diagonal."""
    gap, twice = b - a, 2 * off
    t = ti.select(gap >= 0, twice, -twice) / ti.max(ti.abs(gap) + ti.sqrt(gap * gap + twice * twice), TINY)
    cosine = 1 / ti.sqrt(1 + t * t)
    return t, cosine, t * cosine


@ti.func
def symmetric_eigen(S):
    """Eigenvalues (d,), in no order, and a proper rotation Q (d,d) with S = Q diag(eigenvalues) Q^T; d is 2 or 3.

    Jacobi's method (Golub & Van Loan, Matrix Computations, 8.5): exact to round-off of the largest entry, also where
    eigenvalues coincide, since it never divides by their difference. In three dimensions every turn is about the
    last axis, after which the axes change places in a circle: a third of the code to compile.
    """
    if ti.static(S.n == 2):
        t, cosine, sine = _turn(S[0, 0], S[1, 1], S[0, 1])
        return ti.Vector([S[0, 0] - t * S[0, 1], S[1, 1] + t * S[0, 1]]), ti.Matrix([[cosine, sine], [-sine, cosine]])
    else:
        values = ti.Vector([S[0, 0], S[1, 1], S[2, 2]])
        off = ti.Vector([S[1, 2], S[2, 0], S[0, 1]])
        x, y, z = ti.Vector([1.0, 0.0, 0.0]), ti.Vector([0.0, 1.0, 0.0]), ti.Vector([0.0, 0.0, 1.0])
        left = TURNS
        while left > 0 and ti.abs(off).sum() > ti.static(0.1 * epsilon()) * ti.abs(values).sum():
            left -= 1
            t, cosine, sine = _turn(values[0], values[1], off[2])
            values = ti.Vector([values[1] + t * off[2], values[2], values[0] - t * off[2]])
            off = ti.Vector([cosine * off[1] - sine * off[0], 0.0, cosine * off[0] + sine * off[1]])
            turned = cosine * x - sine * y
            x = cosine * y + sine * x
            y = z
            z = turned
        return values, ti.Matrix.cols([x, y, z])


@ti.func
def signed_svd(F, R):
    """U (d,d), s (d,) and V (d,d) with F = U diag(s) V^T, both rotations proper, given R, the rotation nearest to F.

    The product of s has the sign of det F: the smallest stretch of an inverted element is negative, and no two
    stretches have a negative sum (Irving, Teran & Fedkiw 2004). s is in no order.
    """
    S = R.transpose() @ F
    s, V = symmetric_eigen(0.5 * (S + S.transpose()))
    return R @ V, s, V
