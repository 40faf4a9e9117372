"""The default renderer: a small rasteriser in Taichi kernels, on the arch the simulation runs on.

Three views are drawn at once into one visibility buffer: the camera's, the key light's (the shadow map) and
one from under the ground, whose heights tell how much sky the ground sees. Then every pixel is shaded once.
"""

from __future__ import annotations

import numpy as np

from taichifem import runtime
from taichifem.description.view import Camera
from taichifem.output import colors, raster_kernels, shading_kernels
from taichifem.output.camera import Framing, Viewpoint
from taichifem.output.frame import Frame, Shape, triangulate
from taichifem.output.overlay import annotate
from taichifem.runtime import ti

SHADOW_SIDE = 1024
UNDERSIDE = 64
"""Texels along the side of the shadow map and of the view from below."""

_CREASE = np.cos(np.radians([48.0, 32.0]))
"""Faces at more than the first angle keep a crease between them, at less than the second they are smooth."""

_KEY = np.array([1.0, 0.93, 0.82]) * 1.18
_SKY = np.array([0.86, 0.94, 1.06]) * 0.46
_FILL = np.array([0.80, 0.90, 1.0]) * 0.16
_HORIZON = colors.light_shown_as(np.array([0.955, 0.962, 0.968]))
_ZENITH = colors.light_shown_as(np.array([0.80, 0.855, 0.91]))
_FLOOR = np.array([0.80, 0.80, 0.79])
_LINE = np.array([0.60, 0.62, 0.64])


class _Scratch:
    """Device memory of the kernels; shared by all renderers, as one draws at a time, and only ever grown."""

    def __init__(self) -> None:
        self.generation = -1
        self.arrays: dict[str, object] = {}

    def get(self, name: str, dtype: object, count: int) -> object:
        if self.generation != runtime.generation:  # Taichi was started anew: the old memory is gone
            self.generation, self.arrays = runtime.generation, {}
        array = self.arrays.get(name)
        if array is None or array.shape[0] < count:
            array = self.arrays[name] = ti.ndarray(dtype, shape=(1 << (count - 1).bit_length(),))
        return array


_scratch = _Scratch()


