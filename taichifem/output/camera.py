"""Where a picture is taken from: pinhole geometry, and a viewpoint chosen so that everything is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from taichifem.description.view import Camera

_THREE_QUARTER = (0.62, -0.72, 0.34)
_MARGIN = 1.22
"""Room left around what is there at first: it will move."""


@dataclass(frozen=True)
class Viewpoint:
    """A pinhole camera in place.

    eye: (3,) [m].  right, up, forward: orthonormal (3,).  focal: half a picture height at depth 1.
    reach: distance [m] from the eye to what it looks at.
    """

    eye: np.ndarray
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    fov: float
    reach: float

    @classmethod
    def looking(cls, eye: np.ndarray, target: np.ndarray, fov: float) -> Viewpoint:
        """At `eye` looking at `target` [m], z up, with vertical field of view `fov` [degrees]."""
        eye, target = np.asarray(eye, float), np.asarray(target, float)
        reach = float(np.linalg.norm(target - eye))
        forward = (target - eye) / reach
        # Looking along z, "up" in the picture is taken to be y.
        sky = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.9999 else np.array([0.0, 1.0, 0.0])
        right = np.cross(forward, sky)
        right /= np.linalg.norm(right)
        return cls(eye, right, np.cross(right, forward), forward, fov, reach)

    def focal_pixels(self, height: int) -> float:
        """Distance from the eye to the picture plane, in pixels of a picture `height` pixels high."""
        return 0.5 * height / np.tan(np.radians(self.fov) / 2)

    @property
    def target(self) -> np.ndarray:
        """The point looked at (3,) [m]."""
        return self.eye + self.reach * self.forward

    def pixel_matrix(self, height: int) -> np.ndarray:
        """Matrix (4,4) taking (x, y, z, 1) to (X, Y, w, depth).

        (X/w, Y/w) are pixels right of and below the middle of the picture; depth is along the view [m].
        """
        f = self.focal_pixels(height)
        rows = np.stack([f * self.right, -f * self.up, self.forward, self.forward])
        return np.column_stack([rows, -rows @ self.eye])

    def project(self, points: np.ndarray, size: tuple[int, int]) -> np.ndarray:
        """Pixel coordinates (n,2) from the top left and depth [m], together (n,3), of `points` (n,3) [m]."""
        width, height = size
        m = self.pixel_matrix(height)
        p = np.asarray(points, float) @ m[:, :3].T + m[:, 3]
        return np.column_stack([p[:, 0] / p[:, 2] + width / 2, p[:, 1] / p[:, 2] + height / 2, p[:, 3]])


def frame_points(points: np.ndarray, camera: Camera, size: tuple[int, int]) -> Viewpoint:
    """A viewpoint for `camera` that shows all `points` (n,3) [m] in a picture of `size` (width, height).

    What the camera says is kept; what it leaves open is chosen: a three-quarter view from a little above.
    """
    points = np.asarray(points, float)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        points = np.zeros((1, 3))
    low, high = points.min(axis=0), points.max(axis=0)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    cloud = points if len(points) < 20_000 else corners
    size_of_scene = max(float(np.linalg.norm(high - low)), 1e-6)

    target = (low + high) / 2 if camera.target is None else np.asarray(camera.target, float)
    if camera.eye is not None:
        eye = np.asarray(camera.eye, float)
        if np.allclose(eye, target):
            target = target - np.array([0, 0, size_of_scene])
        return Viewpoint.looking(eye, target, camera.fov)

    direction = np.array(_THREE_QUARTER) / np.linalg.norm(_THREE_QUARTER)
    half = np.tan(np.radians(camera.fov) / 2) / _MARGIN
    slopes = np.array([half * size[0] / size[1], half])
    for _ in range(4):
        axes = Viewpoint.looking(target + direction, target, camera.fov)
        local = (cloud - target) @ np.stack([axes.right, axes.up, -axes.forward]).T
        if camera.target is None:
            # Middle of the picture, not of the box: the extremes seen under perspective, halved.
            distance = (np.abs(local[:, :2]) / slopes + local[:, 2:]).max()
            seen = local[:, :2] / (distance - local[:, 2:])
            shift = 0.5 * (seen.min(axis=0) + seen.max(axis=0)) * distance
            target = target + shift[0] * axes.right + shift[1] * axes.up
            local = (cloud - target) @ np.stack([axes.right, axes.up, -axes.forward]).T
        distance = max((np.abs(local[:, :2]) / slopes + local[:, 2:]).max(), 0.05 * size_of_scene)
    return Viewpoint.looking(target + distance * direction, target, camera.fov)


class Framing:
    """A viewpoint chosen at the first frame and kept, so that a video does not jitter."""

    def __init__(self, camera: Camera | None, size: tuple[int, int]) -> None:
        self.camera = camera or Camera()
        self.size = size
        self._viewpoint: Viewpoint | None = None

    def of(self, points: Callable[[], np.ndarray]) -> Viewpoint:
        """The viewpoint; the first call chooses it so that `points()` (n,3) [m] are seen."""
        if self._viewpoint is None:
            self._viewpoint = frame_points(points(), self.camera, self.size)
        return self._viewpoint

    def move(self, camera: Camera) -> None:
        """Look from `camera` from the next frame on (a person orbits the live view)."""
        self.camera, self._viewpoint = camera, None
