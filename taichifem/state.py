"""Which fields the next steps depend on."""

from __future__ import annotations

from taichifem.description import Scene
from taichifem.integrators import HISTORY
from taichifem.laws import Laws

OF_NODES = ("x", "v", "v0", "past")
OF_ELEMENTS = ("rotation",)
PAST = ("past_x", "past_v")
PLASTIC = ("plastic", "hardened", "plastic_inverse")
SPRINGS = ("spring_share",)
PLASTIC_SPRINGS = ("spring_growth", "spring_hardened")
"""Of all scenes; where an integrator looks back; with plastic materials; with springs, which share the stiffness of an
edge as it was before anything split; with both."""


def node_fields(scene: Scene) -> tuple[str, ...]:
    """Names of the fields of the nodes."""
    return OF_NODES + (PAST if scene.integrator in HISTORY else ())


def element_fields(laws: Laws) -> tuple[str, ...]:
    """Names of the fields of the elements."""
    of_springs = (SPRINGS if laws.springs else ()) + (PLASTIC_SPRINGS if laws.plastic and laws.springs else ())
    return OF_ELEMENTS + (PLASTIC if laws.plastic else ()) + of_springs
