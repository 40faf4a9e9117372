"""Every parameter that can be changed while a scene runs: one list, which browser, window and command line share.

A parameter is named by the path that `--set` takes, such as body.0.material.youngs, gravity by its axes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from taichifem.description import Fracture, Material, Scene
from taichifem.description.material import CREEP_KEYS, MODELS, PLASTICITIES, REDUCED, ROTATIONS, WRAPPED, YIELD_KEYS
from taichifem.description.scene import INTEGRATORS, SOLVERS
from taichifem.description.view import COLORS
from taichifem.errors import InputError

Value = float | int | bool | str | None


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """What a slider, switch or menu needs to know.

    name: of the field.  unit: SI.  low, high: what a slider spans; typed values may lie beyond.
    log: the slider is logarithmic; one whose `low` is 0 spans six decades and has 0 at its end.
    whole: takes integers.  switch: takes yes or no.  choices: takes one of them.
    optional: may be None, which `none` explains.
    applies: to which materials it belongs.
    """

    name: str
    label: str
    unit: str = ""
    low: float = 0.0
    high: float = 1.0
    log: bool = False
    whole: bool = False
    switch: bool = False
    choices: tuple[str, ...] = ()
    optional: bool = False
    none: str = ""
    applies: Callable[[Material], bool] = lambda material: True

    @property
    def kind(self) -> str:
        """ "choice", "switch" or "number"."""
        return "choice" if self.choices else "switch" if self.switch else "number"


def _model(*names: str) -> Callable[[Material], bool]:
    return lambda m: m.model in names


def _plasticity(*names: str) -> Callable[[Material], bool]:
    return lambda m: m.plasticity in names


_creeps, _yields = _plasticity("creep"), _plasticity("von-mises", "tresca")

FULL = tuple(name for name in MODELS if name not in REDUCED)

MATERIAL = (
    Parameter(name="model", label="elastic model", choices=FULL),
    Parameter(name="wraps", label="continues", choices=WRAPPED, applies=_model("invertible")),
    Parameter(name="threshold", label="from stretch", low=0.05, high=0.95, applies=_model("invertible")),
    Parameter(name="rotation", label="rotation", choices=ROTATIONS, applies=_model("corotational")),
    Parameter(name="youngs", label="Young's modulus", unit="Pa", low=1e3, high=1e10, log=True),
    Parameter(name="poisson", label="Poisson ratio", low=0.0, high=0.49, applies=lambda m: m.model != "mass-spring"),
    Parameter(
        name="spring_stiffness",
        label="of every spring",
        unit="N/m",
        low=1.0,
        high=1e7,
        log=True,
        optional=True,
        none="from E",
        applies=_model("mass-spring"),
    ),
    Parameter(name="density", label="density", unit="kg/m³", low=10.0, high=2e4, log=True),
    Parameter(name="mass_damping", label="mass damping", unit="1/s", high=100.0, log=True),
    Parameter(name="stiffness_damping", label="stiffness damping", unit="s", high=1.0, log=True),
    Parameter(name="plasticity", label="plasticity", choices=PLASTICITIES),
    Parameter(name="yield_strain", label="yield strain", low=1e-4, high=1.0, log=True, applies=_creeps),
    Parameter(name="creep_rate", label="creep rate", unit="1/s", low=1e-2, high=1e3, log=True, applies=_creeps),
    Parameter(
        name="max_plastic_strain",
        label="most plastic strain",
        low=1e-3,
        high=10.0,
        log=True,
        optional=True,
        none="no limit",
        applies=_creeps,
    ),
    Parameter(name="yield_stress", label="yield stress", unit="Pa", low=1e2, high=1e9, log=True, applies=_yields),
    Parameter(name="hardening", label="hardening", unit="Pa", high=1e9, log=True, applies=_yields),
    Parameter(name="viscosity", label="viscosity", unit="Pa s", high=1e7, log=True, applies=_yields),
    Parameter(
        name="compression_limit",
        label="limit in pressure",
        low=1e-4,
        high=1e9,
        log=True,
        optional=True,
        none="as in tension",
        applies=lambda m: m.model == "mass-spring" and m.plasticity != "none",
    ),
    Parameter(
        name="toughness",
        label="toughness",
        unit="Pa",
        low=1e2,
        high=1e9,
        log=True,
        optional=True,
        none="never breaks",
    ),
)

SIMULATION = (
    Parameter(name="gravity.x", label="gravity x", unit="m/s²", low=-20.0, high=20.0),
    Parameter(name="gravity.y", label="gravity y", unit="m/s²", low=-20.0, high=20.0),
    Parameter(name="gravity.z", label="gravity z", unit="m/s²", low=-20.0, high=20.0),
    Parameter(name="integrator", label="integrator", choices=tuple(n for n in INTEGRATORS if n != "quasi-static")),
    Parameter(name="substeps", label="steps a frame", low=1, high=64, log=True, whole=True, optional=True, none="auto"),
    Parameter(name="solver", label="linear solver", choices=SOLVERS),
    Parameter(name="tolerance", label="solver tolerance", low=1e-8, high=0.5, log=True),
    Parameter(name="max_iterations", label="most iterations", low=1, high=10_000, log=True, whole=True),
    Parameter(name="newton_tolerance", label="Newton tolerance", low=1e-12, high=0.1, log=True),
    Parameter(name="max_splits", label="splits a step", low=1, high=1000, log=True, whole=True),
)

VIEW = (
    Parameter(name="color", label="colours", choices=COLORS),
    Parameter(name="wire", label="edges", switch=True),
)

TOOLS = (
    Parameter(name="strength", label="spring", unit="N/m", low=1.0, high=1e8, log=True),
    Parameter(name="radius", label="radius", unit="m", low=1e-3, high=1.0, log=True),
    Parameter(name="impulse", label="poke", unit="N s", low=1e-3, high=1e4, log=True),
    Parameter(name="ball_radius", label="ball", unit="m", low=1e-2, high=1.0, log=True),
    Parameter(name="ball_speed", label="throw", unit="m/s", low=0.1, high=50.0, log=True),
    Parameter(name="pace", label="pace", unit="x real time", low=0.02, high=1.0, log=True),
)
"""Of what a person works with: no part of the scene."""

SECTIONS = {"simulation": SIMULATION, "view": VIEW, "tools": TOOLS}
_AXES = "xyz"


def materials(scene: Scene) -> Iterator[tuple[str, str, Material]]:
    """Title, path and material of each body and of each of its regions that has its own."""
    for b, body in enumerate(scene.bodies):
        title = body.name or f"body {b}"
        yield title, f"body.{b}.material", body.material
        for region, material in sorted(body.materials.items()):
            yield f"{title}, region {region}", f"body.{b}.materials.{region}", material


def get(thing: Material | Scene | Any, name: str) -> Value:
    """The value of a parameter."""
    if name.startswith("gravity."):
        return thing.gravity[_AXES.index(name[-1])]
    if name == "toughness":
        return thing.fracture.toughness if thing.fracture else None
    value = getattr(thing, name)
    return 0.0 if value is None and name in ("hardening", "viscosity") else value


def changed(thing: Material | Scene | Any, name: str, value: Value) -> Any:
    """`thing` with another value of a parameter. Raises InputError for values out of bounds."""
    if name.startswith("gravity."):
        axis = _AXES.index(name[-1])
        return replace(thing, gravity=tuple(value if k == axis else g for k, g in enumerate(thing.gravity)))
    if name == "toughness":
        return replace(thing, fracture=None if value is None else Fracture(toughness=value))
    if name == "plasticity":
        return replace(thing, **_plastic(thing, value))
    if name == "model" and value != "mass-spring":
        return replace(thing, model=value, spring_stiffness=None, compression_limit=None)
    return replace(thing, **{name: value})


def _plastic(material: Material, law: Value) -> dict[str, Value]:
    """What goes with another plastic law: its limit at 5 % strain until told otherwise."""
    same = {
        k
        for keys, laws in ((CREEP_KEYS, ("creep",)), (YIELD_KEYS, ("von-mises", "tresca")))
        for k in keys
        if law in laws
    }
    kept = {key: getattr(material, key) if key in same else None for key in (*CREEP_KEYS, *YIELD_KEYS)}
    begin = {"yield_strain": 0.05, "creep_rate": 10.0, "yield_stress": 0.05 * material.youngs}
    kept |= {key: value for key, value in begin.items() if key in same and kept[key] is None}
    limit = material.compression_limit if law == material.plasticity else None
    return {"plasticity": law, "compression_limit": limit, **kept}


def find(path: str) -> tuple[str, Parameter]:
    """The place that a path leads to ("body.0.material", "simulation" ...), and the parameter.

    Raises InputError for a path that no parameter has.
    """
    place, parameters = path, ()
    for section, known in SECTIONS.items():
        if path.startswith(section + "."):
            place, parameters = section, known
    if path.startswith("body."):
        place, parameters = path.rpartition(".")[0], MATERIAL
    for parameter in parameters:
        if path == f"{place}.{parameter.name}":
            return place, parameter
    raise InputError(f"there is no parameter {path!r}")


def check_value(parameter: Parameter, value: object) -> Value:
    """`value` as the parameter takes it. Raises InputError for what is not of its kind; bounds come later."""
    wanted = {"choice": str, "switch": bool, "number": (int, float)}[parameter.kind]
    if value is None and parameter.optional:
        return None
    if not isinstance(value, wanted) or (parameter.kind == "number" and isinstance(value, bool)):
        raise InputError(f"{parameter.label} must be a {parameter.kind}, not {value!r}")
    if parameter.whole:
        return round(value) if abs(value) < 1e9 else value
    return value


def differences(before: Scene, after: Scene, *, all_said: bool = False) -> list[tuple[str, Value]]:
    """Paths and values of the parameters in which `after` differs from `before`, a scene of the same bodies.

    all_said: also what a choice among them would bring with it.
    """
    found = []
    for (_, prefix, one), (_, _, two) in zip(materials(before), materials(after), strict=True):
        found += _different(one, two, prefix, MATERIAL, all_said)
    for section, of in (("simulation", lambda s: s), ("view", lambda s: s.view)):
        found += _different(of(before), of(after), section, SECTIONS[section], all_said)
    return found


def _different(
    one: Any, two: Any, prefix: str, parameters: tuple[Parameter, ...], all_said: bool
) -> list[tuple[str, Value]]:
    found = []
    for p in parameters:
        value = get(two, p.name)
        if value != get(one, p.name):
            found.append((f"{prefix}.{p.name}", value))
            one = one if all_said else changed(one, p.name, value)  # a choice brings values of its own
    return found


def as_overrides(before: Scene, after: Scene) -> list[str]:
    """The same as texts for `--set`. Raises InputError for what no text can say: that something has no value."""
    texts = []
    for path, value in differences(before, after, all_said=True):
        if path.startswith("simulation.gravity."):
            text = f"simulation.gravity={[float(g) for g in after.gravity]}"
        elif value is None:
            raise InputError(f"no command line takes {path} away: save the scene instead")
        else:
            shown = str(value).lower() if isinstance(value, bool) else value
            text = f"{path.replace('.toughness', '.fracture.toughness')}={shown}"
        if text not in texts:
            texts.append(text)
    return texts
