"""Kernels of the rasteriser: the light on what is seen, one pixel at a time, from the visibility buffer.

Linear light throughout; the encoding table makes sRGB of the mean. A pixel is shaded once for each thing
seen in it (triangle, ground or background), at the mean of the samples that see it, so that supersampling
costs only where something ends.
"""

from taichifem.output.colors import ENCODING_SIZE, KNEE
from taichifem.output.raster_kernels import (
    EMPTY,
    Corners,
    Grid,
    Keys,
    Points,
    Triangles,
    edge_functions,
    mat4,
    project,
    vec3,
)
from taichifem.runtime import ti

vec2 = ti.types.vector(2, ti.f32)
Pixels = ti.types.ndarray(dtype=ti.u8, ndim=3)
Table = ti.types.ndarray(dtype=ti.f32, ndim=1)

GROUND = -1
BACKGROUND = -2
BLOCK = 8
"""Texels of the shadow map along the side of a block of `nearest_blocks`."""

Look = ti.types.struct(
    eye=vec3,
    right=vec3,
    up=vec3,
    forward=vec3,
    focal=ti.f32,  # pixels
    camera_view=mat4,
    light_view=mat4,
    light_side=ti.i32,  # texels
    light_start=ti.i32,  # where the shadow map starts in the keys
    to_light=vec3,
    key=vec3,
    sky=vec3,
    fill=vec3,
    horizon=vec3,
    zenith=vec3,
    has_ground=ti.i32,
    ground=vec3,
    ground_u=vec3,
    ground_v=vec3,
    ground_normal=vec3,
    floor_color=vec3,
    line_color=vec3,
    spacing=ti.f32,  # of the lines on the ground [m]
    middle=vec2,  # of the picture's subject on the ground, along u and v [m]
    fade=ti.f32,  # distance over which the ground goes into the background [m]
    patch=vec2,  # first corner of the occlusion grid, along u and v [m]
    patch_texel=ti.f32,  # [m]
    shadow_texel=ti.f32,  # [m]
    wired=ti.i32,  # triangles below this number show their edges
    wire_width=ti.f32,  # pixels
)


@ti.func
def ray(look: ti.template(), x: ti.f32, y: ti.f32, width: ti.i32, height: ti.i32) -> vec3:
    """Direction through pixel position (x, y), of depth 1."""
    dx = (x - 0.5 * width) / look.focal
    dy = (y - 0.5 * height) / look.focal
    return look.forward + dx * look.right - dy * look.up


@ti.func
def ground_depth(look: ti.template(), direction: vec3) -> ti.f32:
    """Depth at which the ray meets the ground from above, or -1."""
    depth = -1.0
    down = direction.dot(look.ground_normal)
    over = (look.ground - look.eye).dot(look.ground_normal)
    if look.has_ground == 1 and over < 0 and down < 0:
        depth = over / down
    return depth


