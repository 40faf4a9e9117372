"""Kernels of the rasteriser: which triangle is seen where (a visibility buffer), for several views at once.

A view takes a point to homogeneous pixels (X, Y, w) and a depth. A pixel (x, y, 1) lies in a triangle where
its three edge functions, cross products of the homogeneous corners, have one sign (Olano and Greer 1997,
"Triangle scan conversion using 2D homogeneous coordinates"): corners behind the eye need no clipping, and a
shared edge gives exactly opposite numbers on both sides, so that no pixel falls through. Arrays come in as
arguments, not as fields of an object, so every kernel compiles once a process, whatever the sizes.
"""

from taichifem.runtime import ti

vec3 = ti.types.vector(3, ti.f32)
vec4 = ti.types.vector(4, ti.f32)
ivec3 = ti.types.vector(3, ti.i32)
ivec4 = ti.types.vector(4, ti.i32)
mat3 = ti.types.matrix(3, 3, ti.f32)
mat4 = ti.types.matrix(4, 4, ti.f32)

Keys = ti.types.ndarray(dtype=ti.i64, ndim=1)
Points = ti.types.ndarray(dtype=vec3, ndim=1)
Triangles = ti.types.ndarray(dtype=ivec3, ndim=1)
Corners = ti.types.ndarray(dtype=vec3, ndim=2)
Matrices = ti.types.ndarray(dtype=mat4, ndim=1)
Layout = ti.types.ndarray(dtype=ivec4, ndim=1)
"""Per view: width, height, where its pixels start in the keys, where its tiles start."""
Ints = ti.types.ndarray(dtype=ti.i32, ndim=1)
Grid = ti.types.ndarray(dtype=ti.f32, ndim=2)

EMPTY = 0x7FFFFFFFFFFFFFFF
TILE = 64
BIG = 4096
"""Pixels of a bounding box above which a triangle is drawn tile by tile instead of by one thread."""


@ti.func
def project(m: mat4, p: vec3) -> vec4:
    return m @ vec4(p[0], p[1], p[2], 1.0)


@ti.func
def xyw(q: vec4) -> vec3:
    return vec3(q[0], q[1], q[2])


@ti.func
def edge_functions(a: vec4, b: vec4, c: vec4) -> mat3:
    """Rows: coefficients of x, y, 1 for the edge opposite each corner; all positive inside, both ways round."""
    e0 = xyw(b).cross(xyw(c))
    e1 = xyw(c).cross(xyw(a))
    e2 = xyw(a).cross(xyw(b))
    sign = ti.select(xyw(a).dot(e0) < 0, -1.0, 1.0)
    return sign * ti.Matrix.rows([e0, e1, e2])


@ti.func
def fill(keys: ti.template(), e: mat3, depths: vec3, triangle: ti.i32, box: ivec4, view: ivec4):
    """Put `triangle` into the pixels of `box` (x0, y0, x1, y1) it covers, where nothing nearer is."""
    width, height, start = view[0], view[1], view[2]
    for y in range(box[1], box[3]):
        fy = y + 0.5 - 0.5 * height
        # Exactly x * slope + rest, never a running sum: the neighbour must find the same number, negated.
        r0 = e[0, 1] * fy + e[0, 2]
        r1 = e[1, 1] * fy + e[1, 2]
        r2 = e[2, 1] * fy + e[2, 2]
        for x in range(box[0], box[2]):
            fx = x + 0.5 - 0.5 * width
            s0 = e[0, 0] * fx + r0
            s1 = e[1, 0] * fx + r1
            s2 = e[2, 0] * fx + r2
            total = s0 + s1 + s2
            if s0 >= 0 and s1 >= 0 and s2 >= 0 and total > 0:
                depth = (s0 * depths[0] + s1 * depths[1] + s2 * depths[2]) / total
                if depth > 0:
                    # Bits of positive floats sort like the floats.
                    key = (ti.cast(ti.bit_cast(depth, ti.i32), ti.i64) << 32) | ti.cast(triangle, ti.i64)
                    at = start + y * width + x
                    if key < keys[at]:
                        ti.atomic_min(keys[at], key)


@ti.func
def bounding_box(a: vec4, b: vec4, c: vec4, view: ivec4) -> ivec4:
    """Pixels (x0, y0, x1, y1) that the triangle may cover; the whole view where it reaches behind the eye."""
    width, height = view[0], view[1]
    box = ivec4(0, 0, width, height)
    nearest = ti.min(a[2], b[2], c[2])
    if nearest > 1e-6 * ti.max(a[2], b[2], c[2]):
        w = ti.cast(width, ti.f32)
        h = ti.cast(height, ti.f32)
        x = vec3(a[0] / a[2], b[0] / b[2], c[0] / c[2]) + 0.5 * w
        y = vec3(a[1] / a[2], b[1] / b[2], c[1] / c[2]) + 0.5 * h
        box[0] = ti.cast(ti.floor(ti.math.clamp(x.min() - 0.5, 0, w)), ti.i32)
        box[1] = ti.cast(ti.floor(ti.math.clamp(y.min() - 0.5, 0, h)), ti.i32)
        box[2] = ti.cast(ti.ceil(ti.math.clamp(x.max() + 0.5, 0, w)), ti.i32)
        box[3] = ti.cast(ti.ceil(ti.math.clamp(y.max() + 0.5, 0, h)), ti.i32)
    elif ti.max(a[2], b[2], c[2]) <= 0:
        box = ivec4(0, 0, 0, 0)
    return box


