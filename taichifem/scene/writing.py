"""Write a scene file that reads back as the same scene."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from taichifem.description import Pin, Scene
from taichifem.errors import InputError
from taichifem.files import replacing
from taichifem.mesh import EmbeddedSurface, Mesh
from taichifem.scene.layout import COLLIDERS, REGIONS, SIMULATION, keys

_REGION_KEYS = {cls: key for key, cls in REGIONS.items()}
_COLLIDER_TYPES = {cls: kind for kind, cls in COLLIDERS.items()}


def write_scene(scene: Scene, path: str | PathLike) -> None:
    """Write `scene` as TOML: only what differs from the defaults.

    A mesh is written as the shape or file that it came from; one made otherwise is saved beside the scene
    file as `NAME.mesh-K.vtu`. The scene file appears complete or not at all; a missing folder is made.

    Raises:
        InputError: a file cannot be written.
    """
    path = Path(path)
    with replacing(path) as part:
        part.write_text(tomli_w.dumps(_Writer(path).scene(scene)), encoding="utf-8")


class _Writer:
    """Turns dataclasses into TOML tables; saves meshes that have no source, each once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.saved: dict[int, str] = {}

    def scene(self, scene: Scene) -> dict:
        flat = self.table(scene)
        tree: dict[str, Any] = {}
        for key, value in flat.items():
            section, dot, name = key.partition(".")
            if dot:
                tree.setdefault(section, {})[name] = value
            else:
                tree[key] = value
        order = [key for key in ("name", "description", SIMULATION) if key in tree]
        return {key: tree[key] for key in [*order, *(key for key in tree if key not in order)]}

    def table(self, thing: object) -> dict:
        """The fields of a dataclass that differ from their defaults, by the keys of the scene file."""
        named = {field: key for key, field in keys(type(thing)).items()}
        found = {}
        for field in dataclasses.fields(thing):
            value = getattr(thing, field.name)
            if type(value) in _REGION_KEYS:
                found[_REGION_KEYS[type(value)]] = self.region(value)
            elif isinstance(value, Mesh):
                found[named[field.name]] = self.mesh(value)
            elif value is not None and (written := self.plain(value)) != self.plain(_default(field)):
                found[named[field.name]] = written
        return found

    def plain(self, value: object) -> Any:
        """`value` as TOML knows it."""
        if type(value) in _REGION_KEYS:
            return self.table(Pin(region=value))
        if isinstance(value, EmbeddedSurface):
            if value.file is None:
                raise InputError(
                    "an embedded surface without a file cannot be written: make it by EmbeddedSurface.from_file"
                )
            return self.file(value.file)
        if type(value) in _COLLIDER_TYPES:
            return {"type": _COLLIDER_TYPES[type(value)], **self.table(value)}
        if dataclasses.is_dataclass(value):
            return self.table(value)
        if isinstance(value, Mapping):
            return {str(key): self.plain(entry) for key, entry in value.items()}
        if isinstance(value, np.ndarray | np.generic):
            return value.tolist()
        if isinstance(value, tuple | list):
            return [self.plain(entry) for entry in value]
        return value

    def region(self, region: object) -> Any:
        """A region of one field is that field; another is a table."""
        table = self.table(region)
        return next(iter(table.values())) if len(dataclasses.fields(region)) == 1 else table

    def mesh(self, mesh: Mesh) -> dict:
        source = mesh.source
        if not source or "transforms" in source:
            return {"file": self.save(mesh)} | ({"planar": True} if mesh.dimension == 2 else {})
        return {key: self.file(value) if key == "file" else self.plain(value) for key, value in source.items()}

    def file(self, name: str) -> str:
        """The mesh file as seen from the scene file: relative where it lies beneath it."""
        if name.startswith("asset:"):
            return name
        full, folder = Path(name).resolve(), self.path.parent.resolve()
        return (full.relative_to(folder) if full.is_relative_to(folder) else full).as_posix()

    def save(self, mesh: Mesh) -> str:
        if id(mesh) not in self.saved:
            name = f"{self.path.stem}.mesh-{len(self.saved)}.vtu"
            mesh.write(self.path.with_name(name))
            self.saved[id(mesh)] = name
        return self.saved[id(mesh)]


def _default(field: dataclasses.Field) -> object:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return None if field.default is dataclasses.MISSING else field.default
