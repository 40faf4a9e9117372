"""Rotations: quaternions (w, x, y, z) and the rotation nearest to a deformation gradient."""

from taichifem.runtime import ti


@ti.func
def quaternion_product(a, b):
    """Hamilton product a b: first turn by b, then by a."""
    return ti.Vector(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ]
    )


@ti.func
def rotation_of(q):
    """Rotation matrix (3,3) of the unit quaternion q."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return ti.Matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@ti.func
def nearest_rotation(F, start, tolerance, most: ti.i32):
    """Unit quaternion of the proper rotation R that maximises tr(R^T F): the polar factor, det R = +1 always.

    Newton's method on the rotation group, started from the quaternion `start` (the rotation of the last step:
    one or two iterations then suffice). With S = R^T F, the gradient is the axial vector a of S - S^T and the
    negative Hessian is H = tr(S) I - sym(S) (Kugelstadt, Koschier & Bender 2018). Along an axis n the objective is
    (n.H n) cos t / |n|^2 + (n.a) sin t / |n| + const, so the best angle t is known exactly and every turn ascends:
    tan t = |n| along Newton's n = H^-1 a. Where H is not positive definite (crushed and inverted elements), the
    gradient itself is the direction.

    Third derivatives of the objective vanish with its gradient, so that the error after a turn by t is of third order:
    t^3 / (3 c) at most, with c = det H / (tr H / 3)^3, which is 1 without strain, and much less where strain is small
    (20,000 random F; 0.006 t^3 at a strain of 6 %). Stops when that is below `tolerance` [rad], or after `most` turns.
    """
    q = start
    # The scale of F does not matter: taken out where products below could leave the range of numbers.
    scale = F.norm_sqr()
    if scale > 1e12 or scale < 1e-12:
        F = F / ti.max(F.norm(), 1e-30)
    left = most
    while left > 0:
        left -= 1
        S = rotation_of(q).transpose() @ F
        a = ti.Vector([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]])
        trace = S[0, 0] + S[1, 1] + S[2, 2]
        h00, h11, h22 = trace - S[0, 0], trace - S[1, 1], trace - S[2, 2]
        h01, h02, h12 = -0.5 * (S[0, 1] + S[1, 0]), -0.5 * (S[0, 2] + S[2, 0]), -0.5 * (S[1, 2] + S[2, 1])
        c00, c01, c02 = h11 * h22 - h12 * h12, h02 * h12 - h01 * h22, h01 * h12 - h02 * h11
        c11, c12, c22 = h00 * h22 - h02 * h02, h01 * h02 - h00 * h12, h00 * h11 - h01 * h01
        determinant = h00 * c00 + h01 * c01 + h02 * c02
        # The turn as a quaternion, whose size does not matter: (1 + cos t, sin t n / |n|), or a multiple.
        real, n = trace, a
        if h00 > 0 and c22 > 0 and determinant > 0:
            n = ti.Vector(
                [
                    c00 * a[0] + c01 * a[1] + c02 * a[2],
                    c01 * a[0] + c11 * a[1] + c12 * a[2],
                    c02 * a[0] + c12 * a[1] + c22 * a[2],
                ]
            )
            inverse, mean = 1 / determinant, 2.0 / 3.0 * trace
            n *= inverse
            square = n.norm_sqr()
            real = 1 + ti.sqrt(1 + square)
            lopsided = mean * mean * mean * inverse
            if square * square * square * lopsided * lopsided < 9 * tolerance * tolerance:
                left = 0
        else:
            square = a.norm_sqr()
            bend = h00 * a[0] * a[0] + h11 * a[1] * a[1] + h22 * a[2] * a[2]
            bend += 2 * (h01 * a[0] * a[1] + h02 * a[0] * a[2] + h12 * a[1] * a[2])
            # sin t = |a|^3 / size, cos t = bend / size: of the two forms of tan(t / 2), the one that does not cancel.
            size = ti.sqrt(square * square * square + bend * bend)
            real = (size + bend) / ti.max(square, 1e-30)
            if bend < 0:
                real = square * square / ti.max(size - bend, 1e-30)
        turned = quaternion_product(q, ti.Vector([real, n[0], n[1], n[2]]))
        length = turned.norm()
        if length > 0:
            q = turned / length
        else:
            left = 0
    return q


@ti.func
def nearest_rotation_2d(F):
    """The rotation (2,2) that maximises tr(R^T F), in closed form; the identity where every rotation does."""
    cosine, sine = F[0, 0] + F[1, 1], F[1, 0] - F[0, 1]
    size = ti.sqrt(cosine * cosine + sine * sine)
    cosine, sine = ti.select(size > 0, cosine / size, 1.0), ti.select(size > 0, sine / size, 0.0)
    return ti.Matrix([[cosine, -sine], [sine, cosine]])


@ti.func
def orthonormal(F):
    """The proper rotation (d,d) of F = R T with T upper triangular: Gram and Schmidt's, quick but not symmetric.

    It follows the element's first edge, so it depends on the order of the corners (Nesme, Payan & Faure 2005).
    Where a column vanishes or repeats another, an axis that stands across takes its place.
    """
    n = ti.static(F.n)
    columns = F.transpose()
    ahead = ti.Vector([1.0 if ti.static(k == 0) else 0.0 for k in ti.static(range(n))])
    first = _across(_row(columns, 0), 0 * ahead, ahead)
    if ti.static(n == 2):
        return ti.Matrix.cols([first, ti.Vector([-first[1], first[0]])])
    else:
        aside = ti.Vector([0.0, -first[2], first[1]])
        if ti.abs(first[0]) > 0.9:
            aside = ti.Vector([-first[2], 0.0, first[0]])
        second = _across(_row(columns, 1), first, aside.normalized())
        return ti.Matrix.cols([first, second, first.cross(second)])


@ti.func
def _row(M, k: ti.template()):
    return ti.Vector([M[k, j] for j in ti.static(range(M.m))])


@ti.func
def _across(v, axis, otherwise):
    """Unit vector along what v has across the unit vector `axis`; `otherwise` where that is nothing but round-off."""
    rest = v - v.dot(axis) * axis
    length = rest.norm()
    found = otherwise
    if length > 1e-5 * v.norm():
        rest /= length
        found = (rest - rest.dot(axis) * axis).normalized()
    return found
