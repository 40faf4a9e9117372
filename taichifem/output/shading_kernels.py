"""Kernels of the rasteriser: the light on what is seen, one pixel at a time, from the visibility buffer.

Linear light throughout; the encoding table makes sRGB of the mean. A pixel is shaded once for each thing
seen in it (triangle, ground or background), at the mean of the samples that see it, so that supersampling
costs only where something ends.
"""

from taichifem.output.colors import ENCODING_SIZE, KNEE
from taichifem.output.light_kernels import Look, Table, background, nearness_of_ground, ray, sky_left, sunlit, vec2
from taichifem.output.raster_kernels import (
    EMPTY,
    Corners,
    Grid,
    Keys,
    Points,
    Triangles,
    edge_functions,
    project,
    vec3,
    xyw,
)
from taichifem.runtime import ti

Pixels = ti.types.ndarray(dtype=ti.u8, ndim=3)

LUMINANCE = vec3(0.2126, 0.7152, 0.0722)
GROUND = -1
BACKGROUND = -2


@ti.func
def line_share(x: ti.f32, footprint: ti.f32, width: ti.f32) -> ti.f32:
    """How much of [x - footprint/2, x + footprint/2] lies on lines of `width` about the whole numbers."""
    a = x - 0.5 * footprint + 0.5 * width
    b = a + footprint
    below_a = ti.floor(a) * width + ti.min(a - ti.floor(a), width)
    below_b = ti.floor(b) * width + ti.min(b - ti.floor(b), width)
    return (below_b - below_a) / footprint


@ti.func
def ground_light(
    shadow: ti.template(),
    nearest: ti.template(),
    occlusion: ti.template(),
    look: ti.template(),
    reach: ti.template(),
    x: ti.f32,
    y: ti.f32,
    direction: vec3,
) -> vec3:
    """Light from the ground seen at pixel position (x, y)."""
    h = look.ground_view
    depth = 1 / (h[2, 0] * x + h[2, 1] * y + h[2, 2])
    u = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) * depth
    v = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) * depth
    away = (vec2(u, v) - look.middle).norm() / look.fade
    light = vec3(0.0)
    if away < 1.0:
        # How far one pixel reaches over the ground: the derivatives of u and v.
        wide_u = ti.abs(h[0, 0] - u * h[2, 0]) + ti.abs(h[0, 1] - u * h[2, 1])
        wide_v = ti.abs(h[1, 0] - v * h[2, 0]) + ti.abs(h[1, 1] - v * h[2, 1])
        scale = depth / look.spacing
        lines = ti.max(
            line_share(u / look.spacing, ti.math.clamp(wide_u * scale, 1e-5, 1e3), 0.012),
            line_share(v / look.spacing, ti.math.clamp(wide_v * scale, 1e-5, 1e3), 0.012),
        )
        albedo = ti.math.mix(look.floor_color, look.line_color, lines)
        facing = ti.max(look.ground_normal.dot(look.to_light), 0.0)
        sun = sunlit(shadow, nearest, look, reach, look.eye + depth * direction, 0.5 * look.shadow_texel)
        light = albedo * (facing * sun * look.key + sky_left(occlusion, look, u, v) * look.sky)
    if away > 0.25:
        # The floor goes over into the background: no horizon, no end.
        light = ti.math.mix(light, background(look, direction), ti.math.smoothstep(0.25, 1.0, away))
    return light