@ti.kernel
def visibility(
    keys: Keys,
    pixels: ti.i32,
    big: Ints,
    matrices: Matrices,
    layout: Layout,
    views: ti.i32,
    tiles: ti.i32,
    points: Points,
    triangles: Triangles,
    count: ti.i32,
):
    """Fill the keys (depth bits over triangle number) of all views.

    big: scratch, at least 1 + 6 count views; holds how many triangles are too big for one thread, and those.
    """
    for i in range(pixels):
        keys[i] = ti.i64(EMPTY)
    for _ in range(1):
        big[0] = 0
    for i in range(count * views):
        v = i // count
        t = i - v * count
        m = matrices[v]
        view = layout[v]
        corner = triangles[t]
        a = project(m, points[corner[0]])
        b = project(m, points[corner[1]])
        c = project(m, points[corner[2]])
        box = bounding_box(a, b, c, view)
        area = (box[2] - box[0]) * (box[3] - box[1])
        if area > BIG:
            slot = 1 + 6 * ti.atomic_add(big[0], 1)
            big[slot] = t
            big[slot + 1] = v
            for k in ti.static(range(4)):
                big[slot + 2 + k] = box[k]
        elif area > 0:
            fill(keys, edge_functions(a, b, c), vec3(a[3], b[3], c[3]), t, box, view)
    ti.loop_config(block_dim=16)
    for tile in range(tiles):
        v = 0
        while v + 1 < views and layout[v + 1][3] <= tile:
            v += 1
        view = layout[v]
        across = (view[0] + TILE - 1) // TILE
        x0 = (tile - view[3]) % across * TILE
        y0 = (tile - view[3]) // across * TILE
        for k in range(big[0]):
            slot = 1 + 6 * k
            if big[slot + 1] == v:
                box = ivec4(
                    ti.max(big[slot + 2], x0),
                    ti.max(big[slot + 3], y0),
                    ti.min(big[slot + 4], x0 + TILE),
                    ti.min(big[slot + 5], y0 + TILE),
                )
                if box[0] < box[2] and box[1] < box[3]:
                    t = big[slot]
                    m = matrices[v]
                    corner = triangles[t]
                    a = project(m, points[corner[0]])
                    b = project(m, points[corner[1]])
                    c = project(m, points[corner[2]])
                    fill(keys, edge_functions(a, b, c), vec3(a[3], b[3], c[3]), t, box, view)


@ti.kernel
def corner_normals(
    points: Points,
    triangles: Triangles,
    count: ti.i32,
    fan_starts: Ints,
    fans: Ints,
    faces: Points,
    normals: Corners,
    sharp: ti.f32,
    smooth: ti.f32,
):
    """Unit normals (count,3) at the corners: mean of the faces around, weighted by area.

    A face counts fully where its angle to the corner's own face has a cosine above `smooth`, not at all below
    `sharp`, so that creases stay sharp and do not flip as they bend.
    fans: for node i, the triangles around it are fans[fan_starts[i] : fan_starts[i + 1]].
    """
    for t in range(count):
        corner = triangles[t]
        a = points[corner[0]]
        faces[t] = (points[corner[1]] - a).cross(points[corner[2]] - a)
    for t in range(count):
        own = faces[t]
        size = own.norm()
        unit = own / ti.max(size, 1e-30)
        for k in ti.static(range(3)):
            total = own
            node = triangles[t][k]
            for f in range(fan_starts[node], fan_starts[node + 1]):
                other = fans[f]
                if other != t:
                    face = faces[other]
                    cosine = face.dot(unit) / ti.max(face.norm(), 1e-30)
                    total += ti.math.smoothstep(sharp, smooth, cosine) * face
            normals[t, k] = total / ti.max(total.norm(), 1e-30)


@ti.kernel
def ground_occlusion(
    keys: Keys,
    start: ti.i32,
    floor: ti.f32,
    texel: ti.f32,
    closest: ti.f32,
    above: Points,
    out: Grid,
):
    """Share of the sky that what hangs over the ground takes, for each texel of the view from below.

    Every texel of the underside, at height h and distance r, covers h^2 dA / (pi (h^2 + r^2)^2) of the
    cosine-weighted sky.
    start: of that view in the keys.  floor: depth of the ground in it.  closest: least h [m].
    above: scratch (texels,3), for the texels that hold something.
    """
    side = out.shape[0]
    for _ in range(1):
        found = 0
        for i in range(side * side):
            key = keys[start + i]
            if key != ti.i64(EMPTY):
                depth = ti.bit_cast(ti.cast(key >> 32, ti.i32), ti.f32)
                above[1 + found] = vec3(i % side * texel, i // side * texel, ti.max(depth - floor, closest))
                found += 1
        above[0][0] = found
    for i, j in out:
        covered = 0.0
        for k in range(1, 1 + ti.cast(above[0][0], ti.i32)):
            q = above[k]
            dx = q[0] - j * texel
            dy = q[1] - i * texel
            share = q[2] / (q[2] * q[2] + dx * dx + dy * dy)
            covered += share * share
        out[i, j] = ti.min(covered * texel * texel / 3.14159265, 1.0)
