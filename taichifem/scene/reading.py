"""Read a scene file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from os import PathLike
from pathlib import Path

from taichifem.description import Scene
from taichifem.errors import InputError
from taichifem.scene.building import build_scene
from taichifem.scene.errors import KeyProblem
from taichifem.scene.overrides import apply_override
from taichifem.scene.short_keys import spelled_out


def read_scene(path: str | PathLike, overrides: Iterable[str] = (), *, choice: str | None = None) -> Scene:
    """Read a scene from a TOML file.

    Args:
        path: the scene file; mesh files in it are looked for in its folder.
        overrides: settings such as "body.0.material.youngs=2e5", put in before anything is checked.
        choice: one more, put in last, whose key may be short: "model=stvk" for all materials.

    Raises:
        InputError: one line with the file, the key path, what is wrong there and the remedy.
    """
    tree = _load(path)
    placed = []
    try:
        placed = [(apply_override(tree, text), text) for text in overrides]
        if choice is not None:
            placed += [(apply_override(tree, text), choice) for text in spelled_out(tree, choice)]
        return build_scene(tree, Path(path).parent)
    except KeyProblem as problem:
        guilty = [text for key, text in placed if f"{problem.path}.".startswith(f"{key}.")]
        problem = f"{problem} (set by the override {guilty[-1]!r})" if guilty else problem
        raise InputError(_line(f"{path}: {problem}")) from None
    except InputError as error:
        raise InputError(_line(f"{path}: {error}")) from None
    except RecursionError:
        raise InputError(_line(f"{path}: values are nested too deeply: flatten them")) from None


def _load(path: str | PathLike) -> dict:
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
        tree = tomllib.loads(text)
    except FileNotFoundError:
        raise InputError(_line(f"{path}: there is no such scene file: check the name")) from None
    except IsADirectoryError:
        raise InputError(_line(f"{path}: is a folder: name the scene file (.toml) in it")) from None
    except OSError as error:
        raise InputError(_line(f"{path}: cannot be read: {error.strerror}")) from None
    except UnicodeDecodeError as error:
        raise InputError(_line(f"{path}: is not UTF-8 text (byte {error.start}): save it as UTF-8")) from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(_line(f"{path}: is no valid TOML: {error}")) from None
    except RecursionError:
        raise InputError(_line(f"{path}: values are nested too deeply: flatten them")) from None
    except ValueError as error:  # a NUL in the name, a date or a number that Python cannot hold
        raise InputError(_line(f"{path}: cannot be read: {error}")) from None
    if not tree:
        raise InputError(_line(f"{path}: is empty: a scene needs at least one [[body]] with a mesh"))
    return tree


def _line(text: str) -> str:
    return " ".join(text.split("\n")).replace("\r", " ")
