"""What is wrong at one key of a scene file."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable

from taichifem.errors import InputError


class KeyProblem(InputError):
    """A wrong key or value. `path` is the key ("body.0.material.youngs"), the message says what and how.

    The file's name is put in front by `read_scene`.
    """

    def __init__(self, path: str, message: str) -> None:
        super().__init__(message)
        self.path = path


def join(path: str, key: object) -> str:
    """The key path one level down."""
    return f"{path}.{key}" if path else str(key)


def at(path: str) -> str:
    """How a message about the table at `path` begins; about the whole file: with nothing."""
    return f"{path}: " if path else ""


def unknown_key(path: str, key: str, known: Iterable[str]) -> KeyProblem:
    """`key` does not exist in the table at `path`: name the nearest of `known`, or all."""
    by_last = {name.rpartition(".")[2]: name for name in known}
    near = difflib.get_close_matches(key.rpartition(".")[2], by_last, n=1)
    remedy = f"did you mean {by_last[near[0]]!r}?" if near else f"known are {', '.join(by_last.values())}"
    return KeyProblem(join(path, key), f"{at(path)}unknown key {key!r}: {remedy}")


def wrong(path: str, wanted: str, value: object) -> KeyProblem:
    """The value at `path` is not what is wanted there."""
    return KeyProblem(path, f"{path} must be {wanted}, not {reprlib.repr(value)}")
