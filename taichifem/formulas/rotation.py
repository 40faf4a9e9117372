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
    one or two iterations then suffice). With S = R^T F, the ascent direction is the axial vector a of
    S - S^T and the Hessian is tr(S) I - sym(S) (Kugelstadt, Koschier & Bender 2018). Where that is not
    positive definite (crushed and inverted elements), the safe step a / (|tr S| + |S|) of Mueller et al. 2016
    is taken. Stops when the turn is below `tolerance` [rad] or after `most` iterations.
    """
    q = start
    left = most
    while left > 0:
        left -= 1
        S = rotation_of(q).transpose() @ F
        a = ti.Vector([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]])
        trace = S[0, 0] + S[1, 1] + S[2, 2]
        size = ti.sqrt(S.norm_sqr())
        h00, h11, h22 = trace - S[0, 0], trace - S[1, 1], trace - S[2, 2]
        h01, h02, h12 = (
            -0.5 * (S[0, 1] + S[1, 0]),
            -0.5 * (S[0, 2] + S[2, 0]),
            -0.5 * (S[1, 2] + S[2, 1]),
        )
        c00, c01, c02 = h11 * h22 - h12 * h12, h02 * h12 - h01 * h22, h01 * h12 - h02 * h11
        minor = h00 * h11 - h01 * h01
        det = h00 * c00 + h01 * c01 + h02 * c02
        turn = a / (ti.abs(trace) + size + 1e-30)
        if h00 > 0.05 * size and minor > 0.0025 * size * size and det > 1.25e-4 * size * size * size:
            c11, c12, c22 = h00 * h22 - h02 * h02, h01 * h02 - h00 * h12, minor
            newton = (
                ti.Vector(
                    [
                        c00 * a[0] + c01 * a[1] + c02 * a[2],
                        c01 * a[0] + c11 * a[1] + c12 * a[2],
                        c02 * a[0] + c12 * a[1] + c22 * a[2],
                    ]
                )
                / det
            )
            # Beyond half a radian the quadratic model says little: keep to the safe step.
            if newton.norm_sqr() < 0.25:
                turn = newton
        # Cayley map: the quaternion (1, turn / 2), normalised, turns by 2 atan(|turn| / 2).
        q = quaternion_product(q, ti.Vector([1.0, 0.5 * turn[0], 0.5 * turn[1], 0.5 * turn[2]])).normalized()
        if turn.norm_sqr() < tolerance * tolerance:
            left = 0
    return q
