"""Loads on a body: forces, tractions and pressures, which may come and go."""

from __future__ import annotations

from dataclasses import dataclass

from taichifem.description import check
from taichifem.description.regions import Region


@dataclass(frozen=True, kw_only=True)
class _Load:
    """When a load acts. start: time [s] it begins.  ramp: seconds it takes to grow to its full size.

    until: time [s] at which it ends; None keeps it for ever.
    A static solve takes loads at their full size.
    """

    region: Region
    start: float = 0.0
    ramp: float = 0.0
    until: float | None = None

    def __post_init__(self) -> None:
        check.number("start", self.start, at_least=0, unit="s")
        check.number("ramp", self.ramp, at_least=0, unit="s")
        if self.until is not None:
            check.number("until", self.until, above=self.start, unit="s")

    def share_at(self, time: float) -> float:
        """The part of the load, 0 to 1, that acts during the step that ends at `time` [s]."""
        if time <= self.start or (self.until is not None and time > self.until * (1 + 1e-9)):
            return 0.0
        return min(1.0, (time - self.start) / self.ramp) if self.ramp > 0 else 1.0


@dataclass(frozen=True, kw_only=True)
class Force(_Load):
    """A force [N] on the nodes of `region` (world coordinates at rest), shared equally among them."""

    force: check.Vector

    def __post_init__(self) -> None:
        super().__post_init__()
        check.vector("force", self.force, unit="N")


@dataclass(frozen=True, kw_only=True)
class Traction(_Load):
    """A force per area at rest [Pa] on the surface whose nodes all lie in `region`; its direction stays."""

    traction: check.Vector

    def __post_init__(self) -> None:
        super().__post_init__()
        check.vector("traction", self.traction, unit="Pa")


@dataclass(frozen=True, kw_only=True)
class Pressure(_Load):
    """A pressure [Pa] on the surface whose nodes all lie in `region`: it pushes inward and follows the surface."""

    pressure: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check.number("pressure", self.pressure, unit="Pa")


Load = Force | Traction | Pressure
