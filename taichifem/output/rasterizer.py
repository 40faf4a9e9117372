"""The default renderer: a small rasteriser in Taichi kernels, on the arch the simulation runs on.

Three views are drawn at once into one visibility buffer: the camera's, the key light's (the shadow map) and
one from under the ground, whose heights tell how much sky the ground sees. Then every pixel is shaded once.
"""

from __future__ import annotations

import numpy as np

from taichifem import runtime
from taichifem.description.view import Camera
from taichifem.output import colors, light_kernels, raster_kernels, shading_kernels
from taichifem.output.camera import Framing, Viewpoint
from taichifem.output.frame import Frame
from taichifem.output.overlay import annotate
from taichifem.output.solids import CornerNormals, Solids
from taichifem.runtime import ti

UNDERSIDE = 64
"""Texels along the side of the view from below."""

_KEY = np.array([1.0, 0.93, 0.82]) * 1.18
_LIGHT, _LIGHT_ON_SHEETS = (0.55, -0.75, 1.25), (0.9, -0.55, 1.05)  # towards the viewer, to the left, up
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
        self._shadow_side = 512 * self.samples
        self._arch = arch
        self._framing = Framing(camera, size)
        self._light: np.ndarray | None = None
        self._normals = CornerNormals()
        self._encoding = colors.encoding_table()

    def draw(self, frame: Frame) -> np.ndarray:
        """The picture (height,width,3) uint8."""
        runtime.start(arch=self._arch)
        viewpoint = self._framing.of(lambda: Solids(frame).subject())
        solids = Solids(frame, viewpoint.eye)
        if self._light is None:
            # Over the left shoulder of whoever takes the first picture; then it stays when they move.
            flat = -viewpoint.forward * [1, 1, 0] + 1e-6 * viewpoint.up
            flat /= np.linalg.norm(flat)
            side = np.cross([0, 0, 1.0], flat)
            # What is flat has one shade all over: the light meets it more from the front.
            light = np.array(_LIGHT_ON_SHEETS if solids.flat else _LIGHT) @ [flat, side, [0, 0, 1]]
            self._light = light / np.linalg.norm(light)
        with runtime.precision_of("f32"):
            picture = self._render(solids, frame, viewpoint)
        return annotate(picture, frame)

    def move(self, camera: Camera) -> None:
        """Look from `camera` from the next frame on."""
        self._framing.move(camera)

    def close(self) -> None:
        """Nothing to let go of: the memory serves the next renderer."""

    def _render(self, solids: Solids, frame: Frame, viewpoint: Viewpoint) -> np.ndarray:
        width, height = self.size
        n = self.samples
        ground = _Ground(solids, viewpoint)
        reach, middle = solids.radius, solids.center
        texel = 2 * reach / (self._shadow_side - 16)
        matrices = [
            viewpoint.pixel_matrix(height * n),
            _light_matrix(self._light, middle, texel, reach),
        ]
        sizes = [(width * n, height * n), (self._shadow_side, self._shadow_side)]
        if ground.there:
            matrices.append(ground.matrix())
            sizes.append((UNDERSIDE, UNDERSIDE))
        matrices = np.stack(matrices).astype(np.float32)
        layout, pixels, tiles = _lay_out(sizes)

        count = len(solids.triangles)
        keys = _scratch.get("keys", ti.i64, pixels)
        big = _scratch.get("big", ti.i32, 1 + 6 * count * len(sizes))
        raster_kernels.visibility(
            keys, pixels, big, matrices, layout, len(sizes), tiles, solids.points, solids.triangles, count
        )
        normals = self._normals.of(solids)
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
        side = self._shadow_side
        shadow = _scratch.get("shadow", ti.f32, side**2)
        nearest = _scratch.get("nearest", ti.f32, (side // light_kernels.BLOCK) ** 2)
        light_kernels.shadow_map(keys, int(layout[1, 2]), side, shadow, nearest)
        look = self._look(frame, solids, viewpoint, ground, matrices, texel)
        picture = np.empty((height, width, 3), np.uint8)
        shading_kernels.shade(
            keys,
            shadow,
            nearest,
            look,
            solids.points,
            solids.triangles,
            normals,
            solids.colors,
            occlusion,
            self._encoding,
            picture,
            n,
            1 + n,
        )
        return picture

    def _look(
        self,
        frame: Frame,
        solids: Solids,
        viewpoint: Viewpoint,
        ground: _Ground,
        matrices: np.ndarray,
        texel: float,
    ) -> object:
        return light_kernels.Look(
            eye=viewpoint.eye,
            right=viewpoint.right,
            up=viewpoint.up,
            forward=viewpoint.forward,
            focal=viewpoint.focal_pixels(self.size[1]),
            camera_view=matrices[0],
            light_view=matrices[1],
            light_side=self._shadow_side,
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
            ground_view=ground.pixel_homography(viewpoint, self.size),
            floor_color=_FLOOR,
            line_color=_LINE,
            spacing=ground.spacing,
            middle=ground.middle,
            fade=ground.fade,
            patch=ground.patch,
            patch_texel=ground.texel,
            shadow_texel=texel,
            thin=len(frame.triangles) if solids.flat else 0,
            wired=len(frame.triangles) if frame.wire else 0,
            wire_width=max(1.0, self.size[1] / 720),
        )


class _Ground:
    """The plane that carries the scene, with axes along it and what is drawn on it."""

    def __init__(self, solids: Solids, viewpoint: Viewpoint) -> None:
        floor = solids.floor
        self.there = floor is not None
        self.axes = np.eye(3) if floor is None else floor.rotation.T
        self.origin = np.zeros(3) if floor is None else np.asarray(floor.center, float)
        self.middle = self.axes[:2] @ (viewpoint.target - self.origin)
        self.fade = 3.2 * viewpoint.reach
        self.spacing = _round_down(0.24 * viewpoint.reach)
        # Twice as wide as the bodies: what hangs over the ground dims it all around.
        self.texel = 4 * solids.radius / UNDERSIDE
        self._middle = self.axes[:2] @ (solids.center - self.origin)
        self.patch = self._middle - 2 * solids.radius
        self.depth = 8 * solids.radius

    def pixel_homography(self, viewpoint: Viewpoint, size: tuple[int, int]) -> np.ndarray:
        """Matrix (3,3) taking pixel position (x, y, 1) to (u, v, 1) / depth of the ground seen there.

        From below, the ground is not seen at all.
        """
        height = self.axes[2] @ (viewpoint.eye - self.origin)
        if not self.there or height <= 0:
            self.there = False
            return np.zeros((3, 3))
        f = viewpoint.focal_pixels(size[1])
        corner = viewpoint.forward + (-0.5 * size[0] * viewpoint.right + 0.5 * size[1] * viewpoint.up) / f
        rays = np.column_stack([viewpoint.right / f, -viewpoint.up / f, corner])
        along = self.axes @ rays
        nearness = -along[2] / height
        eye = self.axes[:2] @ (viewpoint.eye - self.origin)
        return np.vstack([along[:2] + eye[:, None] * nearness, nearness])

    def matrix(self) -> np.ndarray:
        """The view (4,4) from below; the ground lies at `depth`, so that what sank in still counts."""
        u, v, normal = self.axes
        rows = np.stack([u / self.texel, v / self.texel, np.zeros(3), normal])
        shift = -rows @ self.origin
        shift[:2] -= self._middle / self.texel
        return np.column_stack([rows, shift + np.array([0, 0, 1, self.depth])])


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
    return np.column_stack([rows, shift + np.array([0, 0, 1, 8 * reach])])


def _lay_out(sizes: list[tuple[int, int]]) -> tuple[np.ndarray, int, int]:
    rows, pixels, tiles = [], 0, 0
    tile = raster_kernels.TILE
    for width, height in sizes:
        rows.append((width, height, pixels, tiles))
        pixels += width * height
        tiles += -(-width // tile) * -(-height // tile)
    return np.array(rows, np.int32), pixels, tiles
