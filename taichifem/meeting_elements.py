"""Springs between a node of one piece and a face of another: elements of four nodes, found by `processes.meeting`."""

from taichifem.runtime import ti


@ti.func
def block(w: ti.template(), c: ti.i32, a: ti.i32, b: ti.i32):
    """Stiffness [N/m] between corners a and b of spring c."""
    normal, k = w.meeting_normal[c], w.meeting_stiffness[c]
    share = w.meeting_weight[c][a] * w.meeting_weight[c][b]
    return share * ((k[0] - k[1]) * normal.outer_product(normal) + k[1] * ti.Matrix.identity(w.real, 3))


@ti.kernel
def push(w: ti.template(), count: ti.i32, h: ti.f64):
    """Add what the springs give for dv = 0 to `w.spring_load`; their stiffness stands in the matrix."""
    ti.loop_config(serialize=True)
    for c in range(count):
        step, normal, k = ti.cast(h, w.real), w.meeting_normal[c], w.meeting_stiffness[c]
        gap, slide = ti.cast(0.0, w.real), ti.Vector.zero(w.real, 3)
        for a in ti.static(range(4)):
            i = w.meeting_cell[c][a]
            end = w.base_x[i] + step * w.v[i]
            gap += w.meeting_weight[c][a] * normal.dot(end)
            slide += w.meeting_weight[c][a] * (end - w.x0[i])
        slide -= slide.dot(normal) * normal
        force = k[0] * (w.meeting_gap[c] - gap) * normal - k[1] * slide
        for a in ti.static(range(4)):
            i = w.meeting_cell[c][a]
            w.spring_load[i] = w.spring_load[i] + step * w.meeting_weight[c][a] * force
            w.sprung[i] = 1
