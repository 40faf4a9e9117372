"""The translation of each free body as a one-step coarse space: linear momentum then balances exactly.

K times a uniform motion is zero, so for a body that nothing pins, the best uniform correction c solves
sum(m + springs) c = sum(residual). Afterwards the residual sums to zero over the body: whatever tolerance
the solver stopped at, the impulses on the body are those of the outside world alone.
"""

from taichifem.runtime import ti


@ti.kernel
def balance(w: ti.template(), n_bodies: ti.i32, mass_factor: ti.f64, drag_factor: ti.f64):
    """Add the uniform correction of every body that flies to `w.dv`, and take it out of `w.residual`."""
    for body in range(n_bodies):
        if w.body_flies[body] > 0:
            total, inertia = ti.Vector.zero(ti.f64, 3), ti.Matrix.zero(ti.f64, 3, 3)
            for i in range(w.body_start[body], w.body_start[body + 1]):
                total += ti.cast(w.residual[i], ti.f64)
                inertia += ti.cast(w.spring[i], ti.f64)
                m = mass_factor * ti.cast(w.mass[i], ti.f64) + drag_factor * ti.cast(w.drag[i], ti.f64)
                for k in ti.static(range(3)):
                    inertia[k, k] += m
            c = inertia.inverse() @ total
            for i in range(w.body_start[body], w.body_start[body + 1]):
                m = mass_factor * ti.cast(w.mass[i], ti.f64) + drag_factor * ti.cast(w.drag[i], ti.f64)
                w.dv[i] += ti.cast(c, w.real)
                w.residual[i] -= ti.cast(ti.cast(w.spring[i], ti.f64) @ c + m * c, w.real)
