"""Contact of nodes with rigid colliders: implicit normal springs and regularised Coulomb friction.

A node that ends the step inside a collider is pushed out by a spring along the normal, whose stiffness goes with
the node's own: about `STIFFNESS` times it, or times its inertia m / dt^2 where that is larger. Friction is a spring
too, from the place where the node began to stick, and slips when it passes mu times the normal force; its stretch
is kept from step to step, so that a body at rest on a slope stays there (Cundall & Strack 1979). Both are taken
at the end of the step, and which nodes touch is settled by solving again while that still changes.
"""

from taichifem.formulas import signed_distance
from taichifem.runtime import ti

STIFFNESS = 10.0
NONE, STICKS, SLIPS = 0, 1, 2


@ti.func
def _gap(w: ti.template(), c: ti.i32, position):
    """Signed distance [m] of a position to collider c at the end of the step, and the outward normal."""
    R = w.collider_rotation[c]
    p = R.transpose() @ (position - w.collider_center[c])
    distance, normal = signed_distance.to_half_space(p)
    if w.collider_kind[c] == signed_distance.SPHERE:
        distance, normal = signed_distance.to_sphere(p, w.collider_size[c][0])
    elif w.collider_kind[c] == signed_distance.BOX:
        distance, normal = signed_distance.to_box(p, 0.5 * w.collider_size[c])
    return distance, R @ normal


@ti.func
def _drift(w: ti.template(), c: ti.i32, position, velocity):
    """Velocity of a node relative to the collider's surface [m/s]."""
    surface = w.collider_velocity[c] + w.collider_spin[c].cross(position - w.collider_center[c])
    return velocity - surface


@ti.func
def _spring(w: ti.template(), i: ti.i32, dt):
    """Stiffness [N/m] of the contact springs of node i."""
    return ti.cast(STIFFNESS, w.real) * ti.max(w.contact_stiffness[i], w.mass[i] / (dt * dt))


@ti.func
def _state(w: ti.template(), c: ti.i32, i: ti.i32, dt, velocity):
    """Touching or not, normal force [N], normal, and stretch of the friction spring, at the end velocity."""
    position = w.x0[i] + dt * velocity
    distance, normal = _gap(w, c, position)
    state = NONE
    force = ti.cast(0.0, w.real)
    stretch = ti.Vector.zero(w.real, 3)
    if distance < 0:
        k = _spring(w, i, dt)
        force = -k * distance
        stretch = w.slip[c, i] + dt * _drift(w, c, position, velocity)
        stretch -= stretch.dot(normal) * normal
        state = SLIPS if k * stretch.norm() > w.collider_friction[c] * force else STICKS
    return state, force, normal, stretch


@ti.kernel
def touch(w: ti.template(), n: ti.i32, n_colliders: ti.i32, dt: ti.f64) -> ti.i32:
    """Add contact springs for the end velocity `w.v + w.dv` guessed so far; counts the contacts that changed."""
    changed = 0
    for i in range(n):
        step = ti.cast(dt, w.real)
        end = w.v[i] + w.dv[i]
        for c in range(n_colliders):
            state, force, normal, stretch = _state(w, c, i, step, end)
            if state != w.touching[c, i]:
                w.touching[c, i] = state
                changed += 1
            if state != NONE:
                k = _spring(w, i, step)
                # Where it slips, a spring as soft as gives the force mu N: it opposes the motion, and cannot
                # throw the node back.
                stretched = stretch.norm()
                side = k
                if state == SLIPS:
                    side = w.collider_friction[c] * force / stretched
                along = normal.outer_product(normal)
                stiffness = (k - side) * along + side * ti.Matrix.identity(w.real, 3)
                w.spring[i] += step * step * stiffness
                # Both forces are written for dv = 0: what `dv` adds to them stands in the matrix.
                w.spring_load[i] += step * (force * normal - side * stretch + step * (stiffness @ w.dv[i]))
    return changed


@ti.kernel
def slide(w: ti.template(), n: ti.i32, n_colliders: ti.i32, dt: ti.f64):
    """At the end of a step, keep the stretch of the friction springs, at most what friction can hold."""
    for i in range(n):
        step = ti.cast(dt, w.real)
        for c in range(n_colliders):
            state, force, _, stretch = _state(w, c, i, step, w.v[i])
            w.touching[c, i] = state
            if state == SLIPS:
                stretch *= w.collider_friction[c] * force / (_spring(w, i, step) * stretch.norm())
            w.slip[c, i] = stretch