@ti.kernel
def nearest_blocks(keys: Keys, start: ti.i32, side: ti.i32, out: Keys):
    """The nearest key (side/BLOCK)^2 in each block of the shadow map.

    Most of the floor has nothing above it, and a look at a few blocks tells so.
    """
    blocks = side // BLOCK
    for i in range(blocks * blocks):
        corner = start + (i // blocks * side + i % blocks) * BLOCK
        nearest = ti.i64(EMPTY)
        for y in range(BLOCK):
            for x in range(BLOCK):
                nearest = ti.min(nearest, keys[corner + y * side + x])
        out[i] = nearest


@ti.func
def sunlit(keys: ti.template(), blocks: ti.template(), look: ti.template(), p: vec3, slack: ti.f32) -> ti.f32:
    """Share of the key light that reaches p: a tent-weighted mean over 6 x 6 texels of the shadow map."""
    light = 1.0
    side, start = look.light_side, look.light_start
    q = project(look.light_view, p)
    x = q[0] + 0.5 * side - 0.5
    y = q[1] + 0.5 * side - 0.5
    ix = ti.cast(ti.floor(x), ti.i32)
    iy = ti.cast(ti.floor(y), ti.i32)
    if ix >= 2 and iy >= 2 and ix < side - 3 and iy < side - 3:
        limit = ti.cast(ti.bit_cast(ti.max(q[3] - slack, 0.0), ti.i32), ti.i64) << 32
        across = side // BLOCK
        x0, x1 = (ix - 2) // BLOCK, (ix + 3) // BLOCK
        y0, y1 = (iy - 2) // BLOCK * across, (iy + 3) // BLOCK * across
        top = ti.min(blocks[y0 + x0], blocks[y0 + x1])
        bottom = ti.min(blocks[y1 + x0], blocks[y1 + x1])
        if ti.min(top, bottom) < limit:
            fx = x - ti.floor(x)
            fy = y - ti.floor(y)
            total = 0.0
            for j in range(-2, 4):
                row = 0.0
                at = start + (iy + j) * side + ix
                for i in ti.static(range(-2, 4)):
                    # Tents reach three texels from fx; only the outermost can be past the end.
                    weight = ti.max(3.0 - ti.abs(i - fx), 0.0)
                    row += ti.select(keys[at + i] >= limit, weight, 0.0)
                total += row * ti.max(3.0 - ti.abs(j - fy), 0.0)
            light = total / 81.0
    return light


@ti.func
def sky_left(occlusion: ti.template(), look: ti.template(), p: vec3) -> ti.f32:
    """Share of the sky seen from the ground below p, between the texels of the occlusion grid."""
    side = occlusion.shape[0]
    x = ((p - look.ground).dot(look.ground_u) - look.patch[0]) / look.patch_texel - 0.5
    y = ((p - look.ground).dot(look.ground_v) - look.patch[1]) / look.patch_texel - 0.5
    left = 1.0
    ix = ti.cast(ti.floor(x), ti.i32)
    iy = ti.cast(ti.floor(y), ti.i32)
    if look.has_ground == 1 and ix >= 0 and iy >= 0 and ix < side - 1 and iy < side - 1:
        fx = x - ix
        fy = y - iy
        top = occlusion[iy, ix] * (1 - fx) + occlusion[iy, ix + 1] * fx
        bottom = occlusion[iy + 1, ix] * (1 - fx) + occlusion[iy + 1, ix + 1] * fx
        left = 1 - (top * (1 - fy) + bottom * fy)
    return left


@ti.func
def line_share(x: ti.f32, footprint: ti.f32, width: ti.f32) -> ti.f32:
    """How much of [x - footprint/2, x + footprint/2] lies on lines of `width` about the whole numbers."""
    a = x - 0.5 * footprint + 0.5 * width
    b = a + footprint
    below_a = ti.floor(a) * width + ti.min(a - ti.floor(a), width)
    below_b = ti.floor(b) * width + ti.min(b - ti.floor(b), width)
    return (below_b - below_a) / footprint


@ti.func
def background(look: ti.template(), direction: vec3) -> vec3:
    rise = direction.normalized()[2]
    return ti.math.mix(look.horizon, look.zenith, ti.math.smoothstep(-0.1, 0.7, rise))


@ti.func
def ground_light(
    keys: ti.template(),
    blocks: ti.template(),
    occlusion: ti.template(),
    look: ti.template(),
    direction: vec3,
    beside: vec3,
    below: vec3,
) -> vec3:
    """Light from the ground along `direction`; beside, below: directions one pixel on, for the footprint."""
    p = look.eye + ground_depth(look, direction) * direction
    local = vec2((p - look.ground).dot(look.ground_u), (p - look.ground).dot(look.ground_v))
    away = (local - look.middle).norm() / look.fade
    light = background(look, direction)
    # Past the fade the floor is the background: no shadow to look up, no lines to draw.
    if away < 1.0:
        footprint = vec2(0.0, 0.0)
        for k in ti.static(range(2)):
            other = beside if k == 0 else below
            depth = ground_depth(look, other)
            step = look.eye + ti.select(depth > 0, depth, 1e6) * other - p
            footprint[0] += ti.abs(step.dot(look.ground_u))
            footprint[1] += ti.abs(step.dot(look.ground_v))
        at = local / look.spacing
        wide = ti.math.clamp(footprint / look.spacing, 1e-5, 1e3)
        lines = ti.max(
            line_share(at[0], wide[0], 0.012),
            line_share(at[1], wide[1], 0.012),
        )
        albedo = ti.math.mix(look.floor_color, look.line_color, lines)
        facing = ti.max(look.ground_normal.dot(look.to_light), 0.0)
        sun = sunlit(keys, blocks, look, p, 0.5 * look.shadow_texel)
        lit = albedo * (facing * sun * look.key + sky_left(occlusion, look, p) * look.sky)
        light = ti.math.mix(lit, light, ti.math.smoothstep(0.25, 1.0, away))
    return light


@ti.func
def surface_light(
    keys: ti.template(),
    blocks: ti.template(),
    occlusion: ti.template(),
    look: ti.template(),
    p: vec3,
    direction: vec3,
    normal: vec3,
    albedo: vec3,
) -> vec3:
    """Light from a point p of a solid: key light with shadow, sky above, bounce from the ground below."""
    view = -direction.normalized()
    n = ti.select(normal.dot(view) < 0, -normal, normal)
    facing = n.dot(look.to_light)
    sun = 0.0
    if facing > 0:
        # Stepping off along the normal, the more the flatter the light, keeps a surface out of its own shadow.
        off = look.shadow_texel * (1.5 + 4.0 * (1 - facing))
        sun = sunlit(keys, blocks, look, p + off * n, look.shadow_texel)
    facing = ti.max(facing, 0.0)
    up = 0.5 + 0.5 * n[2]
    left = sky_left(occlusion, look, p)
    bounce = look.floor_color * (0.35 + 0.65 * left) * left
    ambient = look.sky * ti.math.mix(0.62 * bounce, vec3(1.0, 1.0, 1.0), up)
    half = (look.to_light + view).normalized()
    shine = ti.max(n.dot(half), 0.0)
    for _ in ti.static(range(5)):
        shine *= shine
    rim = ti.math.clamp(1 - n.dot(view), 0.0, 1.0)
    rim *= rim * rim
    fill = look.fill * ti.max(-n.dot(look.to_light) * 0.6 + n.dot(view) * 0.4, 0.0)
    diffuse = albedo * (facing * sun * look.key + ambient + fill)
    return diffuse + 0.16 * shine * sun * look.key + 0.12 * rim * look.sky * up


@ti.func
def triangle_light(
    keys: ti.template(),
    blocks: ti.template(),
    occlusion: ti.template(),
    look: ti.template(),
    points: ti.template(),
    triangles: ti.template(),
    normals: ti.template(),
    colors: ti.template(),
    thing: ti.i32,
    at: vec3,
    direction: vec3,
    samples: ti.template(),
) -> vec3:
    """Light from triangle number `thing` at `at` (x, y, 1): samples from the middle of the picture."""
    corner = triangles[thing]
    a = points[corner[0]]
    b = points[corner[1]]
    c = points[corner[2]]
    view = look.camera_view
    e = edge_functions(project(view, a), project(view, b), project(view, c))
    across = e @ at
    weight = ti.max(across, 0.0)
    weight /= ti.max(weight.sum(), 1e-30)
    p = weight[0] * a + weight[1] * b + weight[2] * c
    normal = vec3(0.0)
    albedo = vec3(0.0)
    for k in ti.static(range(3)):
        normal += weight[k] * normals[thing, k]
        albedo += weight[k] * colors[thing, k]
    normal /= ti.max(normal.norm(), 1e-30)
    light = surface_light(keys, blocks, occlusion, look, p, direction, normal, albedo)
    if thing < look.wired:
        closest = 1e9
        for k in ti.static(range(3)):
            slope = ti.sqrt(e[k, 0] * e[k, 0] + e[k, 1] * e[k, 1])
            closest = ti.min(closest, across[k] / (samples * ti.max(slope, 1e-30)))
        light *= 1 - 0.55 * ti.math.clamp(0.5 * look.wire_width + 0.5 - closest, 0.0, 1.0)
    return light


@ti.func
def grain(x: ti.i32, y: ti.i32) -> ti.f32:
    """A fixed scatter in [0, 1) over the pixels: rounding with it hides the steps of 8 bits in soft shades."""
    mixed = ti.cast(x, ti.u32) * ti.u32(0x9E3779B1) + ti.cast(y, ti.u32) * ti.u32(0x85EBCA77)
    mixed = (mixed ^ (mixed >> 15)) * ti.u32(0x2C1B3C6D)
    return ti.cast(mixed >> 8, ti.f32) * (1.0 / 16777216.0)


@ti.kernel
def shade(
    keys: Keys,
    blocks: Keys,
    look: Look,
    points: Points,
    triangles: Triangles,
    normals: Corners,
    colors: Corners,
    occlusion: Grid,
    encoding: Table,
    out: Pixels,
    samples: ti.template(),
):
    """Picture (height,width,3) from the keys of the camera's view (samples^2 a pixel)."""
    height, width = out.shape[0], out.shape[1]
    for py, px in ti.ndrange(height, width):
        seen = ti.Vector([BACKGROUND] * samples**2)
        for s in ti.static(range(samples**2)):
            sx = px * samples + s % samples
            sy = py * samples + s // samples
            key = keys[sy * width * samples + sx]
            depth = ti.bit_cast(ti.cast(key >> 32, ti.i32), ti.f32)
            floor = ground_depth(look, ray(look, (sx + 0.5) / samples, (sy + 0.5) / samples, width, height))
            # Empty keys hold a NaN for depth, before which everything is nearer.
            if floor > 0 and not (depth <= floor):
                seen[s] = GROUND
            elif depth > 0:
                seen[s] = ti.cast(key & ti.i64(0x7FFFFFFF), ti.i32)
        picture = vec3(0.0)
        for s in range(samples**2):
            thing = seen[s]
            share, x, y = 0.0, 0.0, 0.0
            first = True
            for r in ti.static(range(samples**2)):
                if seen[r] == thing:
                    first = first and r >= s
                    share += 1.0
                    x += (r % samples + 0.5) / samples
                    y += (r // samples + 0.5) / samples
            if first:
                x = px + x / share
                y = py + y / share
                direction = ray(look, x, y, width, height)
                light = vec3(0.0)
                if thing == BACKGROUND:
                    light = background(look, direction)
                elif thing == GROUND:
                    beside = ray(look, x + 1, y, width, height)
                    below = ray(look, x, y + 1, width, height)
                    light = ground_light(keys, blocks, occlusion, look, direction, beside, below)
                else:
                    at = vec3((x - 0.5 * width) * samples, (y - 0.5 * height) * samples, 1.0)
                    light = triangle_light(
                        keys,
                        blocks,
                        occlusion,
                        look,
                        points,
                        triangles,
                        normals,
                        colors,
                        thing,
                        at,
                        direction,
                        samples,
                    )
                # Developed before the mean, or a highlight's edge would look jagged; encoded after it.
                over = ti.max(light - KNEE, 0.0)
                picture += share / samples**2 * (ti.min(light, KNEE) + over / (1 + over / (1 - KNEE)))
        for k in ti.static(range(3)):
            index = ti.cast(ti.sqrt(ti.math.clamp(picture[k], 0.0, 1.0)) * (ENCODING_SIZE - 1) + 0.5, ti.i32)
            out[py, px, k] = ti.cast(ti.min(encoding[index] + grain(px, py), 255.0), ti.u8)
