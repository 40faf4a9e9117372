"""Pins, prescribed motions and handles."""

from taichifem.runtime import ti


@ti.kernel
def hold(w: ti.template(), n: ti.i32, n_held: ti.i32, dt: ti.f64):
    """Free every axis, then hold the pinned ones: their `w.dv` takes them to the pose at the end of the step."""
    for i in range(n):
        w.free[i] = ti.Vector.one(w.real, 3)
    ti.loop_config(serialize=True)
    for k in range(n_held):
        i = w.held_node[k]
        pose = w.held_pose[k]
        target = w.pose_rotation[pose] @ w.rest[i] + w.pose_offset[pose]
        dv = (target - w.x0[i]) / ti.cast(dt, w.real) - w.v[i]
        for a in ti.static(range(3)):
            if w.held_axes[k][a] > 0:
                w.free[i][a] = 0.0
                w.dv[i][a] = dv[a]


@ti.kernel
def pull(w: ti.template(), n_pulled: ti.i32, dt: ti.f64):
    """Add the implicit springs of the handles to `w.spring` and `w.spring_load`.

    With stiffness k, the force at the end of the step is k (target - x0 - dt (v + dv)).
    """
    ti.loop_config(serialize=True)
    for p in range(n_pulled):
        i = w.pulled_node[p]
        pose = w.pulled_pose[p]
        k = w.pulled_stiffness[p]
        step = ti.cast(dt, w.real)
        target = w.pose_rotation[pose] @ w.rest[i] + w.pose_offset[pose]
        w.sprung[i] = 1
        w.spring_load[i] += step * k * (target - w.x0[i] - step * w.v[i])
        for a in ti.static(range(3)):
            w.spring[i][a, a] += step * step * k


@ti.kernel
def clear_springs(w: ti.template(), n: ti.i32):
    """Forget the springs of the last step."""
    for i in range(n):
        w.spring[i] = ti.Matrix.zero(w.real, 3, 3)
        w.spring_load[i] = ti.Vector.zero(w.real, 3)
        w.sprung[i] = 0
