"""Materials."""

from __future__ import annotations

from dataclasses import dataclass

from taichifem.description import check
from taichifem.errors import InputError

MODELS = ("mass-spring", "linear", "corotational", "stvk", "neo-hookean", "invertible")
WRAPPED = ("corotational", "stvk", "neo-hookean")
ROTATIONS = ("polar", "qr")


@dataclass(frozen=True, kw_only=True)
class Material:
    """An isotropic elastic material.

    model: "corotational" (Mueller & Gross 2004), "linear" (small strain; swells when it turns), "stvk" (St.
    Venant-Kirchhoff; gives way in compression), "neo-hookean" (stable form of Smith et al. 2018), "invertible": the
    law that `wraps` names, continued below the stretch `threshold` so that crushed elements push back (Irving, Teran
    & Fedkiw 2004), or "mass-spring": springs along the edges of the elements, which hold lengths but no volume.
    rotation: of corotational elements, "polar" (the nearest to the deformation) or "qr" (that of an edge and a face:
    quicker, but the force has no energy and depends on the numbering).
    spring_stiffness: of every spring [N/m]; None derives it from `youngs` (Van Gelder 1998), whatever `poisson` is.
    youngs: Young's modulus E [Pa], above 0.  poisson: ratio nu, above -1 and below 0.5.
    density: [kg/m^3], above 0.
    mass_damping: Rayleigh alpha [1/s], slows every motion.  stiffness_damping: Rayleigh beta [s], slows
    deformation only.
    Raises InputError for values outside these bounds.
    """

    model: str = "corotational"
    youngs: float = 1e6
    poisson: float = 0.4
    density: float = 1000.0
    mass_damping: float = 0.0
    stiffness_damping: float = 0.0
    wraps: str = "stvk"
    threshold: float = 0.3
    rotation: str = "polar"
    spring_stiffness: float | None = None

    def __post_init__(self) -> None:
        check.choice("model", self.model, MODELS)
        check.number("youngs", self.youngs, above=0, unit="Pa")
        check.number("poisson", self.poisson, above=-1, below=0.5)
        check.number("density", self.density, above=0, unit="kg/m^3")
        check.number("mass_damping", self.mass_damping, at_least=0, unit="1/s")
        check.choice("wraps", self.wraps, WRAPPED)
        check.number("threshold", self.threshold, above=0, below=1)
        check.number("stiffness_damping", self.stiffness_damping, at_least=0, unit="s")
        check.choice("rotation", self.rotation, ROTATIONS)
        if self.spring_stiffness is not None:
            check.number("spring_stiffness", self.spring_stiffness, above=0, unit="N/m")
            if self.model != "mass-spring":
                raise InputError(f'spring_stiffness belongs to "mass-spring", and the model is {self.model!r}: drop it')

    @property
    def shear_modulus(self) -> float:
        """Second Lame parameter mu = E / (2 (1 + nu)) [Pa]."""
        return self.youngs / (2 * (1 + self.poisson))

    @property
    def lame_lambda(self) -> float:
        """First Lame parameter lambda = E nu / ((1 + nu) (1 - 2 nu)) [Pa]."""
        return self.youngs * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))
