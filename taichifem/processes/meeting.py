"""Contact between pieces: nodes of one that are about to end a step inside of another, and the springs against that.

Found with a spatial hash: nodes go into the cells of a grid, and every tetrahedron looks into the cells that it
covers. From a node inside, a ray runs backward along the node's normal to the face through which it came in (Hermann,
Faure & Raffin 2008); between this face and the node a spring acts for the step, implicit like everything else. To
the solver it is an element of four nodes. So momentum is kept, and nothing that a stiff spring does can explode.

What is inside already is let out by a part each step, so that the speed with which pieces leave one another stays
small, however they came to overlap; pieces that have just split touch everywhere, and feel nothing until they close.
"""

from taichifem.processes import contact
from taichifem.runtime import ti
from taichifem.world import World, round_up

RECOVERY = 0.2
"""Part of the depth of a node that its spring takes back in a step."""

STRIDE = 64
"""Tetrahedra that a ray runs through at most: deeper, there is no telling where the node came in."""

MARGIN, DEEPEST = 1e-3, 0.3
"""Depth, in sizes of the grid, below which a node is not inside yet; and that at the start of the step above which a
ray must have missed the face through which it came in."""

GRAZING = 0.05
"""Cosine between ray and face below which the face says nothing of where the node came in."""


@ti.func
def _bucket(cell, buckets: ti.i32):
    """Number of a cell in the hash (Teschner et al. 2003); of `buckets` there is a power of two."""
    mixed = (cell[0] * 73856093) ^ (cell[1] * 19349663) ^ (cell[2] * 83492791)
    return mixed & (buckets - 1)


@ti.func
def _piece(w: ti.template(), i: ti.i32):
    """The piece that a node belongs to."""
    return w.piece[w.incident[w.incident_start[i]] >> 2]


@ti.func
def _corner(w: ti.template(), e: ti.i32, a: ti.i32):
    """Where corner a of a tetrahedron is headed."""
    return w.z[w.cell[e][a]]


@ti.func
def _face(w: ti.template(), e: ti.i32, a: ti.i32):
    """Outward normal of the face opposite corner a, twice as long as its area, and a point on it."""
    i, j, k = 1, 2, 3
    if a == 1:
        i, j, k = 0, 3, 2
    elif a == 2:
        i, j, k = 0, 1, 3
    elif a == 3:
        i, j, k = 0, 2, 1
    p = _corner(w, e, i)
    return (_corner(w, e, j) - p).cross(_corner(w, e, k) - p), p


@ti.func
def _inside(w: ti.template(), e: ti.i32, point, margin):
    """Is the point in the tetrahedron, and not just on the surface of its piece, by a margin?

    On faces between tetrahedra it counts as inside; on edges and corners too, unless these belong to the surface.
    """
    inside, near, hidden = 1, 0, 0
    for a in range(4):
        normal, p = _face(w, e, a)
        depth = normal.dot(p - point) / normal.norm()
        if depth < (margin if w.beside[e][a] < 0 else -0.01 * margin):
            inside = 0
        if depth < margin:
            near += 1
        elif w.outward[w.cell[e][a]].norm_sqr() == 0:
            hidden = 1
    return inside == 1 and (near < 2 or hidden == 1)


@ti.kernel
def _look(w: ti.template(), n: ti.i32, m: ti.i32, dt: ti.f64, size: ti.f64, buckets: ti.i32):
    """Which tetrahedron of another piece each node of a surface is about to enter: to `w.entered`, or m for none."""
    ti.loop_config(serialize=ti.static(w.alone(5)))
    for i in range(n):
        w.z[i] = w.x[i] + ti.cast(dt, w.real) * w.v[i]
        w.entered[i] = m
    ti.loop_config(serialize=ti.static(w.alone(5)))
    for k in range(buckets + 1):
        w.bucket_start[k] = 0
        w.bucket_pieces[k] = ti.Vector([m, -1])
    inverse, margin = ti.cast(1 / size, w.real), ti.cast(MARGIN * size, w.real)
    for i in range(n):
        normal = ti.Vector.zero(w.real, 3)
        for k in range(w.incident_start[i], w.incident_start[i + 1]):
            e, own = w.incident[k] >> 2, w.incident[k] & 3
            for a in range(4):
                if a != own and w.beside[e][a] < 0:
                    outward, _p = _face(w, e, a)
                    normal += outward
        w.outward[i] = normal.normalized(1e-30)
        if normal.norm_sqr() > 0:
            k = _bucket(ti.floor(w.z[i] * inverse, ti.i32), buckets)
            ti.atomic_add(w.bucket_start[k], 1)
            ti.atomic_min(w.bucket_pieces[k][0], _piece(w, i))
            ti.atomic_max(w.bucket_pieces[k][1], _piece(w, i))
    ti.loop_config(serialize=True)
    for _ in range(1):
        total = 0
        for k in range(buckets + 1):
            total += w.bucket_start[k]
            w.bucket_start[k] = total
    for i in range(n):
        if w.outward[i].norm_sqr() > 0:
            k = _bucket(ti.floor(w.z[i] * inverse, ti.i32), buckets)
            w.bucket_node[ti.atomic_sub(w.bucket_start[k], 1) - 1] = i
    for e in range(m):
        low, high = _corner(w, e, 0), _corner(w, e, 0)
        for a in range(1, 4):
            low, high = ti.min(low, _corner(w, e, a)), ti.max(high, _corner(w, e, a))
        first, last = ti.floor(low * inverse, ti.i32), ti.floor(high * inverse, ti.i32)
        # Numbers of cells end somewhere: what is farther away has diverged, and its differences wrap round.
        if ((high - low) * inverse).max() < 16 and ti.max(-low, high).max() * inverse < 1e9:
            for c in ti.grouped(ti.ndrange((first[0], last[0] + 1), (first[1], last[1] + 1), (first[2], last[2] + 1))):
                k = _bucket(c, buckets)
                there, own = w.bucket_pieces[k], w.piece[e]
                if there[0] == there[1] and there[0] == own:
                    continue
                for q in range(w.bucket_start[k], w.bucket_start[k + 1]):
                    i = w.bucket_node[q]
                    if _piece(w, i) != own and _inside(w, e, w.z[i], margin):
                        ti.atomic_min(w.entered[i], e)


