"""From a TOML tree to the dataclasses, driven by their type hints."""

from __future__ import annotations

import inspect
import re
import types
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Union, get_args, get_origin

from taichifem.description import Collider, Material, Pin, Region, Scene
from taichifem.errors import InputError
from taichifem.mesh import EmbeddedSurface, Mesh, TetMesh, mesh_from_source
from taichifem.mesh.kinds import SHAPES, kind_of
from taichifem.scene import plain, presets
from taichifem.scene.errors import KeyProblem, at, join, unknown_key, wrong
from taichifem.scene.layout import COLLIDERS, REGIONS, SIMULATION, hints, holds_dataclass, keys


def build_scene(tree: dict, folder: Path) -> Scene:
    """The Scene that `tree` describes; mesh files are looked for in `folder`.

    Raises:
        KeyProblem: an unknown or missing key, a wrong type or value.
    """
    section = plain.table(tree.get(SIMULATION, {}), SIMULATION)
    flat = {key: value for key, value in tree.items() if key != SIMULATION}
    flat |= {f"{SIMULATION}.{key}": value for key, value in section.items()}
    return _Builder(folder).table(Scene, flat, "")


class _Builder:
    """Turns raw TOML values into what the type hints ask for. `path` is the key path, for messages."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def table(self, cls: type, raw: object, path: str, **given: Any) -> Any:
        """An object of the dataclass `cls`, its fields from the table `raw`, or else from `given`."""
        known, types_ = keys(cls), hints(cls)
        values: dict[str, Any] = {}
        for key, value in plain.table(raw, path).items():
            if key not in known:
                raise unknown_key(path, key, known)
            field, where = known[key], join(path, key)
            if field in values:
                raise KeyProblem(path, f"{path} says its {field} twice: keep one of {', '.join(REGIONS)}")
            is_region = types_[field] == Region
            values[field] = self.region(key, value, where) if is_region else self.value(types_[field], value, where)
        values = given | values
        for name, parameter in inspect.signature(cls).parameters.items():
            if parameter.default is parameter.empty and name not in values:
                missing = [repr(key) for key, field in known.items() if field == name]
                raise KeyProblem(path, f"{at(path)}missing key: give {' or '.join(missing)}")
        try:
            return cls(**values)
        except InputError as error:  # the dataclass's own checks; a wrong key would have been told above
            raise _placed(str(error), path, {field: key for key, field in known.items()}) from None

    def value(self, hint: Any, raw: object, path: str) -> Any:
        """`raw` as the type `hint` wants it."""
        origin, args = get_origin(hint), get_args(hint)
        special = {Material: self.material, TetMesh: self.mesh, Mesh: self.mesh, Collider: self.collider}
        special[EmbeddedSurface] = self.embedded
        if hint in special:
            return special[hint](raw, path)
        if hint in plain.READERS:
            return plain.READERS[hint](raw, path)
        if origin in (Union, types.UnionType):
            # TOML has no null, so what is written is not None; and a bare region is written as a pin.
            return self.value(Pin if Pin in args else args[0], raw, path)
        if origin is None:
            return self.table(hint, raw, path)
        if issubclass(origin, Mapping):
            entries = plain.table(raw, path).items()
            return {plain.number_key(k, path): self.value(args[1], v, join(path, k)) for k, v in entries}
        return self.sequence(args, raw, path)

    def sequence(self, args: tuple, raw: object, path: str) -> tuple:
        """A tuple: of as many entries as `args` if that is fixed, otherwise of any number of the first."""
        fixed = len(args) > 1 and args[1] is not Ellipsis
        if not isinstance(raw, list) or (fixed and len(raw) != len(args)):
            wanted = f"a list of {len(args)} numbers" if fixed else "a list"
            raise wrong(path, "an array of tables ([[...]])" if holds_dataclass(args[0]) else wanted, raw)
        kinds = args if fixed else [args[0]] * len(raw)
        return tuple(self.value(kinds[k], entry, join(path, k)) for k, entry in enumerate(raw))

    def region(self, kind: str, raw: object, path: str) -> Any:
        """The region of that kind. A list is its first field: `nearest = [0, 0, 1]`."""
        cls = REGIONS[kind]
        if not isinstance(raw, list):
            return self.table(cls, raw, path)
        first, hint = next(iter(hints(cls).items()))
        return self.table(cls, {}, path, **{first: self.value(hint, raw, path)})

    def collider(self, raw: object, path: str) -> Any:
        """The collider that the key `type` names."""
        raw = dict(plain.table(raw, path))
        kind = _choice(raw.pop("type", None), join(path, "type"), COLLIDERS)
        return self.table(COLLIDERS[kind], raw, path)

    def material(self, raw: object, path: str) -> Material:
        """A material by its preset's name, or a table that may start from a preset."""
        raw = {"preset": raw} if isinstance(raw, str) else dict(plain.table(raw, path))
        if "preset" not in raw:
            return self.table(Material, raw, path)
        where = join(path, "preset")
        try:
            base = presets.preset(plain.text(raw.pop("preset"), where))
        except KeyProblem:
            raise
        except InputError as error:
            raise KeyProblem(where, f"{where}: {error}") from None
        return self.table(Material, raw, path, **{name: getattr(base, name) for name in hints(Material)})

    def file(self, raw: object, path: str) -> str:
        """A file by its name as seen from the scene file, or `asset:NAME`."""
        name = plain.text(raw, path)
        return name if name.startswith("asset:") else str(self.folder / name)

    def embedded(self, raw: object, path: str) -> EmbeddedSurface:
        """A surface by its file."""
        try:
            return EmbeddedSurface.from_file(self.file(raw, path))
        except KeyProblem:
            raise
        except InputError as error:
            raise KeyProblem(path, f"{path}: {error}") from None

    def mesh(self, raw: object, path: str) -> Mesh:
        """A shape with its parameters, or a file, which may be planar. The mesh itself checks the values."""
        raw = dict(plain.table(raw, path))
        if ("shape" in raw) == ("file" in raw):
            raise KeyProblem(path, f"{path}: give either a shape ({', '.join(SHAPES)}) or a file")
        if "shape" in raw:
            first, maker = ["shape"], SHAPES[_choice(raw["shape"], join(path, "shape"), SHAPES)]
        else:
            plain.flag(raw.get("planar", False), join(path, "planar"))
            first, maker = ["file", "planar"], kind_of(raw).from_file
            raw["file"] = self.file(raw["file"], join(path, "file"))
            for count in ("tets", "cage"):
                if plain.whole(raw.get(count, 1), join(path, count)) < 1:
                    raise wrong(join(path, count), "at least 1", raw[count])
        known = [*first, *(name for name in inspect.signature(maker).parameters if name != "path")]
        for key in raw:
            if key not in known:
                raise unknown_key(path, key, known)
        try:
            return mesh_from_source(raw)
        except InputError as error:
            message = str(error).removeprefix(f"shape {raw.get('shape')!r}: ")
            raise _placed(message, path, {key: key for key in raw if "shape" in raw}) from None
        except (MemoryError, OverflowError, ValueError) as error:  # numbers that NumPy cannot hold
            raise KeyProblem(
                path, f"{path} cannot be made: {error or 'out of memory'}: ask for fewer elements"
            ) from None


def _placed(message: str, path: str, keys_of: Mapping[str, str]) -> KeyProblem:
    """A check's `message` at its key: it begins with the field's name, which becomes the end of the path."""
    word = re.match(r"\w*", message)[0]
    if word not in keys_of:
        return KeyProblem(path, at(path) + message)
    where = join(path, keys_of[word])
    return KeyProblem(where, where + message[len(word) :])


def _choice(raw: object, path: str, allowed: Iterable[str]) -> str:
    if not isinstance(raw, str) or raw not in allowed:
        said = f"{path} is missing" if raw is None else f"{path} is {raw!r}"
        raise KeyProblem(path, f"{said}: choose one of {', '.join(map(repr, allowed))}")
    return raw