@ti.func
def surface_light(
    shadow: ti.template(),
    nearest: ti.template(),
    occlusion: ti.template(),
    look: ti.template(),
    reach: ti.template(),
    p: vec3,
    direction: vec3,
    normal: vec3,
    albedo: vec3,
    thin: bool,
) -> vec3:
    """Light from a point p of a solid: key light with shadow, sky above, bounce from the ground below.

    thin: of a sheet, which the key light shines through, so that it is seen as well from behind.
    """
    view = -direction.normalized()
    n = ti.select(normal.dot(view) < 0, -normal, normal)
    if thin and n.dot(look.to_light) < 0:
        n = -n
    facing = n.dot(look.to_light)
    sun = 0.0
    if facing > 0:
        # Stepping off along the normal, the more the flatter the light, keeps a surface out of its own shadow.
        off = look.shadow_texel * (1.5 + 4.0 * (1 - facing))
        sun = sunlit(shadow, nearest, look, reach, p + off * n, look.shadow_texel)
    facing = ti.max(facing, 0.0)
    up = 0.5 + 0.5 * n[2]
    foot = p - look.ground
    left = sky_left(occlusion, look, foot.dot(look.ground_u), foot.dot(look.ground_v))
    bounce = look.floor_color * (0.35 + 0.65 * left) * left
    ambient = look.sky * ti.math.mix(0.62 * bounce, vec3(1.0, 1.0, 1.0), up)
    half = (look.to_light + view).normalized()
    shine = ti.max(n.dot(half), 0.0)
    for _ in ti.static(range(5)):
        shine *= shine
    rim = ti.math.clamp(1 - ti.abs(n.dot(view)), 0.0, 1.0)
    rim *= rim * rim
    fill = look.fill * ti.max(-n.dot(look.to_light) * 0.6 + ti.abs(n.dot(view)) * 0.4, 0.0)
    diffuse = albedo * (facing * sun * look.key + ambient + fill)
    return diffuse + 0.16 * shine * sun * look.key + 0.12 * rim * look.sky * up


@ti.func
def line_light(light: vec3, albedo: vec3) -> vec3:
    """Light of an edge drawn on a surface: darker than it, or lighter where that is too dark to tell."""
    dark = 1 - ti.math.smoothstep(0.035, 0.06, albedo.dot(LUMINANCE))
    return ti.math.mix(0.45 * light, light + 0.12, dark)


@ti.func
def triangle_light(
    shadow: ti.template(),
    nearest: ti.template(),
    occlusion: ti.template(),
    look: ti.template(),
    reach: ti.template(),
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
    light = surface_light(shadow, nearest, occlusion, look, reach, p, direction, normal, albedo, thing < look.thin)
    if thing < look.wired:
        slope = samples * ti.sqrt(ti.max(e[:, 0] ** 2 + e[:, 1] ** 2, 1e-30))
        line = ti.math.clamp(0.5 * look.wire_width + 0.5 - (across / slope).min(), 0.0, 1.0)
        if line > 0:
            corners = ti.Matrix.cols([xyw(project(view, a)), xyw(project(view, b)), xyw(project(view, c))])
            least = 1e9
            for k in ti.static(range(3)):
                if corners[2, k] > 0:
                    least = ti.min(least, e[k, :].dot(corners[:, k]) / (corners[2, k] * slope[k]))
            # Where triangles are hardly wider than lines, these would only darken.
            line *= ti.math.smoothstep(1.5, 6.0, least / look.wire_width)
            light = ti.math.mix(light, line_light(light, albedo), line)
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
    shadow: Table,
    nearest: Table,
    look: Look,
    points: Points,
    triangles: Triangles,
    normals: Corners,
    colors: Corners,
    occlusion: Grid,
    encoding: Table,
    out: Pixels,
    samples: ti.template(),
    reach: ti.template(),
):
    """Picture (height,width,3) from the keys of the camera's view (samples^2 a pixel).

    reach: of the soft edge of shadows, in texels of the shadow map, at most BLOCK/2.
    """
    height, width = out.shape[0], out.shape[1]
    for py, px in ti.ndrange(height, width):
        seen = ti.Vector([BACKGROUND] * samples**2)
        for s in ti.static(range(samples**2)):
            sx = px * samples + s % samples
            sy = py * samples + s // samples
            key = keys[sy * width * samples + sx]
            depth = ti.bit_cast(ti.cast(key >> 32, ti.i32), ti.f32)
            floor = nearness_of_ground(look, (sx + 0.5) / samples, (sy + 0.5) / samples)
            if key != ti.i64(EMPTY) and depth * floor <= 1:
                seen[s] = ti.cast(key & ti.i64(0x7FFFFFFF), ti.i32)
            elif floor > 0:
                seen[s] = GROUND
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
                    light = ground_light(shadow, nearest, occlusion, look, reach, x, y, direction)
                else:
                    at = vec3((x - 0.5 * width) * samples, (y - 0.5 * height) * samples, 1.0)
                    light = triangle_light(
                        shadow,
                        nearest,
                        occlusion,
                        look,
                        reach,
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
