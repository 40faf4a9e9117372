"""Prescribed rigid motions over time, for pins, handles and colliders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from taichifem.description import check
from taichifem.errors import InputError


def rotation_matrix(axis: Sequence[float], degrees: float) -> np.ndarray:
    """Rotation (3,3) about `axis` by `degrees` (Rodrigues)."""
    a = np.asarray(axis, dtype=float)
    a = a / np.linalg.norm(a)
    angle = np.radians(degrees)
    cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A rigid motion given by key frames: x(t) = center + R(t) (X - center) + translation(t).

    times: key times [s], increasing, the first usually 0.
    translation: one vector [m] per time (may be left out: no translation).
    angle: one angle [degrees] per time about `axis` through `center` (may be left out: no turn).
    center: centre of rotation [m], in world coordinates.
    smooth: ease in and out between key frames, otherwise move at constant speed.
    repeat: start again after the last time; otherwise the last pose is held.
    """

    times: Sequence[float] = (0.0,)
    translation: Sequence[check.Vector] = ()
    angle: Sequence[float] = ()
    axis: check.Vector = (0.0, 0.0, 1.0)
    center: check.Vector = (0.0, 0.0, 0.0)
    smooth: bool = False
    repeat: bool = False

    def __post_init__(self) -> None:
        times = check.numbers("times", self.times)
        if not times or any(b <= a for a, b in pairwise(times)):
            raise InputError(f"times {list(times)} must increase, with at least one entry")
        for name, keys in (("translation", self.translation), ("angle", self.angle)):
            if len(keys) not in (0, len(times)):
                raise InputError(f"{name} has {len(keys)} entries for {len(times)} times: give one for each time")
        for k, vector in enumerate(self.translation):
            check.vector(f"translation[{k}]", vector, unit="m")
        check.numbers("angle", self.angle)
        if not np.linalg.norm(check.vector("axis", self.axis)) > 0:
            raise InputError("axis is (0, 0, 0): give a direction")
        check.vector("center", self.center, unit="m")
        if self.repeat and len(times) < 2:
            raise InputError("repeat needs at least two times")

    @property
    def fastest_turn(self) -> float:
        """Greatest angular speed on the way [degrees/s]."""
        speed = np.abs(np.diff(self.angle)) / np.diff(self.times) if len(self.angle) > 1 else np.zeros(1)
        return float(speed.max()) * (1.5 if self.smooth else 1.0)

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Rotation R (3,3) and offset c (3,) [m] at `time` [s], so that x = R X + c."""
        times = np.asarray(self.times, dtype=float)
        if self.repeat and time > times[0]:
            time = times[0] + (time - times[0]) % (times[-1] - times[0])
        k = int(np.clip(np.searchsorted(times, time) - 1, 0, max(len(times) - 2, 0)))
        span = times[min(k + 1, len(times) - 1)] - times[k]
        s = float(np.clip((time - times[k]) / span, 0, 1)) if span > 0 else 0.0
        if self.smooth:
            s = s * s * (3 - 2 * s)

        def between(keys: Sequence, default: object) -> np.ndarray:
            if not len(keys):
                return np.asarray(default, dtype=float)
            a, b = np.asarray(keys[k], dtype=float), np.asarray(keys[min(k + 1, len(keys) - 1)], dtype=float)
            return a + s * (b - a)

        rotation = rotation_matrix(self.axis, float(between(self.angle, 0.0)))
        center = np.asarray(self.center, dtype=float)
        return rotation, center - rotation @ center + between(self.translation, (0.0, 0.0, 0.0))
