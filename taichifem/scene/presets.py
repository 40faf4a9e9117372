"""Materials by name, each with where its numbers come from.

Real materials scatter: the sources give ranges and the presets take a round value inside. Two simplifications
are made throughout: materials are isotropic, and Poisson's ratio of the nearly incompressible ones (0.49 and
more) is lowered to 0.45 or 0.47, since linear tetrahedra lock beyond. None has damping: real loss depends on
frequency in ways that Rayleigh damping does not follow, so a scene states its own. Metals that yield harden along
the straight line from the yield stress to the strength at the strain of rupture. Where a number is only an order of
magnitude, the source says so.
"""

from __future__ import annotations

import difflib
from dataclasses import replace
from typing import NamedTuple

from taichifem.description import Material
from taichifem.errors import InputError

_ASHBY = "Ashby, Materials Selection in Mechanical Design, data appendix"


class Preset(NamedTuple):
    """A material and, in one line, the source of its numbers."""

    material: Material
    source: str


PRESETS: dict[str, Preset] = {
    "gel": Preset(
        Material(youngs=2e4, poisson=0.45, density=1000.0),
        "gelatine; Bonavia 2025, arXiv:2512.20502: 277 kPa (2 parts water to 1) down to 4 kPa (20 to 1)",
    ),
    "foam": Preset(
        Material(youngs=1e6, poisson=0.3, density=40.0),
        f"soft polymer foam; {_ASHBY}: 1 to 3 MPa, 38 to 70 kg/m^3; ratio: Gibson & Ashby, Cellular Solids",
    ),
    "rubber": Preset(
        Material(youngs=2e6, poisson=0.47, density=930.0),
        f"natural rubber; {_ASHBY}: 1.5 to 2.5 MPa, 920 to 930 kg/m^3, ratio 0.499",
    ),
    "silicone": Preset(
        Material(youngs=5e6, poisson=0.47, density=1300.0),
        f"silicone elastomer; {_ASHBY}: 5 to 20 MPa, 1300 to 1800 kg/m^3; casting grades are far softer",
    ),
    "cork": Preset(
        Material(youngs=2e7, poisson=0.1, density=180.0),
        f"{_ASHBY}: 13 to 50 MPa, 120 to 240 kg/m^3; ratio near 0 radially: Gibson, Easterling & Ashby 1981",
    ),
    "polyethylene": Preset(
        Material(youngs=7e8, poisson=0.42, density=950.0),
        f"{_ASHBY}: 0.62 to 0.86 GPa, 940 to 960 kg/m^3",
    ),
    "wood": Preset(
        Material(youngs=9e9, poisson=0.35, density=500.0),
        f"pine, its stiff direction taken for all; {_ASHBY}: 8.4 to 10.3 GPa along the grain, 0.6 to 0.9 across",
    ),
    "glass": Preset(
        Material(youngs=7e10, poisson=0.22, density=2460.0),
        f"soda-lime glass; {_ASHBY}: 68 to 72 GPa, 2440 to 2490 kg/m^3",
    ),
    "aluminium": Preset(
        Material(youngs=7e10, poisson=0.33, density=2700.0),
        f"aluminium alloys; {_ASHBY}: 68 to 82 GPa, 2500 to 2900 kg/m^3",
    ),
    "steel": Preset(
        Material(youngs=2.1e11, poisson=0.29, density=7850.0),
        f"low carbon steel, elastic; {_ASHBY}: 200 to 215 GPa, 7800 to 7900 kg/m^3",
    ),
    "mild-steel": Preset(
        Material(youngs=2.1e11, poisson=0.29, density=7850.0, plasticity="von-mises", yield_stress=3e8, hardening=5e8),
        f"low carbon steel; {_ASHBY}: yields at 250 to 395 MPa, holds 345 to 580 MPa, 26 to 47% elongation",
    ),
    "lead": Preset(
        Material(
            youngs=1.4e10, poisson=0.44, density=11300.0, plasticity="von-mises", yield_stress=1.1e7, hardening=6e6
        ),
        f"{_ASHBY}: 12.5 to 15 GPa, yields at 8 to 14 MPa; Callister: 14 GPa, 11 MPa, holds 14 MPa, strain 0.5",
    ),
    "clay": Preset(
        Material(
            model="neo-hookean",
            youngs=5e6,
            poisson=0.45,
            density=1800.0,
            plasticity="von-mises",
            yield_stress=4e4,
        ),
        "soft wet clay, quickly loaded; Bowles, Foundation Analysis and Design: 2 to 25 MPa; Terzaghi & Peck: "
        "unconfined strength 25 to 50 kPa",
    ),
    "wax": Preset(
        Material(
            model="neo-hookean",
            youngs=1e8,
            poisson=0.4,
            density=900.0,
            plasticity="von-mises",
            yield_stress=1e6,
        ),
        "paraffin at room temperature, orders of magnitude: both fall steeply with temperature (Seyer & Inouye 1935, "
        "Ind. Eng. Chem. 27)",
    ),
    "dough": Preset(
        Material(
            model="neo-hookean",
            youngs=3e4,
            poisson=0.45,
            density=1200.0,
            plasticity="creep",
            yield_strain=0.01,
            creep_rate=3.0,
        ),
        "wheat dough; Phan-Thien & Safari-Ardi 1998, J. Non-Newtonian Fluid Mech. 74: shear modulus some 10 kPa; it "
        "flows beyond strains of 0.001, fast and slow: one rate, and a strain at which it stands, are chosen by eye",
    ),
}


def preset(name: str, **changes: float | str) -> Material:
    """The material called `name`, with fields of Material replaced by `changes`.

    Raises:
        InputError: there is no such preset, or a change is outside its bounds.
    """
    if name not in PRESETS:
        near = difflib.get_close_matches(name, PRESETS, n=1)
        remedy = f"did you mean {near[0]!r}?" if near else f"choose one of {', '.join(PRESETS)}"
        raise InputError(f"unknown material preset {name!r}: {remedy}")
    return replace(PRESETS[name].material, **changes)
