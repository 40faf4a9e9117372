"""Which fields the next steps depend on."""

from __future__ import annotations

from taichifem.description import Scene
from taichifem.integrators import HISTORY
from taichifem.laws import Laws

OF_NODES = ("x", "v", "v0", "past")
OF_ELEMENTS = ("rotation",)
PAST = ("past_x", "past_v")
PLASTIC = ("plastic", "hardened", "plastic_inverse")
SPRINGS = ("spring_growth", "spring_hardened")
"""Of all scenes; where an integrator looks back; with plastic materials, and springs among them."""


def node_fields(scene: Scene) -> tuple[str, ...]:
    """Names of the fields of the nodes."""
    return OF_NODES + (PAST if scene.integrator in HISTORY else ())


def element_fields(laws: Laws) -> tuple[str, ...]:
    """Names of the fields of the elements."""
    return OF_ELEMENTS + (PLASTIC if laws.plastic else ()) + (SPRINGS if laws.plastic and laws.springs else ())
