"""Pins, prescribed motions and handles."""

from taichifem.elements import AXES
from taichifem.runtime import ti


@ti.kernel
def hold(w: ti.template(), n: ti.i32, n_held: ti.i32, dt: ti.f64, h: ti.f64):
    """Free every axis, then hold the pinned ones: their `w.dv` takes them to the pose at the end of the step.

    They get the mean velocity of the step, and a base from which `h` times that leads there: a method that goes on
    from past velocities would let them swing about their path. Planar bodies are held in their plane.
    """
    ti.loop_config(serialize=ti.static(w.alone(5)))
    for i in range(n):
        w.free[i] = ti.Vector.one(w.real, 3)
        if ti.static(w.d == 2):
            w.free[i][1] = 0.0
    ti.loop_config(serialize=True)
    for k in range(n_held):
        i = w.held_node[k]
        pose = w.held_pose[k]
        target = w.pose_rotation[pose] @ w.rest[i] + w.pose_offset[pose]
        velocity = (target - w.x0[i]) / ti.cast(dt, w.real)
        for a in ti.static(AXES[w.d]):
            if w.held_axes[k][a] > 0:
                w.free[i][a] = 0.0
                w.dv[i][a] = velocity[a] - w.v[i][a]
                w.base_x[i][a] = target[a] - ti.cast(h, w.real) * velocity[a]


@ti.kernel
def pull(w: ti.template(), n_pulled: ti.i32, h: ti.f64):
    """Add the implicit springs of the handles to `w.spring` and `w.spring_load`.

    With stiffness k, the force at the end of the step is k (target - base_x - h (v + dv)).
    """
    ti.loop_config(serialize=True)
    for p in range(n_pulled):
        i = w.pulled_node[p]
        pose = w.pulled_pose[p]
        k = w.pulled_stiffness[p]
        step = ti.cast(h, w.real)
        target = w.pose_rotation[pose] @ w.rest[i] + w.pose_offset[pose]
        w.sprung[i] = 1
        w.spring_load[i] += step * k * (target - w.base_x[i] - step * w.v[i])
        for a in ti.static(AXES[w.d]):
            w.spring[i][a, a] += step * step * k


@ti.kernel
def clear_springs(w: ti.template(), n: ti.i32):
    """Forget the springs of the last step."""
    ti.loop_config(serialize=ti.static(w.alone(10)))
    for i in range(n):
        w.spring[i] = ti.Matrix.zero(w.real, 3, 3)
        w.spring_load[i] = ti.Vector.zero(w.real, 3)
        w.sprung[i] = 0
