"""Contact of nodes with rigid colliders: implicit normal springs and regularised Coulomb friction.

A node that ends the step inside a collider is pushed out by a spring along the normal, `STIFFNESS` times as stiff as
the node itself: a soft body sinks in by a tenth of what it gives way. It need never be stiffer than what stops the
whole piece within a step, M / dt^2, nor softer than what stops the node, m / dt^2; without inertia neither counts.
Friction is a spring too, from the place where the node began to stick, and slips when it passes mu times the normal
force; its stretch is kept from step to step, so that a body at rest on a slope stays there (Cundall & Strack 1979).
Both are taken at the end of the step, and which nodes touch and slip is settled by solving again while the springs
that were solved with miss the forces that they led to, in the mean square: of many contacts, a few on the verge of
slipping hold nobody up. The normal forces that limit friction start from those of the last step and are renewed once
the contacts have settled; renewing them in every solve can run away, since friction itself tips weight from node to
node.
"""

from taichifem.formulas import collision
from taichifem.runtime import ti

STIFFNESS = 10.0
NONE, STICKS, SLIPS = 0, 1, 2


@ti.func
def gap(w: ti.template(), c: ti.i32, start, end):
    """How far [m] a point that moves from `start` to `end` ends outside of collider c, and the outward normal."""
    R = w.collider_rotation[c]
    p1 = R.transpose() @ (end - w.collider_center[c])
    gap, normal = collision.gap_to_half_space(p1)
    outward = ti.Vector([R[0, 2], R[1, 2], R[2, 2]])
    if w.collider_kind[c] != collision.PLANE:
        p0 = w.collider_rotation0[c].transpose() @ (start - w.collider_center0[c])
        if w.collider_kind[c] == collision.SPHERE:
            gap, normal = collision.gap_to_sphere(p0, p1, w.collider_size[c][0])
        else:
            gap, normal = collision.gap_to_box(p0, p1, 0.5 * w.collider_size[c])
        outward = R @ normal
    if ti.static(w.d == 2):
        # A planar body meets the section of the collider: across the plane nothing pushes.
        outward[1] = 0.0
        outward = outward.normalized(1e-12)
    return gap, outward


@ti.func
def stiffness(w: ti.template(), i: ti.i32, h):
    """Stiffness [N/m] of the contact springs of node i."""
    inertia = 1 / (h * h)
    own = w.contact_stiffness[i]
    if w.piece_mass[i] > 0:
        own = ti.max(ti.min(own, w.piece_mass[i] * inertia), w.mass[i] * inertia)
    return ti.cast(STIFFNESS, w.real) * own


@ti.func
def state_of(w: ti.template(), c: ti.i32, start, base, velocity, k, slip, pressed, h, dt):
    """Touching or not, normal force [N], normal, and stretch of the friction spring of a point, at its end velocity.

    Where nothing touches, the force is negative: a spring would pull with it.

    start: where it was.  base: from which h times the velocity leads to the end.  k: stiffness of its springs [N/m].
    slip, pressed: stretch and normal force of the friction spring so far.
    """
    position = base + h * velocity
    distance, normal = gap(w, c, start, position)
    state = NONE
    force = -k * distance
    stretch = ti.Vector.zero(w.real, 3)
    if distance < 0:
        surface = w.collider_velocity[c] + w.collider_spin[c].cross(position - w.collider_center[c])
        stretch = slip + ((base - start) + h * velocity - dt * surface)
        if ti.static(w.d == 2):
            stretch[1] = 0.0
        stretch -= stretch.dot(normal) * normal
        state = SLIPS if k * stretch.norm() > w.collider_friction[c] * pressed else STICKS
    return state, force, normal, stretch


@ti.func
def springs_of(w: ti.template(), c: ti.i32, state, normal, stretch, k, pressed):
    """Stiffness (3,3) of both springs of a point that touches, and that of the friction spring alone [N/m]."""
    # Where it slips, a spring as soft as gives the force mu N: it opposes the motion, and cannot
    # throw the point back. With N held fixed these springs majorise the friction potential, which is
    # convex, so solving again descends.
    side = k
    if state == SLIPS:
        side = w.collider_friction[c] * pressed / stretch.norm()
    springs = (k - side) * normal.outer_product(normal) + side * ti.Matrix.identity(w.real, 3)
    if ti.static(w.d == 2):
        springs[1, 1] = 0.0
    return springs, side


@ti.func
def wrong_by(w: ti.template(), c: ti.i32, was, state, force, stretch, side, grip, pressed):
    """By how much [N] the springs that the step was solved with miss the forces at the velocity that this gave.

    was, grip: touching or not, and stiffness of the friction spring, in those springs.  side: as it should be.
    """
    wrong = ti.abs(side - grip) * stretch.norm()
    if was == NONE and state == NONE:
        wrong = 0.0
    elif state == NONE:
        wrong = -force + w.collider_friction[c] * pressed
    elif was == NONE:
        wrong = force + side * stretch.norm()
    return wrong


