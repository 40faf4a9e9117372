"""Which elastic laws a scene uses, and the loops over all its elements: one kernel for each law, no more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from taichifem import elements, flowing_elements, isotropic_elements, spring_elements, yielding_elements
from taichifem.description import Material
from taichifem.description.fracture import CRITERIA
from taichifem.description.material import PLASTICITIES
from taichifem.formulas.models import MODELS, invertible
from taichifem.world import Counts, World

ROTATION_ITERATIONS = 400
"""A bound that only nearly degenerate inverted elements come near: one or two iterations are usual."""

ENDLESS = 1e30
"""Bound of a strain or a stress that has none."""

FAST = {elements.LINEAR, elements.COROTATIONAL, elements.QUICK}
YIELDING = {elements.YIELDING_LINEAR, elements.YIELDING, elements.YIELDING_GREEN}
"""The models that share the loops of `elements`, and those of `yielding_elements`."""


@dataclass(frozen=True)
class _Law:
    """An isotropic law of a scene: its number in the material table, its functions, and whether it flows."""

    number: int
    law: object
    plastic: bool

    @property
    def of(self) -> tuple[object, int]:
        return self.law, self.number


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
            ("mass-spring", "plastic"): elements.SPRINGS,
            ("stvk", "plastic"): elements.YIELDING_GREEN,
        }
        if exact:
            self._numbers["linear", "plastic"] = elements.YIELDING_LINEAR
            self._numbers["corotational", "plastic"] = elements.YIELDING
        else:
            self._numbers["corotational",] = elements.COROTATIONAL
            self._numbers["linear", "plastic"] = elements.LINEAR
            self._numbers["corotational", "plastic"] = elements.COROTATIONAL
        self._exact = exact
        self._laws: list[_Law] = []
        self._used: set[int] = set()
        self.plastic = any(m.plasticity != "none" for m in materials)
        for material in materials:
            self._used.add(self.number(material))

    def number(self, material: Material) -> int:
        """The model number of a material; a law that is new to the scene gets the next one."""
        key = _key(material)
        if key not in self._numbers:
            name, *threshold = key[:-1] if key[-1] == "plastic" else key
            law = invertible.wrap(MODELS[name], *threshold) if threshold else MODELS[name]
            self._numbers[key] = elements.FIRST_LAW + len(self._laws)
            self._laws.append(_Law(self._numbers[key], law, key[-1] == "plastic"))
        return self._numbers[key]

    def knows(self, material: Material) -> bool:
        """Has the scene a kernel for this material?"""
        if material.plasticity != "none" and not self.plastic:
            return False
        number = self._numbers.get(_key(material), -1)
        return number in self._used or (number in FAST and bool(self._used & FAST))

    def row(self, material: Material) -> list[float]:
        """Its row of the material table: the columns of `elements`."""
        m, kind = material, PLASTICITIES.index(material.plasticity)
        flow = [m.yield_stress or 0.0, m.hardening or 0.0, m.viscosity or 0.0]
        if m.plasticity == "creep":
            flow = [m.yield_strain, m.max_plastic_strain or ENDLESS, m.creep_rate]
        elastic = [m.lame_lambda, m.shear_modulus, m.mass_damping, m.stiffness_damping, m.density]
        pressed = m.compression_limit or flow[0]
        broken = [ENDLESS, 0.0, 0.0]
        if m.fracture:
            broken = [m.fracture.toughness, float(CRITERIA.index(m.fracture.criterion)), float(m.fracture.smoothing)]
        return [*elastic, float(self.number(m)), m.spring_stiffness or 0.0, float(kind), *flow, pressed, *broken]

    @property
    def springs(self) -> bool:
        """Are there elements made of springs?"""
        return elements.SPRINGS in self._used

    @property
    def stores_tangents(self) -> bool:
        """Do elements keep their stiffness blocks? Isotropic laws and springs do."""
        return bool(self._laws) or self.springs or self._yielding

    @property
    def _yielding(self) -> bool:
        return bool(self._used & YIELDING)

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
        due: float = 0.0,
        within: float = 0.0,
        projected: bool = True,
        keep: bool = False,
    ) -> None:
        """Corner forces and what assembly needs, at `w.x` and `w.v`; see `elements.deform`.

        within: time [s] over which what yields flows before it answers, where Newton's method is at work.
        """
        factors = stiffness, damping, rate, rate_damping
        within = within if self._exact else 0.0
        # Where what is due has just become plastic strain, it does not flow once more.
        span = within or (0.0 if keep else due)
        if self._used & FAST:
            elements.deform(w, counts.elements, *factors, due, ROTATION_ITERATIONS, keep)
        if self._yielding:
            self._yield(w, counts, *factors, due=due, span=span, keep=keep, projected=projected)
        if self.springs:
            spring_elements.stretch(w, counts.elements, *factors, due, within, keep, projected)
        if self._laws:
            self._decompose(w, counts, due if keep else 0.0, keep=keep)
            for law in self._laws:
                if law.plastic:
                    flowing_elements.respond(
                        w, law.law, span > 0, law.number, counts.elements, *factors, span, projected
                    )
                else:
                    isotropic_elements.respond(w, *law.of, counts.elements, *factors, projected)
        if self._laws or self._yielding:
            isotropic_elements.store_blocks(w, counts.elements)

    def _yield(self, w, counts, *factors: float, due: float, span: float, keep: bool, projected: bool) -> None:
        if due > 0 and keep:
            yielding_elements.settle(w, counts.elements, due, ROTATION_ITERATIONS, elements.YIELDING_LINEAR)
        yielding_elements.respond(w, counts.elements, *factors, span, ROTATION_ITERATIONS, keep, projected)

    def push(self, w: World, counts: Counts, *, damped: bool, due: float) -> None:
        """Corner forces alone, with those of stiffness damping if `damped`: what an explicit step needs."""
        rate_damping = float(damped)
        if self._used & FAST:
            elements.deform(w, counts.elements, 0.0, 0.0, 0.0, rate_damping, due, ROTATION_ITERATIONS, True)
        if self._yielding:
            factors = 0.0, 0.0, 0.0, rate_damping
            self._yield(w, counts, *factors, due=due, span=0.0, keep=True, projected=True)
        if self.springs:
            spring_elements.stretch(w, counts.elements, 0.0, 0.0, 0.0, rate_damping, due, 0.0, True, True)
        if self._laws:
            self._decompose(w, counts, due, keep=True)
            for law in self._laws:
                if law.plastic:
                    factors = 0.0, 0.0, 0.0, rate_damping
                    flowing_elements.respond(w, law.law, False, law.number, counts.elements, *factors, 0.0, True)
                elif damped:
                    isotropic_elements.respond(w, *law.of, counts.elements, 0.0, 0.0, 0.0, rate_damping, True)
                else:
                    isotropic_elements.push(w, *law.of, counts.elements)

    def _decompose(self, w: World, counts: Counts, due: float, *, keep: bool) -> None:
        """Stretches and axes of the elements with isotropic laws, after what flows over `due` [s] has flowed."""
        isotropic_elements.decompose(w, counts.elements, ROTATION_ITERATIONS, keep)
        if due > 0:
            for law in self._laws:
                if law.plastic:
                    flowing_elements.flow(w, *law.of, counts.elements, due)

    def settle(self, w: World, counts: Counts, *, due: float) -> None:
        """Keep what flows over the time `due` [s] at the present shape."""
        if self.plastic and due > 0:
            yielding_elements.settle(w, counts.elements, due, ROTATION_ITERATIONS, elements.LINEAR)
            if self.springs:
                spring_elements.settle(w, counts.elements, due)
            if self._laws:
                self._decompose(w, counts, due, keep=False)

    def show_plastic(self, w: World, counts: Counts, *, due: float) -> None:
        """Plastic strain to `w.stress`, and how much has accumulated to `w.energy`; see `yielding_elements.show`."""
        yielding_elements.show(w, counts.elements, due, ROTATION_ITERATIONS)
        if self.springs:
            spring_elements.show(w, counts.elements, due)
        if self._laws:
            self._decompose(w, counts, 0.0, keep=False)
        for law in self._laws:
            if law.plastic:
                flowing_elements.show(w, *law.of, counts.elements, due)

    def measure(self, w: World, counts: Counts, *, due: float = 0.0) -> None:
        """Cauchy stress and elastic energy of every element."""
        if self._used & FAST or self._yielding:
            elements.measure(w, counts.elements, due, ROTATION_ITERATIONS)
        if self.springs:
            spring_elements.measure(w, counts.elements, due)
        if self._laws:
            self._decompose(w, counts, 0.0, keep=False)
            for law in self._laws:
                if law.plastic:
                    flowing_elements.measure(w, *law.of, counts.elements, due)
                else:
                    isotropic_elements.measure(w, *law.of, counts.elements)


def _key(material: Material) -> tuple:
    key = (material.model,)
    if material.model == "invertible":
        key = material.wraps, material.threshold
    elif material.model == "corotational" and material.rotation == "qr":
        return "corotational", "qr"
    return key if material.plasticity == "none" else (*key, "plastic")
