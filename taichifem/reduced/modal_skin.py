"""The points of a modal body that meet colliders, and those of them that may touch within a step.

Points are kept in clusters. How far the modes take a point of a cluster away from what they do to its middle is
bounded by their amplitudes, so that a ball around each cluster tells which points need to be worked out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

CLUSTER = 48
"""Points in a cluster, at most."""


@dataclass(frozen=True)
class Skin:
    """Points that ride on modes: places (s,3) [m] in the frame at rest, rows (3s,k) of the mode shapes.

    Where it says `state`: anything with a `frame` and amplitudes `q`, such as a Trial.
    """

    places: np.ndarray
    rows: np.ndarray

    def part(self, which: np.ndarray, real: type = float) -> Skin:
        """Some of the points (m,), in another precision."""
        rows = self.rows.reshape(len(self.places), 3, -1)[which].reshape(3 * len(which), -1)
        return Skin(self.places[which], rows.astype(real, copy=False))

    def at(self, state) -> np.ndarray:
        """Where the points are (s,3) [m]."""
        moved = self.places + (self.rows @ state.q.astype(self.rows.dtype)).reshape(-1, 3)
        return moved @ state.frame.rotation.T + state.frame.origin

    def levers(self, state) -> np.ndarray:
        """How the points move with the coordinates (s,3,r)."""
        shapes = self.rows.reshape(len(self.places), 3, -1)
        return np.concatenate([state.frame.levers(self.at(state)), state.frame.rotation @ shapes], axis=2)

    def velocities(self, state) -> np.ndarray:
        """(s,3) [m/s]; the state has the rates `v` too."""
        own = (self.rows @ state.v).reshape(-1, 3) @ state.frame.rotation.T
        return state.frame.velocity_at(self.at(state)) + own


class ClusteredSkin:
    """All points of a body, sorted by clusters: the same balls bound them, whatever the modes do.

    all: the points.
    """

    def __init__(self, places: np.ndarray, rows: np.ndarray, real: type) -> None:
        leaves = _split(places, np.arange(len(places)))
        order = np.concatenate(leaves)
        sizes = np.array([len(leaf) for leaf in leaves])
        places, rows = places[order], rows[order]
        self.all = Skin(places, np.ascontiguousarray(rows.reshape(3 * len(rows), -1), dtype=real))
        self._ends = np.cumsum(sizes)
        self._starts = self._ends - sizes
        self._cluster = np.repeat(np.arange(len(sizes)), sizes)
        middles = np.add.reduceat(places, self._starts) / sizes[:, None]
        mean = np.add.reduceat(rows, self._starts) / sizes[:, None, None]
        self._middles = Skin(middles, mean.reshape(3 * len(mean), -1))
        self._reach = np.maximum.reduceat(np.linalg.norm(places - middles[self._cluster], axis=1), self._starts)
        self._wander = np.maximum.reduceat(np.linalg.norm(rows - mean[self._cluster], axis=1), self._starts)
        self._centre = Skin(middles.mean(axis=0)[None], np.zeros((3, rows.shape[2])))
        self._radius = float(np.linalg.norm(places - self._centre.places, axis=1).max())
        self._farthest = np.linalg.norm(rows, axis=1).max(axis=0)

    def near(self, now, then, meets: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        """The points (m,) that may touch between two states: first the whole body is asked about, then clusters.

        meets: which balls (c,) may touch, for their centres (c,3) now and then, and their radii (c,), all in [m].
        """
        swing = max(float(np.abs(state.q) @ self._farthest) for state in (now, then))
        if not meets(self._centre.at(now), self._centre.at(then), np.array([self._radius + swing])).any():
            return np.zeros(0, dtype=int)
        radius = self._reach + self._wander @ np.maximum(np.abs(now.q), np.abs(then.q))
        close = meets(self._middles.at(now), self._middles.at(then), radius)
        return np.flatnonzero(close[self._cluster])


def _split(places: np.ndarray, points: np.ndarray) -> list[np.ndarray]:
    """Clusters of points, halved across their longest side until they are small."""
    if len(points) <= CLUSTER:
        return [points]
    axis = np.ptp(places[points], axis=0).argmax()
    order = points[np.argsort(places[points, axis], kind="stable")]
    half = len(order) // 2
    return _split(places, order[:half]) + _split(places, order[half:])
