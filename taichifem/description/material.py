"""Materials."""

from __future__ import annotations

from dataclasses import dataclass

from taichifem.description import check
from taichifem.description.fracture import Fracture
from taichifem.errors import InputError

REDUCED = ("modal", "condensed", "bem")
"""Linear elasticity with fewer unknowns (`taichifem.reduced`)."""

MODELS = ("mass-spring", "linear", "corotational", "stvk", "neo-hookean", "invertible", *REDUCED)
BASES = ("fem", "quadratic")
WRAPPED = ("corotational", "stvk", "neo-hookean")
ROTATIONS = ("polar", "qr")
PLASTICITIES = ("none", "creep", "von-mises", "tresca")

CREEP_KEYS = ("yield_strain", "creep_rate", "max_plastic_strain")
YIELD_KEYS = ("yield_stress", "hardening", "viscosity")
"""What only creep, and only the laws with a yield stress, know."""

ELASTIC = dict.fromkeys((*CREEP_KEYS, *YIELD_KEYS, "compression_limit")) | {"plasticity": "none"}
"""Changes that take a material's plasticity away."""


@dataclass(frozen=True, kw_only=True)
class Material:
    """An isotropic material, elastic or elasto-plastic.

    model: "corotational" (Mueller & Gross 2004), "linear" (small strain; swells when it turns), "stvk" (St.
    Venant-Kirchhoff; gives way in compression), "neo-hookean" (stable form of Smith et al. 2018), "invertible": the
    law that `wraps` names, continued below the stretch `threshold` so that crushed elements push back (Irving, Teran
    & Fedkiw 2004), or "mass-spring": springs along the edges of the elements, which hold lengths but no volume.
    Reduced models are linear and know the surface only: "modal" (the lowest vibration modes, in a frame that moves
    with the body), "condensed" (inner nodes eliminated), "bem" (boundary elements, homogeneous, without inertia).
    modes: how many elastic ones "modal" keeps.  basis: what they are made of, "fem" (the modes of the mesh) or
    "quadratic" (affine and quadratic displacement fields: Rayleigh-Ritz; at most 24).
    rotation: of corotational elements, "polar" (the nearest to the deformation) or "qr" (that of an edge and a face:
    quicker, but the force has no energy and depends on the numbering).
    spring_stiffness: of every spring [N/m]; None derives it from `youngs` (Van Gelder 1998), whatever `poisson` is.
    youngs: Young's modulus E [Pa], above 0.  poisson: ratio nu, above -1 and below 0.5.
    density: [kg/m^3], above 0.
    mass_damping: Rayleigh alpha [1/s], slows every motion.  stiffness_damping: Rayleigh beta [s], slows
    deformation only.
    plasticity: what stays when the load is gone: a part of the strain (of "stvk", Green's); of "neo-hookean" and
    "invertible" F_p of F = F_e F_p, with det F_p = 1. "none";
    "creep" (Mueller & Gross 2004): of an elastic strain larger than `yield_strain`, the part `creep_rate` [1/s] times
    dt in every step, until `max_plastic_strain` (None: no end) is reached, strains being measured by their Frobenius
    norm; "von-mises" and "tresca": strain beyond `yield_stress` [Pa], which grows by `hardening` [Pa] times the plastic
    strain and is overstepped by `viscosity` [Pa s] times its rate (Kirchhoff stress where F_p is kept, second
    Piola-Kirchhoff stress of "stvk"). There creep leaves the volume alone. Springs yield one by one, in pressure at
    `compression_limit` in place of the first limit, if it is given.
    fracture: when it breaks; None: never.
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
    modes: int = 20
    basis: str = "fem"
    rotation: str = "polar"
    spring_stiffness: float | None = None
    plasticity: str = "none"
    yield_strain: float | None = None
    creep_rate: float | None = None
    max_plastic_strain: float | None = None
    yield_stress: float | None = None
    hardening: float | None = None
    viscosity: float | None = None
    compression_limit: float | None = None
    fracture: Fracture | None = None

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
        check.whole("modes", self.modes)
        check.choice("basis", self.basis, BASES)
        self._check_plasticity()
        if self.reduced and (self.plasticity != "none" or self.fracture is not None):
            what = "plasticity" if self.plasticity != "none" else "fracture"
            raise InputError(
                f"{what} changes the body, and model {self.model!r} is worked out beforehand: "
                'use model = "corotational"'
            )

    @property
    def reduced(self) -> bool:
        """Is it one of the models with fewer unknowns?"""
        return self.model in REDUCED

    def _check_plasticity(self) -> None:
        check.choice("plasticity", self.plasticity, PLASTICITIES)
        if self.compression_limit is not None:
            check.number("compression_limit", self.compression_limit, above=0)
            if self.model != "mass-spring" or self.plasticity == "none":
                raise InputError("compression_limit belongs to plastic springs: drop it, or see model and plasticity")
        creeps, yields = self.plasticity == "creep", self.plasticity in ("von-mises", "tresca")
        for keys, belong, laws in ((CREEP_KEYS, creeps, '"creep"'), (YIELD_KEYS, yields, '"von-mises" and "tresca"')):
            for key in keys:
                if getattr(self, key) is not None and not belong:
                    raise InputError(f"{key} belongs to {laws}, and plasticity is {self.plasticity!r}: drop it")
        if creeps:
            _required("creep", "yield_strain", self.yield_strain, "")
            _required("creep", "creep_rate", self.creep_rate, "1/s")
            if self.max_plastic_strain is not None:
                check.number("max_plastic_strain", self.max_plastic_strain, above=0)
        if yields:
            _required(self.plasticity, "yield_stress", self.yield_stress, "Pa")
            check.number("hardening", self.hardening or 0, at_least=0, unit="Pa")
            check.number("viscosity", self.viscosity or 0, at_least=0, unit="Pa s")

    @property
    def shear_modulus(self) -> float:
        """Second Lame parameter mu = E / (2 (1 + nu)) [Pa]."""
        return self.youngs / (2 * (1 + self.poisson))

    @property
    def lame_lambda(self) -> float:
        """First Lame parameter lambda = E nu / ((1 + nu) (1 - 2 nu)) [Pa]."""
        return self.youngs * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))


def _required(law: str, name: str, value: float | None, unit: str) -> None:
    if value is None:
        raise InputError(f"plasticity {law!r} needs {name}{f' [{unit}]' if unit else ''}: give it")
    check.number(name, value, above=0, unit=unit)
