"""How far a point that moves from p0 to p1 goes into a simple solid, in the solid's own frame.

Each returns the gap (negative: inside) at p1 and the outward normal along which it is to be closed. The side is
the one by which the point came in, so that a point which passes the middle of a thin solid within one step, or all
of it, is sent back and not through.
"""

from taichifem.runtime import ti

PLANE, SPHERE, BOX = 0, 1, 2
FAR = 1e30


@ti.func
def gap_to_half_space(p1):
    """The half space z <= 0."""
    return p1[2], ti.Vector([0.0, 0.0, 1.0])


@ti.func
def gap_to_sphere(p0, p1, radius):
    """The ball of `radius` about the origin."""
    gap = p1.norm() - radius
    normal = ti.Vector([0.0, 0.0, 1.0])
    if p1.norm() > 0:
        normal = p1 / p1.norm()
    if p0.norm() > radius:
        # First root of |p0 + t (p1 - p0)| = radius.
        way = p1 - p0
        a, b, c = way.norm_sqr(), way.dot(p0), p0.norm_sqr() - radius * radius
        root = b * b - a * c
        if root > 0 and b < 0 and c < -b + ti.sqrt(root):
            t = (-b - ti.sqrt(root)) / a
            if t <= 1:
                normal = (p0 + t * way) / radius
                gap = normal.dot(p1) - radius
    return gap, normal


@ti.func
def gap_to_box(p0, p1, half):
    """The box |p_k| <= half_k."""
    outside, inside = False, True
    nearest = -FAR  # the face nearest to p0, where it is inside
    enter, leave = -FAR, FAR  # shares of the way at which all slabs are entered, and the first is left
    face, entry = 0, 0
    for k in ti.static(range(3)):
        start, end = ti.abs(p0[k]) - half[k], ti.abs(p1[k]) - half[k]
        inside = inside and end < 0
        if start > nearest:
            nearest = start
            face = k
        way = p1[k] - p0[k]
        if start >= 0:
            outside = True
            if p0[k] * way < 0:
                t = start / ti.abs(way)
                if t > enter:
                    enter = t
                    entry = k
            else:
                enter = FAR
        if ti.abs(way) > 0:
            leave = ti.min(leave, (half[k] + ti.abs(p0[k]) * (1.0 if p0[k] * way <= 0 else -1.0)) / ti.abs(way))
    hit = inside
    if outside:
        hit = enter <= 1 and enter < leave
        face = entry
    gap = 1.0
    normal = ti.Vector([0.0, 0.0, 0.0])
    if hit:
        for k in ti.static(range(3)):
            if k == face:
                side = 1.0 if p0[k] >= 0 else -1.0
                normal[k] = side
                gap = side * p1[k] - half[k]
    return gap, normal
