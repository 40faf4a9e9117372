"""The rigid motion of each free body as a one-step coarse space: momentum then balances, whatever the tolerance.

K times a uniform motion is zero, so for a body that nothing pins the best uniform correction c of dv solves
sum(M + springs) c = sum(residual), and linear momentum changes by the impulses of the outside world alone.
A spin is free of strain only where the body is little deformed; there, what a solver leaves of the large elastic
forces of a stiff body would spin it up. So the spin that balances the torque is a direction only, and how far to go
along it takes one product with the matrix.
"""

from taichifem.linear_algebra import matrix, steps
from taichifem.runtime import ti

HELD, TURNS, LINEAR = 0, 1, 2
"""What `World.body_flies` says of a body: something pins it; it flies; it flies and all of it is linear, so that
its spins are those about the rest shape."""


@ti.func
def _cross(r):
    """The matrix [r] with [r] a = r x a."""
    return ti.Matrix([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


@ti.func
def _inertia(w: ti.template(), i: ti.i32, drag_factor):
    """Mass and springs of node i, (3,3), in double precision."""
    block = ti.cast(w.spring[i], ti.f64)
    m = ti.cast(w.mass[i], ti.f64) + drag_factor * ti.cast(w.drag[i], ti.f64)
    for k in ti.static(range(3)):
        block[k, k] += m
    return block


@ti.kernel
def translate(w: ti.template(), n_bodies: ti.i32, drag_factor: ti.f64):
    """Add the uniform correction of every body that flies to `w.dv`, and take it out of `w.residual`."""
    for body in range(n_bodies):
        if w.body_flies[body] > 0:
            total, inertia = ti.Vector.zero(ti.f64, 3), ti.Matrix.zero(ti.f64, 3, 3)
            for i in range(w.body_start[body], w.body_start[body + 1]):
                total += ti.cast(w.residual[i], ti.f64)
                inertia += _inertia(w, i, drag_factor)
            c = inertia.inverse() @ total
            for i in range(w.body_start[body], w.body_start[body + 1]):
                w.dv[i] = w.dv[i] + ti.cast(c, w.real)
                w.residual[i] = w.residual[i] - ti.cast(_inertia(w, i, drag_factor) @ c, w.real)


@ti.func
def _place(w: ti.template(), body: ti.i32, i: ti.i32):
    """Where node i stands for the spins of its body."""
    return ti.cast(w.rest[i] if w.body_flies[body] == LINEAR else w.x[i], ti.f64)


@ti.func
def _spin_direction(w: ti.template(), body: ti.i32, drag_factor):
    """Write to `w.direction` the rigid motion that would balance the torque on a body and keep its momentum."""
    begin, end = w.body_start[body], w.body_start[body + 1]
    centre = ti.Vector.zero(ti.f64, 3)
    for i in range(begin, end):
        centre += _place(w, body, i)
    centre /= end - begin
    torque = ti.Vector.zero(ti.f64, 3)
    a, b, c = ti.Matrix.zero(ti.f64, 3, 3), ti.Matrix.zero(ti.f64, 3, 3), ti.Matrix.zero(ti.f64, 3, 3)
    for i in range(begin, end):
        r = _place(w, body, i) - centre
        torque += r.cross(ti.cast(w.residual[i], ti.f64))
        inertia = _inertia(w, i, drag_factor)
        arm = -_cross(r)  # velocity of a spin s about the centre: s x r = arm s
        a += inertia
        b += inertia @ arm
        c += arm.transpose() @ inertia @ arm
    coupled = a.inverse() @ b
    spin = (c - b.transpose() @ coupled).inverse() @ torque
    shift = -(coupled @ spin)
    for i in range(begin, end):
        w.direction[i] = ti.cast(shift + spin.cross(_place(w, body, i) - centre), w.real)


@ti.kernel
def spin(w: ti.template(), n: ti.i32, pieces: ti.i32, n_bodies: ti.i32, drag_factor: ti.f64):
    """After `translate`: turn every body that flies as far as makes its residual smallest; spends the residual."""
    for body in range(n_bodies):
        if w.body_flies[body] != HELD:
            _spin_direction(w, body, drag_factor)
        else:
            for i in range(w.body_start[body], w.body_start[body + 1]):
                w.direction[i] = ti.Vector.zero(w.real, 3)
    ti.loop_config(block_dim=1)
    for c in range(pieces):
        begin, end = steps.range_of(n, c, pieces)
        matrix.multiply(w, w.direction, w.product, begin, end)
    for body in range(n_bodies):
        if w.body_flies[body] > 0:
            slope, curvature = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
            for i in range(w.body_start[body], w.body_start[body + 1]):
                slope += ti.cast(w.direction[i].dot(w.residual[i]), ti.f64)
                curvature += ti.cast(w.direction[i].dot(w.product[i]), ti.f64)
            if curvature > 0:
                for i in range(w.body_start[body], w.body_start[body + 1]):
                    w.dv[i] = w.dv[i] + ti.cast(slope / curvature, w.real) * w.direction[i]
