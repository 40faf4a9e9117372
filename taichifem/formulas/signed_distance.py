"""Signed distances to simple solids in their own frame: negative inside, with the outward normal."""

from taichifem.runtime import ti

PLANE, SPHERE, BOX = 0, 1, 2


@ti.func
def to_half_space(p):
    """Distance and normal to the half space z <= 0."""
    return p[2], ti.Vector([0.0, 0.0, 1.0])


@ti.func
def to_sphere(p, radius):
    """Distance and normal to the ball of `radius` about the origin."""
    length = p.norm()
    normal = ti.Vector([0.0, 0.0, 1.0])
    if length > 0:
        normal = p / length
    return length - radius, normal


@ti.func
def to_box(p, half):
    """Distance and normal to the box |p_k| <= half_k."""
    outside = ti.Vector([0.0, 0.0, 0.0])
    nearest = -1e30
    axis = 0
    for k in ti.static(range(3)):
        gap = ti.abs(p[k]) - half[k]
        outside[k] = ti.max(gap, 0.0)
        if gap > nearest:
            nearest = gap
            axis = k
    distance = nearest
    normal = ti.Vector([0.0, 0.0, 0.0])
    for k in ti.static(range(3)):
        side = 1.0 if p[k] >= 0 else -1.0
        if nearest <= 0 and axis == k:
            normal[k] = side
        if nearest > 0:
            normal[k] = side * outside[k]
    if nearest > 0:
        distance = outside.norm()
        normal = normal / distance
    return distance, normal
