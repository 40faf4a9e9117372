"""When a material breaks."""

from __future__ import annotations

from dataclasses import dataclass

from taichifem.description import check


@dataclass(frozen=True, kw_only=True)
class Fracture:
    """A material that breaks where the largest principal stress of an element exceeds its toughness (slides 35 to 43).

    toughness: [Pa], above 0; the stress is that of the elastic part of the strain.
    Raises InputError for values outside these bounds.
    """

    toughness: float

    def __post_init__(self) -> None:
        check.number("toughness", self.toughness, above=0, unit="Pa")