class Rasterizer:
    """Draws frames with soft shadow and anti-aliasing (quality "final") or without the latter ("draft")."""

    def __init__(
        self,
        size: tuple[int, int] = (1280, 720),
        camera: Camera | None = None,
        *,
        quality: str = "final",
        arch: str | None = None,
    ) -> None:
        self.size = size
        self.samples = 2 if quality == "final" else 1
        self._arch = arch
        self._framing = Framing(camera, size)
        self._light: np.ndarray | None = None
        self._topology: tuple[np.ndarray, int] | None = None
        self._fan_starts = self._fans = np.zeros(0, np.int32)
        self._encoding = colors.encoding_table()

    def draw(self, frame: Frame) -> np.ndarray:
        """The picture (height,width,3) uint8."""
        runtime.start(arch=self._arch)
        mesh = _Mesh(frame)
        viewpoint = self._framing.of(mesh.subject(frame.colliders))
        if self._light is None:
            # Over the left shoulder of whoever takes the first picture; then it stays when they move.
            flat = -viewpoint.forward * [1, 1, 0] + 1e-6 * viewpoint.up
            flat /= np.linalg.norm(flat)
            side = np.cross([0, 0, 1.0], flat)
            light = 0.55 * flat - 0.75 * side + np.array([0, 0, 1.25])
            self._light = light / np.linalg.norm(light)
        with runtime.precision_of("f32"):
            picture = self._render(mesh, frame, viewpoint)
        return annotate(picture, frame)

    def move(self, camera: Camera) -> None:
        """Look from `camera` from the next frame on."""
        self._framing.move(camera)

    def close(self) -> None:
        """Nothing to let go of: the memory serves the next renderer."""

    def _render(self, mesh: _Mesh, frame: Frame, viewpoint: Viewpoint) -> np.ndarray:
        width, height = self.size
        n = self.samples
        ground = _Ground(next((s for s in frame.colliders if s is mesh.floor), None), mesh, viewpoint)
        reach, middle = mesh.radius, mesh.center
        texel = 2 * reach / (SHADOW_SIDE - 16)
        matrices = [
            viewpoint.pixel_matrix(height * n),
            _light_matrix(self._light, middle, texel, reach),
        ]
        sizes = [(width * n, height * n), (SHADOW_SIDE, SHADOW_SIDE)]
        if ground.there:
            matrices.append(ground.matrix())
            sizes.append((UNDERSIDE, UNDERSIDE))
        matrices = np.stack(matrices).astype(np.float32)
        layout, pixels, tiles = _lay_out(sizes)

        count = len(mesh.triangles)
        keys = _scratch.get("keys", ti.i64, pixels)
        big = _scratch.get("big", ti.i32, 1 + 6 * count * len(sizes))
        raster_kernels.visibility(
            keys, pixels, big, matrices, layout, len(sizes), tiles, mesh.points, mesh.triangles, count
        )
        normals = self._normals(mesh)
        occlusion = np.zeros((UNDERSIDE, UNDERSIDE), np.float32)
        if ground.there:
            raster_kernels.ground_occlusion(
                keys,
                int(layout[2, 2]),
                ground.depth,
                ground.texel,
                1.5 * ground.texel,
                np.empty((1 + UNDERSIDE**2, 3), np.float32),
                occlusion,
            )
        blocks = _scratch.get("blocks", ti.i64, (SHADOW_SIDE // shading_kernels.BLOCK) ** 2)
        shading_kernels.nearest_blocks(keys, int(layout[1, 2]), SHADOW_SIDE, blocks)
        look = self._look(frame, viewpoint, ground, matrices, int(layout[1, 2]), texel)
        picture = np.empty((height, width, 3), np.uint8)
        shading_kernels.shade(
            keys,
            blocks,
            look,
            mesh.points,
            mesh.triangles,
            normals,
            mesh.colors,
            occlusion,
            self._encoding,
            picture,
            n,
        )
        return picture

    def _normals(self, mesh: _Mesh) -> np.ndarray:
        triangles, nodes = mesh.triangles, len(mesh.points)
        known = self._topology
        if known is None or known[1] != nodes or not np.array_equal(known[0], triangles):
            self._topology = (triangles, nodes)
            owners = triangles.ravel()
            self._fans = (np.argsort(owners, kind="stable") // 3).astype(np.int32)
            counts = np.bincount(owners, minlength=nodes)
            self._fan_starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        normals = np.zeros((len(triangles), 3, 3), np.float32)
        faces = np.zeros((len(triangles), 3), np.float32)
        raster_kernels.corner_normals(
            mesh.points,
            triangles,
            len(triangles) - 1,  # the last one is a placeholder, see _Mesh
            self._fan_starts,
            self._fans,
            faces,
            normals,
            *_CREASE,
        )
        return normals

    def _look(
        self,
        frame: Frame,
        viewpoint: Viewpoint,
        ground: _Ground,
        matrices: np.ndarray,
        light_start: int,
        texel: float,
    ) -> object:
        return shading_kernels.Look(
            eye=viewpoint.eye,
            right=viewpoint.right,
            up=viewpoint.up,
            forward=viewpoint.forward,
            focal=viewpoint.focal_pixels(self.size[1]),
            camera_view=matrices[0],
            light_view=matrices[1],
            light_side=SHADOW_SIDE,
            light_start=light_start,
            to_light=self._light,
            key=_KEY,
            sky=_SKY,
            fill=_FILL,
            horizon=_HORIZON,
            zenith=_ZENITH,
            has_ground=int(ground.there),
            ground=ground.origin,
            ground_u=ground.axes[0],
            ground_v=ground.axes[1],
            ground_normal=ground.axes[2],
            floor_color=_FLOOR,
            line_color=_LINE,
            spacing=ground.spacing,
            middle=ground.middle,
            fade=ground.fade,
            patch=ground.patch,
            patch_texel=ground.texel,
            shadow_texel=texel,
            wired=len(frame.triangles) if frame.wire else 0,
            wire_width=max(1.0, self.size[1] / 720),
        )


class _Mesh:
    """Bodies and colliders as one list of triangles, and the ball that holds what casts shadows."""

    def __init__(self, frame: Frame) -> None:
        planes = [s for s in frame.colliders if s.kind == "plane"]
        level = max(planes, key=lambda s: s.normal[2], default=None)
        self.floor: Shape | None = level if level is not None and level.normal[2] > 0.1 else None
        bodies = np.asarray(frame.points, np.float32).reshape(-1, 3)
        finite = bodies[np.isfinite(bodies).all(axis=1)]
        self.low, self.high = (finite.min(axis=0), finite.max(axis=0)) if len(finite) else np.zeros((2, 3))
        extent = max(float(np.linalg.norm(self.high - self.low)), 1e-6)

        solids = [s for s in frame.colliders if s.kind != "plane"]
        grey = colors.to_linear(colors.parse_hex(colors.COLLIDER))
        points = [bodies]
        triangles = [np.asarray(frame.triangles, np.int32).reshape(-1, 3)]
        shades = [colors.to_linear(frame.corner_colors()).reshape(-1, 3, 3)]
        parts = [triangulate(s) for s in solids]
        parts += [_wall(s, self.low, self.high) for s in planes if s is not self.floor]
        held = [self.low, self.high]
        for more, faces in parts:
            triangles.append(faces + sum(len(p) for p in points))
            points.append(more)
            shades.append(np.broadcast_to(grey, (len(faces), 3, 3)))
            if np.linalg.norm(np.ptp(more, axis=0)) < 3 * extent:
                held += [more.min(axis=0), more.max(axis=0)]
        # One triangle of no extent at the end, so that no array is ever empty.
        points.append(np.zeros((1, 3), np.float32))
        triangles.append(np.full((1, 3), sum(len(p) for p in points) - 1, np.int32))
        shades.append(np.zeros((1, 3, 3), np.float32))
        self.points = np.ascontiguousarray(np.concatenate(points), np.float32)
        self.triangles = np.ascontiguousarray(np.concatenate(triangles), np.int32)
        self.colors = np.ascontiguousarray(np.concatenate(shades), np.float32)
        low, high = np.min(held, axis=0), np.max(held, axis=0)
        self.center = (low + high) / 2
        # In steps, so that the texels of the shadow map do not crawl while bodies bend.
        exact = max(float(np.linalg.norm(high - low)) / 2, 1e-6)
        self.radius = float(1.1 ** np.ceil(np.log(exact * 1.02) / np.log(1.1)))

    def subject(self, colliders: tuple[Shape, ...]) -> np.ndarray:
        """Points (n,3) that the picture should show: bodies, small colliders, the ground just below."""
        corners = np.array([self.center + self.radius * np.array(d) for d in ((0.6, 0, 0), (-0.6, 0, 0))], float)
        bodies = np.array(np.meshgrid(*zip(self.low, self.high, strict=True))).reshape(3, -1).T
        shown = [bodies, corners[:0]]
        extent = float(np.linalg.norm(self.high - self.low))
        for shape in colliders:
            if shape.kind != "plane":
                points, _ = triangulate(shape)
                if np.linalg.norm(np.ptp(points, axis=0)) < 3 * extent:
                    shown.append(points)
        if self.floor is not None:
            height = (bodies - self.floor.center) @ self.floor.normal
            drop = np.clip(height, 0, 1.5 * extent)
            shown.append(bodies - drop[:, None] * self.floor.normal)
        return np.concatenate(shown)


class _Ground:
    """The plane that carries the scene, with axes along it and what is drawn on it."""

    def __init__(self, floor: Shape | None, mesh: _Mesh, viewpoint: Viewpoint) -> None:
        self.there = floor is not None
        self.axes = np.eye(3) if floor is None else floor.rotation.T
        self.origin = np.zeros(3) if floor is None else np.asarray(floor.center, float)
        self.middle = self.axes[:2] @ (viewpoint.target - self.origin)
        self.fade = 3.2 * viewpoint.reach
        self.spacing = _round_down(0.24 * viewpoint.reach)
        # Twice as wide as the bodies: what hangs over the ground dims it all around.
        self.texel = 4 * mesh.radius / UNDERSIDE
        self._middle = self.axes[:2] @ (mesh.center - self.origin)
        self.patch = self._middle - 2 * mesh.radius
        self.depth = 8 * mesh.radius

    def matrix(self) -> np.ndarray:
        """The view (4,4) from below; the ground lies at `depth`, so that what sank in still counts."""
        u, v, normal = self.axes
        rows = np.stack([u / self.texel, v / self.texel, np.zeros(3), normal])
        shift = -rows @ self.origin
        shift[:2] -= self._middle / self.texel
        return np.column_stack([rows, shift + [0, 0, 1, self.depth]])


def _round_down(length: float) -> float:
    power = 10.0 ** np.floor(np.log10(max(length, 1e-9)))
    return power * next(s for s in (5, 2, 1) if s * power <= length * 1.0001)


def _light_matrix(to_light: np.ndarray, middle: np.ndarray, texel: float, reach: float) -> np.ndarray:
    right = np.cross([0.0, 1.0, 0.0], to_light)
    right /= np.linalg.norm(right)
    up = np.cross(to_light, right)
    rows = np.stack([right / texel, up / texel, np.zeros(3), -to_light])
    shift = -rows @ middle
    # Whole texels, so that the map moves with the bodies without its grid sliding over them.
    shift[:2] = np.round(shift[:2])
    return np.column_stack([rows, shift + [0, 0, 1, 8 * reach]])


def _lay_out(sizes: list[tuple[int, int]]) -> tuple[np.ndarray, int, int]:
    rows, pixels, tiles = [], 0, 0
    tile = raster_kernels.TILE
    for width, height in sizes:
        rows.append((width, height, pixels, tiles))
        pixels += width * height
        tiles += -(-width // tile) * -(-height // tile)
    return np.array(rows, np.int32), pixels, tiles


def _wall(plane: Shape, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A square of a plane that is not the ground, behind the bodies."""
    middle, half = (low + high) / 2, float(np.linalg.norm(high - low))
    foot = middle - ((middle - plane.center) @ plane.normal) * plane.normal
    u, v = plane.rotation[:, 0] * half, plane.rotation[:, 1] * half
    points = np.stack([foot - u - v, foot + u - v, foot + u + v, foot - u + v])
    return points.astype(np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
