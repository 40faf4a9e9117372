"""Rigid obstacles, at rest or moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.description import check
from taichifem.description.motion import Motion
from taichifem.errors import InputError


@dataclass(frozen=True, kw_only=True)
class PlaneCollider:
    """A half space: everything behind `point` against `normal` is solid. The default is the ground z = 0.

    friction: Coulomb coefficient, at least 0.  motion: moves the collider (None: at rest).
    """

    point: check.Vector = (0.0, 0.0, 0.0)
    normal: check.Vector = (0.0, 0.0, 1.0)
    friction: float = 0.5
    motion: Motion | None = None

    def __post_init__(self) -> None:
        check.vector("point", self.point, unit="m")
        if not np.linalg.norm(check.vector("normal", self.normal)) > 0:
            raise InputError("normal is (0, 0, 0): give a direction")
        check.number("friction", self.friction, at_least=0)


@dataclass(frozen=True, kw_only=True)
class SphereCollider:
    """A solid ball of `radius` about `center` [m]."""

    center: check.Vector
    radius: float
    friction: float = 0.5
    motion: Motion | None = None

    def __post_init__(self) -> None:
        check.vector("center", self.center, unit="m")
        check.number("radius", self.radius, above=0, unit="m")
        check.number("friction", self.friction, at_least=0)


@dataclass(frozen=True, kw_only=True)
class BoxCollider:
    """A solid box of full `size` about `center` [m], turned by `angle` [degrees] about `axis`."""

    center: check.Vector
    size: check.Vector
    axis: check.Vector = (0.0, 0.0, 1.0)
    angle: float = 0.0
    friction: float = 0.5
    motion: Motion | None = None

    def __post_init__(self) -> None:
        check.vector("center", self.center, unit="m")
        if min(check.vector("size", self.size, unit="m")) <= 0:
            raise InputError(f"size {self.size} must be above 0 in every direction [m]")
        if not np.linalg.norm(check.vector("axis", self.axis)) > 0:
            raise InputError("axis is (0, 0, 0): give a direction")
        check.number("angle", self.angle, unit="degrees")
        check.number("friction", self.friction, at_least=0)


Collider = PlaneCollider | SphereCollider | BoxCollider
