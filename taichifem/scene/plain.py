"""Numbers, texts and flags of a scene file, each read as its Python type or refused with its key path."""

from __future__ import annotations

from taichifem.description import check
from taichifem.errors import InputError
from taichifem.scene.errors import KeyProblem, wrong


def table(raw: object, path: str) -> dict:
    """`raw` if it is a table."""
    if not isinstance(raw, dict):
        raise wrong(path, "a table", raw)
    return raw


def text(raw: object, path: str) -> str:
    """`raw` if it is a string."""
    if not isinstance(raw, str):
        raise wrong(path, "a text in quotes", raw)
    return raw


def flag(raw: object, path: str) -> bool:
    """`raw` if it is true or false."""
    if not isinstance(raw, bool):
        raise wrong(path, "true or false", raw)
    return raw


def whole(raw: object, path: str) -> int:
    """`raw` if it is an integer of 32 bits, which is what every count and index is kept in."""
    if isinstance(raw, bool) or not isinstance(raw, int) or abs(raw) >= 2**31:
        raise wrong(path, "a whole number of less than 2^31", raw)
    return raw


def number(raw: object, path: str) -> float:
    """`raw` as a finite float; integers are welcome."""
    try:
        return check.number(path, raw)
    except OverflowError:
        raise wrong(path, "a number below 1e308", raw) from None
    except InputError as error:
        raise KeyProblem(path, str(error)) from None


def number_key(key: str, path: str) -> int:
    """A key that is the number of a region of a mesh; TOML only has texts for keys."""
    if not key.isascii() or not key.isdecimal() or len(key) > 9:
        raise KeyProblem(path, f"{path}: key {key!r} must be the number of a region of the mesh")
    return int(key)


READERS = {float: number, int: whole, bool: flag, str: text}
