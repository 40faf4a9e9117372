"""Light in the rasteriser: what is known of a picture, what of the key light and of the sky reaches a point."""

from taichifem.output.raster_kernels import EMPTY, Keys, mat3, mat4, project, vec3
from taichifem.runtime import ti

vec2 = ti.types.vector(2, ti.f32)
Table = ti.types.ndarray(dtype=ti.f32, ndim=1)

BLOCK = 8
"""Texels of the shadow map along the side of a block whose nearest depth is kept."""
NOTHING = 1e30
"""Depth where the light meets nothing."""

Look = ti.types.struct(
    eye=vec3,
    right=vec3,
    up=vec3,
    forward=vec3,
    focal=ti.f32,  # pixels
    camera_view=mat4,
    light_view=mat4,
    light_side=ti.i32,  # texels
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
    ground_view=mat3,  # takes pixel position (x, y, 1) to (u, v, 1) / depth
    floor_color=vec3,
    line_color=vec3,
    spacing=ti.f32,  # of the lines on the ground [m]
    middle=vec2,  # of the picture's subject on the ground, along u and v [m]
    fade=ti.f32,  # distance over which the ground goes into the background [m]
    patch=vec2,  # first corner of the occlusion grid, along u and v [m]
    patch_texel=ti.f32,  # [m]
    shadow_texel=ti.f32,  # [m]
    thin=ti.i32,  # triangles below this number are lit from both sides
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
def nearness_of_ground(look: ti.template(), x: ti.f32, y: ti.f32) -> ti.f32:
    """One over the depth at which the ray through pixel position (x, y) meets the ground; below 0: never."""
    h = look.ground_view
    return ti.select(look.has_ground == 1, h[2, 0] * x + h[2, 1] * y + h[2, 2], -1.0)


@ti.kernel
def shadow_map(keys: Keys, start: ti.i32, side: ti.i32, depths: Table, nearest: Table):
    """Depths (side^2) of the light's view, and the nearest depth in each block, (side/BLOCK)^2.

    Most of the floor has nothing above it, and a look at a few blocks tells so. Depths alone are half as much
    memory to walk through as keys.
    """
    blocks = side // BLOCK
    for i in range(blocks * blocks):
        corner = (i // blocks * side + i % blocks) * BLOCK
        closest = NOTHING
        for y in range(BLOCK):
            for x in range(BLOCK):
                at = corner + y * side + x
                key = keys[start + at]
                depth = ti.bit_cast(ti.cast(key >> 32, ti.i32), ti.f32)
                if key == ti.i64(EMPTY):
                    depth = NOTHING
                depths[at] = depth
                closest = ti.min(closest, depth)
        nearest[i] = closest


@ti.func
def sunlit(
    shadow: ti.template(), nearest: ti.template(), look: ti.template(), reach: ti.template(), p: vec3, slack: ti.f32
) -> ti.f32:
    """Share of the key light at p: a tent-weighted mean over (2 reach)^2 texels of the shadow map."""
    light = 1.0
    side = look.light_side
    q = project(look.light_view, p)
    x = q[0] + 0.5 * side - 0.5
    y = q[1] + 0.5 * side - 0.5
    ix = ti.cast(ti.floor(x), ti.i32)
    iy = ti.cast(ti.floor(y), ti.i32)
    if ix >= reach and iy >= reach and ix < side - reach and iy < side - reach:
        limit = q[3] - slack
        across = side // BLOCK
        x0, x1 = (ix + 1 - reach) // BLOCK, (ix + reach) // BLOCK
        y0, y1 = (iy + 1 - reach) // BLOCK * across, (iy + reach) // BLOCK * across
        closest = ti.min(nearest[y0 + x0], nearest[y0 + x1], nearest[y1 + x0], nearest[y1 + x1])
        if closest < limit:
            fx = x - ti.floor(x)
            fy = y - ti.floor(y)
            total = 0.0
            for j in range(1 - reach, reach + 1):
                row = 0.0
                at = (iy + j) * side + ix
                for i in ti.static(range(1 - reach, reach + 1)):
                    row += ti.select(shadow[at + i] >= limit, reach - ti.abs(i - fx), 0.0)
                total += row * (reach - ti.abs(j - fy))
            light = total / reach**4
    return light


@ti.func
def sky_left(occlusion: ti.template(), look: ti.template(), u: ti.f32, v: ti.f32) -> ti.f32:
    """Share of the sky seen from the ground at (u, v), between the texels of the occlusion grid."""
    side = occlusion.shape[0]
    x = (u - look.patch[0]) / look.patch_texel - 0.5
    y = (v - look.patch[1]) / look.patch_texel - 0.5
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
def background(look: ti.template(), direction: vec3) -> vec3:
    rise = direction.normalized()[2]
    return ti.math.mix(look.horizon, look.zenith, ti.math.smoothstep(-0.1, 0.7, rise))
