"""Short keys: "model=stvk" for the material of every body and region, "substeps=4" for [simulation]."""

from __future__ import annotations

from taichifem.description import Material, Scene
from taichifem.errors import InputError
from taichifem.scene.errors import unknown_key
from taichifem.scene.layout import SIMULATION, hints, keys


def spelled_out(tree: dict, text: str) -> list[str]:
    """The overrides that the setting `text`, "KEY=VALUE", stands for in the raw TOML `tree`.

    KEY is a field of Material, which then holds for every body and for every region with a material of its own;
    a key of [simulation]; or a dotted path, which is an override as it is. A model may say what it wraps:
    "model=invertible:stvk".

    Raises:
        InputError: there is no such key, or a model other than invertible is said to wrap something.
    """
    key, _, value = (part.strip() for part in text.partition("="))
    places = _places(tree, key, text)
    if key.rpartition(".")[2] != "model" or ":" not in value:
        return [f"{place}={value}" for place in places]
    model, _, wraps = value.partition(":")
    if model != "invertible":
        raise InputError(f"choice {text!r}: only invertible wraps another law: write {key}=invertible:{wraps}")
    return [
        setting for place in places for setting in (f"{place}={model}", f"{place.removesuffix('model')}wraps={wraps}")
    ]


def _places(tree: dict, key: str, text: str) -> list[str]:
    """The key paths that `key` stands for."""
    if "." in key:
        return [key]
    simulation = {path.partition(".")[2] for path in keys(Scene) if path.startswith(f"{SIMULATION}.")}
    if key in simulation:
        return [f"{SIMULATION}.{key}"]
    if key not in hints(Material):
        raise InputError(f"choice {text!r}: {unknown_key('', key, [*hints(Material), *sorted(simulation)])}")
    return [f"{material}.{key}" for material in _materials(tree)]


def _materials(tree: dict) -> list[str]:
    """Paths of all materials; what is no body is left to the reading of the scene, which tells it."""
    bodies = tree.get("body")
    found = []
    for k, body in enumerate(bodies if isinstance(bodies, list) else []):
        if isinstance(body, dict):
            regions = body.get("materials")
            found.append(f"body.{k}.material")
            found += [f"body.{k}.materials.{r}" for r in (regions if isinstance(regions, dict) else ())]
    return found
