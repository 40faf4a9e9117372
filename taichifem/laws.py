"""Which elastic laws a scene uses, and the loops over all its elements: one kernel for each law, no more."""

from __future__ import annotations

from collections.abc import Sequence

from taichifem import elements, isotropic_elements, spring_elements
from taichifem.description import Material
from taichifem.formulas.models import MODELS, invertible
from taichifem.world import Counts, World

ROTATION_ITERATIONS = 400
"""A bound that only nearly degenerate inverted elements come near: one or two iterations are usual."""

FAST = {elements.LINEAR, elements.COROTATIONAL, elements.QUICK}
"""The models that share the loops of `elements`."""


class Laws:
    """The laws of some materials, numbered as the material table has them.

    Linear and corotational elements share a fast kernel; every isotropic law has its own.
    exact: corotational elements take that road too, for the exact tangent that Newton's method wants; the fast one
    has the warped stiffness R K R^T, which leaves out how R turns.
    """

    def __init__(self, materials: Sequence[Material], *, exact: bool = False) -> None:
        self._numbers = {
            ("linear",): elements.LINEAR,
            ("corotational", "qr"): elements.QUICK,
            ("mass-spring",): elements.SPRINGS,
        }
        if not exact:
            self._numbers["corotational",] = elements.COROTATIONAL
        self._laws: list[tuple[int, object]] = []
        self._used: set[int] = set()
        for material in materials:
            self._used.add(self.number(material))

    def number(self, material: Material) -> int:
        """The model number of a material; a law that is new to the scene gets the next one."""
        key = _key(material)
        if key not in self._numbers:
            law = MODELS[key[0]] if len(key) == 1 else invertible.wrap(MODELS[key[0]], key[1])
            self._numbers[key] = elements.FIRST_LAW + len(self._laws)
            self._laws.append((self._numbers[key], law))
        return self._numbers[key]

    def knows(self, material: Material) -> bool:
        """Has the scene a kernel for this material?"""
        number = self._numbers.get(_key(material), -1)
        return number in self._used or (number in FAST and bool(self._used & FAST))

    @property
    def springs(self) -> bool:
        """Are there elements made of springs?"""
        return elements.SPRINGS in self._used

    @property
    def stores_tangents(self) -> bool:
        """Do elements keep their stiffness blocks? Isotropic laws and springs do."""
        return bool(self._laws) or self.springs

    @property
    def linear(self) -> bool:
        """Is the force of every element linear in its displacement?"""
        return self._used == {elements.LINEAR}

    def deform(
        self,
        w: World,
        counts: Counts,
        *,
        stiffness: float,
        damping: float = 0.0,
        rate: float = 0.0,
        rate_damping: float = 0.0,
        projected: bool = True,
        keep: bool = False,
    ) -> None:
        """Corner forces and what assembly needs, at `w.x` and `w.v`; see `elements.deform`."""
        factors = stiffness, damping, rate, rate_damping
        if self._used & FAST:
            elements.deform(w, counts.elements, *factors, ROTATION_ITERATIONS, keep)
        if self.springs:
            spring_elements.stretch(w, counts.elements, *factors, projected)
        if self._laws:
            isotropic_elements.decompose(w, counts.elements, ROTATION_ITERATIONS, keep)
            for number, law in self._laws:
                isotropic_elements.respond(w, law, number, counts.elements, *factors, projected)
            isotropic_elements.store_blocks(w, counts.elements)

    def push(self, w: World, counts: Counts, *, damped: bool) -> None:
        """Corner forces alone, with those of stiffness damping if `damped`: what an explicit step needs."""
        rate_damping = float(damped)
        if self._used & FAST:
            elements.deform(w, counts.elements, 0.0, 0.0, 0.0, rate_damping, ROTATION_ITERATIONS, True)
        if self.springs:
            spring_elements.stretch(w, counts.elements, 0.0, 0.0, 0.0, rate_damping, True)
        if self._laws:
            isotropic_elements.decompose(w, counts.elements, ROTATION_ITERATIONS, True)
            for number, law in self._laws:
                if damped:
                    isotropic_elements.respond(w, law, number, counts.elements, 0.0, 0.0, 0.0, rate_damping, True)
                else:
                    isotropic_elements.push(w, law, number, counts.elements)

    def measure(self, w: World, counts: Counts) -> None:
        """Cauchy stress and elastic energy of every element."""
        if self._used & FAST:
            elements.measure(w, counts.elements, ROTATION_ITERATIONS)
        if self.springs:
            spring_elements.measure(w, counts.elements)
        if self._laws:
            isotropic_elements.decompose(w, counts.elements, ROTATION_ITERATIONS, False)
            for number, law in self._laws:
                isotropic_elements.measure(w, law, number, counts.elements)


def _key(material: Material) -> tuple:
    if material.model == "invertible":
        return material.wraps, material.threshold
    if material.model == "corotational" and material.rotation == "qr":
        return "corotational", "qr"
    return (material.model,)
