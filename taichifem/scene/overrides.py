"""Overrides from the command line, put into the raw TOML tree before it is validated."""

from __future__ import annotations

import tomllib

from taichifem.errors import InputError
from taichifem.scene.errors import join


def apply_override(tree: dict, text: str) -> str:
    """Put `body.0.material.youngs=2e5` into `tree`; returns the key path, bodies by number.

    Entries of a list are chosen by number or, where they have one, by name (`body.ball.material`). The value
    is read as TOML, and what is no TOML value is a text.

    Raises:
        InputError: no "=", or the path leads to no entry.
    """
    key_text, equals, value_text = text.partition("=")
    steps = [step.strip().strip("\"'") for step in key_text.split(".")]
    if not equals or not all(steps):
        raise InputError(f"override {text!r}: write it as KEY=VALUE, for example body.0.material.youngs=2e5")
    node: dict | list = tree
    path = ""
    for k, step in enumerate(steps):
        step = _number(node, step, path, text) if isinstance(node, list) else step
        path = join(path, step)
        if k == len(steps) - 1:
            node[step] = _value(value_text.strip())
            return path
        child = node.setdefault(step, {}) if isinstance(node, dict) else node[step]
        if isinstance(child, str) and _is_material(path):  # "rubber" is short for {preset = "rubber"}
            child = node[step] = {"preset": child}
        if not isinstance(child, dict | list):
            raise InputError(f"override {text!r}: {path} is {child!r} and has no keys below it")
        node = child
    raise AssertionError("unreachable: steps is never empty")


def _is_material(path: str) -> bool:
    parts = path.split(".")
    return parts[-1] == "material" or parts[-2:-1] == ["materials"]


def _number(entries: list, step: str, path: str, text: str) -> int:
    """Index of the entry that `step` names, by number or by name."""
    names = [entry.get("name") for entry in entries if isinstance(entry, dict)]
    if step.isdecimal() and int(step) < len(entries):
        return int(step)
    if step in names:
        return next(k for k, e in enumerate(entries) if isinstance(e, dict) and e.get("name") == step)
    known = ", ".join(repr(name) for name in names if isinstance(name, str) and name)
    remedy = f"give 0 to {len(entries) - 1}" if entries else "it is empty"
    raise InputError(f"override {text!r}: {path} has no entry {step}: {remedy}{' or ' + known if known else ''}")


def _value(text: str) -> object:
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (tomllib.TOMLDecodeError, RecursionError):
        return text
    return parsed["value"] if parsed.keys() == {"value"} else text
