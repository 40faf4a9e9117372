"""How the keys of a scene file follow from the dataclasses: the one place that reader and writer share.

The rules: a field is a key of the same name. A list of tables takes the singular (`bodies` is written
`[[body]]`). The plain numbers of a Scene stand in `[simulation]`. A region is a key that says its kind
(`box = {...}`); a collider is a table with a `type`. So a new field of a dataclass is a new key by itself.
"""

from __future__ import annotations

from dataclasses import fields
from functools import cache
from typing import get_args, get_type_hints

from taichifem.description import Collider, Region, Scene
from taichifem.mesh import EmbeddedSurface

SIMULATION = "simulation"
_ABOUT = (
    "name",
    "description",
)  # the fields of Scene that stand at the top of the file though they are plain


def _kind(cls: type, family: str) -> str:
    names = [f.name for f in fields(cls)]
    return names[0] if len(names) == 1 else cls.__name__.removesuffix(family).lower()


REGIONS: dict[str, type] = {_kind(cls, "Region"): cls for cls in get_args(Region)}
COLLIDERS: dict[str, type] = {_kind(cls, "Collider"): cls for cls in get_args(Collider)}


@cache
def hints(cls: type) -> dict[str, object]:
    """Type of each field of a dataclass, in the order of the fields."""
    resolved = get_type_hints(cls)
    return {f.name: resolved[f.name] for f in fields(cls)}


@cache
def keys(cls: type) -> dict[str, str]:
    """Which field each key of the table stands for. Keys of [simulation] are written "simulation.fps"."""
    found = {}
    for name, hint in hints(cls).items():
        if hint == Region:
            found |= dict.fromkeys(REGIONS, name)
        elif cls is Scene and not holds_dataclass(hint) and name not in _ABOUT:
            found[f"{SIMULATION}.{name}"] = name
        else:
            found[_singular(name) if _is_table_list(hint) else name] = name
    return found


def _is_table_list(hint: object) -> bool:
    return len(get_args(hint)) == 1 and holds_dataclass(hint)


def holds_dataclass(hint: object) -> bool:
    """Whether values of the type `hint` are, or contain, dataclasses."""
    return (hasattr(hint, "__dataclass_fields__") and hint is not EmbeddedSurface) or any(
        map(holds_dataclass, get_args(hint))
    )


def _singular(name: str) -> str:
    return name[:-3] + "y" if name.endswith("ies") else name.removesuffix("s")