@ti.func
def _way_out(w: ti.template(), i: ti.i32, start: ti.i32):
    """Element and corner opposite the face through which node i came in, and where; -1 if there is no telling."""
    e, a_out, ray, point = start, -1, -w.outward[i], w.z[i]
    came, done, way = -1, 0, ti.cast(0.0, w.real)
    for _ in range(STRIDE):
        if done == 0:
            best, nearest, next_e = -1, ti.cast(1e30, w.real), -1
            for a in range(4):
                normal, p = _face(w, e, a)
                along = normal.dot(ray)
                other = w.beside[e][a]
                if along > ti.cast(GRAZING, w.real) * normal.norm() and (other < 0 or other != came):
                    t = normal.dot(p - point) / along
                    if t < nearest:
                        best, nearest, next_e = a, t, other
            if best < 0:
                done = 2
            elif next_e < 0:
                a_out, way, done = best, nearest, 1
            else:
                came = e
                e = next_e
    if done != 1 or way < 0:
        a_out = -1
    return e, a_out, point + way * ray


@ti.func
def _note(w: ti.template(), i: ti.i32, e: ti.i32, a: ti.i32, point, dt, deepest):
    """The spring of node i and the face opposite corner a of element e, at a point of it."""
    found = w.meetings[None]
    normal, _p = _face(w, e, a)
    double_area = normal.norm()
    normal /= double_area
    cell, weight = ti.Vector([i, 0, 0, 0]), ti.Vector([1.0, 0.0, 0.0, 0.0])
    total, at = ti.cast(0.0, w.real), 1
    stiff = contact.stiffness(w, i, dt)
    for b in ti.static(range(4)):
        if b != a:
            node = w.cell[e][b]
            # The part of the face across from its corner.
            rest = ti.Vector([0, 0])
            k = 0
            for c in ti.static(range(4)):
                if c != a and c != b:
                    if k == 0:
                        rest[0] = c
                    else:
                        rest[1] = c
                    k += 1
            p, q = w.z[w.cell[e][rest[0]]], w.z[w.cell[e][rest[1]]]
            share = ti.max((p - point).cross(q - point).norm(), 0.0)
            stiff = ti.min(stiff, contact.stiffness(w, node, dt))
            total += share
            for slot in ti.static(range(1, 4)):
                if slot == at:
                    cell[slot], weight[slot] = node, -share
            at += 1
    for slot in ti.static(range(1, 4)):
        weight[slot] /= ti.max(total, 1e-30)
    depth, slide = ti.cast(0.0, w.real), ti.Vector.zero(w.real, 3)
    for b in ti.static(range(4)):
        depth -= weight[b] * normal.dot(w.x[cell[b]])
        slide += weight[b] * (w.z[cell[b]] - w.x[cell[b]])
    slide -= slide.dot(normal) * normal
    depth = ti.max(depth, 0.0)
    w.meeting_cell[found], w.meeting_weight[found], w.meeting_normal[found] = cell, weight, normal
    w.meeting_gap[found] = -ti.cast(1 - RECOVERY, w.real) * depth
    # Friction as in `contact`, with the normal force that the spring had at the end of the last step.
    held = w.friction[None] * ti.cast(RECOVERY, w.real) * stiff * depth
    side = ti.min(stiff, held / ti.max(slide.norm(), 1e-30))
    w.meeting_stiffness[found] = ti.Vector([stiff, side])
    if depth < deepest:
        w.meetings[None] = found + 1


@ti.kernel
def _gather(w: ti.template(), n: ti.i32, m: ti.i32, dt: ti.f64, size: ti.f64):
    """List the springs, in the order of the nodes, as far as there is room."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        w.meetings[None] = 0
    ti.loop_config(serialize=True)
    for i in range(n):
        if w.entered[i] < m and w.meetings[None] < w.meeting_cell.shape[0]:
            e, a, point = _way_out(w, i, w.entered[i])
            if a >= 0:
                _note(w, i, e, a, point, ti.cast(dt, w.real), ti.cast(DEEPEST * size, w.real))


def find(w: World, n: int, m: int, *, dt: float, size: float) -> int:
    """Find all nodes that are about to meet another piece in a step of dt [s]; how many springs there are now.

    size: of the cells of the grid [m].
    """
    _look(w, n, m, dt, size, 2 * round_up(n, 1))
    _gather(w, n, m, dt, size)
    return int(w.meetings[None])
