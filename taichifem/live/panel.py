"""What of the parameters is offered for a scene, as a browser or a window shows it."""

from __future__ import annotations

from typing import Any

from taichifem.description import Scene
from taichifem.errors import InputError
from taichifem.factory import is_reduced
from taichifem.live.controls import TOOLS
from taichifem.live.parameters import MATERIAL, SECTIONS, Parameter, Value, get, materials
from taichifem.live.tools import Tools
from taichifem.reduced.refusals import adjustable

REDUCED_SECTIONS = {
    "simulation": ("gravity.x", "gravity.y", "gravity.z"),
    "tools": ("strength", "radius", "impulse", "pace"),
}
"""Of the sections, what means something to reduced models: they are advanced exactly or at once, and meet no ball."""


def panel(scene: Scene, tools: Tools) -> list[dict[str, Any]]:
    """What to show: groups with a title and rows, each a parameter with its path and value; plain data for JSON."""
    groups = [
        (title, prefix, material, [p for p in MATERIAL if p.applies(material) and _offered(scene, prefix, p)])
        for title, prefix, material in materials(scene)
    ]
    for title, section in (("simulation", scene), ("view", scene.view), ("tools", tools)):
        groups.append((title, title, section, [p for p in SECTIONS[title] if _offered(scene, title, p)]))
    return [
        {"title": title, "rows": [_row(p, f"{prefix}.{p.name}", get(thing, p.name)) for p in offered]}
        for title, prefix, thing, offered in groups
        if offered
    ]


def tools_offered(scene: Scene) -> tuple[str, ...]:
    """What the mouse can do: all but to throw a ball at bodies that meet none."""
    return tuple(tool for tool in TOOLS if tool != "throw" or not is_reduced(scene))


def check_offered(scene: Scene, place: str, parameter: Parameter) -> None:
    """Raise InputError for a parameter that the scene's reduced models have not, or cannot change while they run."""
    if not _offered(scene, place, parameter):
        raise InputError(
            f"{place}.{parameter.name} cannot be set here: reduced models have it not, or are made with it; "
            "set it in the scene file or with --set"
        )


def _offered(scene: Scene, place: str, parameter: Parameter) -> bool:
    if not is_reduced(scene):
        return True
    if place.startswith("body."):
        number = int(place.split(".")[1])
        return number >= len(scene.bodies) or parameter.name in adjustable(scene, number)
    return parameter.name in REDUCED_SECTIONS.get(place, (parameter.name,))


def _row(parameter: Parameter, path: str, value: Value) -> dict[str, Any]:
    p = parameter
    row = {"path": path, "label": p.label, "unit": p.unit, "kind": p.kind, "value": value}
    if p.kind == "choice":
        return row | {"choices": p.choices}
    if p.kind == "switch":
        return row
    return row | {"low": p.low, "high": p.high, "log": p.log, "whole": p.whole, "optional": p.optional, "none": p.none}