@ti.func
def excess(w: ti.template(), wrong, force, mass, weight: ti.f64, share: ti.f64):
    """Square of the relative error of a contact's force, less that of `share`, in millionths.

    Relative to the normal force and to the mass times `weight` [m/s^2]. Of all contacts together it is positive where
    their errors are larger in the mean square. Whole numbers: then sums do not depend on the order.
    """
    size = ti.cast(ti.max(force, 0.0), ti.f64) + ti.cast(mass, ti.f64) * weight
    relative = ti.cast(wrong, ti.f64) / ti.max(size, 1e-30)
    return ti.cast(1e6 * (ti.min(relative * relative, 1e4) - share * share), ti.i64)


@ti.func
def _state(w: ti.template(), c: ti.i32, i: ti.i32, h, dt, velocity):
    """The same of a node; none where an embedded surface touches in its place."""
    k = stiffness(w, i, h)
    state, force, normal, stretch = state_of(
        w, c, w.x0[i], w.base_x[i], velocity, k, w.slip[c, i], w.pressed[c, i], h, dt
    )
    if w.shielded[i]:
        state = NONE
        force = 0.0
        stretch = ti.Vector.zero(w.real, 3)
    return state, force, normal, stretch


@ti.kernel
def touch(
    w: ti.template(), n: ti.i32, n_colliders: ti.i32, h: ti.f64, dt: ti.f64, weight: ti.f64, share: ti.f64
) -> ti.i64:
    """Set `w.spring` and `w.spring_load` to those of contact, for the end velocity `w.v + w.dv` guessed so far; h is
    that of `integrators.implicit`.

    Returns the `excess` of the errors that those of the last call had, as contacts opened, closed or slipped since.
    """
    total = ti.cast(0, ti.i64)
    ti.loop_config(serialize=ti.static(w.alone(100)))
    for i in range(n):
        step, whole = ti.cast(h, w.real), ti.cast(dt, w.real)
        end = w.v[i] + w.dv[i]
        spring, load, sprung = ti.Matrix.zero(w.real, 3, 3), ti.Vector.zero(w.real, 3), 0
        for c in range(n_colliders):
            was = w.touching[c, i]
            # Most nodes are far from everything: only how far is worked out for them.
            near = w.shielded[i] == 0 and gap(w, c, w.x0[i], w.base_x[i] + step * end)[0] < 0
            if was != NONE or near:
                state, force, normal, stretch = _state(w, c, i, step, whole, end)
                k, pressed = stiffness(w, i, step), w.pressed[c, i]
                springs, side = ti.Matrix.zero(w.real, 3, 3), ti.cast(0.0, w.real)
                if state != NONE:
                    springs, side = springs_of(w, c, state, normal, stretch, k, pressed)
                    sprung = 1
                    spring += step * step * springs
                    # Both forces are written for dv = 0: what `dv` adds to them stands in the matrix.
                    load += step * (force * normal - side * stretch + step * (springs @ w.dv[i]))
                wrong = wrong_by(w, c, was, state, force, stretch, side, w.grip[c, i], pressed)
                total += excess(w, wrong, force, w.mass[i], weight, share)
                w.touching[c, i], w.grip[c, i] = state, side
        if sprung == 1 or w.sprung[i] == 1:
            w.spring[i], w.spring_load[i], w.sprung[i] = spring, load, sprung
    return total


@ti.kernel
def press(
    w: ti.template(), n: ti.i32, n_colliders: ti.i32, h: ti.f64, dt: ti.f64, weight: ti.f64, share: ti.f64
) -> ti.i64:
    """Set the normal forces that limit friction from the end velocity `w.v + w.dv`.

    Returns the `excess` of what they were wrong by.
    """
    total = ti.cast(0, ti.i64)
    ti.loop_config(serialize=ti.static(w.alone(60)))
    for i in range(n):
        step, whole = ti.cast(h, w.real), ti.cast(dt, w.real)
        for c in range(n_colliders):
            force = ti.max(_state(w, c, i, step, whole, w.v[i] + w.dv[i])[1], 0.0)
            if force > 0 or w.pressed[c, i] > 0:
                total += excess(w, ti.abs(force - w.pressed[c, i]), force, w.mass[i], weight, share)
            w.pressed[c, i] = force
    return total


@ti.kernel
def slide(w: ti.template(), n: ti.i32, n_colliders: ti.i32, h: ti.f64, dt: ti.f64):
    """At the end of a step, keep the stretch of the friction springs, at most what friction can hold."""
    ti.loop_config(serialize=ti.static(w.alone(80)))
    for i in range(n):
        step, whole = ti.cast(h, w.real), ti.cast(dt, w.real)
        for c in range(n_colliders):
            state, force, _, stretch = _state(w, c, i, step, whole, w.v[i])
            force = ti.max(force, 0.0)
            most = w.collider_friction[c] * force
            held = stiffness(w, i, step) * stretch.norm()
            if held > most:
                stretch *= most / held
            w.touching[c, i] = state
            w.pressed[c, i] = force
            w.slip[c, i] = stretch
