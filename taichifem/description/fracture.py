"""When a material breaks."""

from __future__ import annotations

from dataclasses import dataclass

from taichifem.description import check
from taichifem.errors import InputError

CRITERIA = ("principal-stress", "separation-tensor")


@dataclass(frozen=True, kw_only=True)
class Fracture:
    """A material that breaks where what pulls it apart exceeds its toughness.

    toughness: [Pa], above 0; the stress is that of the elastic part of the strain.
    criterion: what is held against it: "principal-stress", the largest of an element, across which one of its vertices
    is split (slides 35 to 43); or "separation-tensor", for each vertex, of the forces with which the elements around
    pull and press it (O'Brien & Hodgins 1999): dearer, and cracks are straighter where stress is concentrated.
    smoothing: how many times the stress of each element is replaced first by that of its neighbourhood, the mean over
    its vertices of the mean, by volume, of the elements around them. 0 takes it as it is. "separation-tensor" looks at
    neighbourhoods anyway, and has none.
    Raises InputError for values outside these bounds.
    """

    toughness: float
    criterion: str = "principal-stress"
    smoothing: int = 0

    def __post_init__(self) -> None:
        check.number("toughness", self.toughness, above=0, unit="Pa")
        check.choice("criterion", self.criterion, CRITERIA)
        if check.whole("smoothing", self.smoothing, at_least=0) and self.criterion != "principal-stress":
            raise InputError(
                f'smoothing belongs to "principal-stress", and the criterion is {self.criterion!r}: drop it'
            )
