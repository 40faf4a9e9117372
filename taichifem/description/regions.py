"""Ways to say which nodes: each region selects indices out of rest positions in world coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichifem.description import check
from taichifem.errors import InputError


@dataclass(frozen=True, kw_only=True)
class BoxRegion:
    """Nodes inside the axis-aligned box between the corners `lower` and `upper` [m]."""

    lower: check.Vector
    upper: check.Vector

    def __post_init__(self) -> None:
        lower, upper = (
            check.vector("lower", self.lower, unit="m"),
            check.vector("upper", self.upper, unit="m"),
        )
        if any(a > b for a, b in zip(lower, upper, strict=True)):
            raise InputError(f"box region: lower {lower} lies above upper {upper}: exchange them")

    def select(self, points: np.ndarray) -> np.ndarray:
        """Indices of the points (n,3) in the box."""
        return np.flatnonzero(((points >= self.lower) & (points <= self.upper)).all(axis=1))


@dataclass(frozen=True, kw_only=True)
class SphereRegion:
    """Nodes within `radius` of `center` [m]."""

    center: check.Vector
    radius: float

    def __post_init__(self) -> None:
        check.vector("center", self.center, unit="m")
        check.number("radius", self.radius, above=0, unit="m")

    def select(self, points: np.ndarray) -> np.ndarray:
        """Indices of the points (n,3) in the ball."""
        return np.flatnonzero(((points - np.asarray(self.center)) ** 2).sum(axis=1) <= self.radius**2)


@dataclass(frozen=True, kw_only=True)
class IndexRegion:
    """Nodes by their index in the body's mesh, from 0."""

    indices: Sequence[int]

    def __post_init__(self) -> None:
        for k, index in enumerate(self.indices):
            if check.whole(f"indices[{k}]", index, at_least=0) >= 2**31:
                raise InputError(f"indices[{k}] is {index}: no mesh has so many nodes")

    def select(self, points: np.ndarray) -> np.ndarray:
        """The indices themselves. Raises InputError if one is outside the mesh."""
        chosen = np.unique(np.asarray(self.indices, dtype=np.int64))
        if len(chosen) and chosen[-1] >= len(points):
            raise InputError(f"index region: node {chosen[-1]} is outside the mesh of {len(points)} nodes")
        return chosen


@dataclass(frozen=True, kw_only=True)
class NearestRegion:
    """The `count` nodes nearest to `point` [m]."""

    point: check.Vector
    count: int = 1

    def __post_init__(self) -> None:
        check.vector("point", self.point, unit="m")
        check.whole("count", self.count)

    def select(self, points: np.ndarray) -> np.ndarray:
        """Indices of the nearest points (n,3), lowest index first among equals."""
        distance = ((points - np.asarray(self.point)) ** 2).sum(axis=1)
        return np.sort(np.argsort(distance, kind="stable")[: self.count])


Region = BoxRegion | SphereRegion | IndexRegion | NearestRegion
