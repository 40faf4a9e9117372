"""Small checks that turn a wrong value into one clear line naming the value and the remedy."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from numbers import Integral, Real

from taichifem.errors import InputError

Vector = tuple[float, float, float]


def number(
    name: str,
    value: object,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    unit: str = "",
) -> float:
    """`value` as a finite float within the bounds, or an InputError that says what is allowed."""
    unit = f" [{unit}]" if unit else ""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"{name} must be a number{unit}, not {value!r}")
    try:
        value = float(value)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise InputError(f"{name} is {value}: give a finite number{unit}")
    if above is not None and not value > above:
        raise InputError(f"{name} is {value:g}: it must be above {above:g}{unit}")
    if at_least is not None and not value >= at_least:
        raise InputError(f"{name} is {value:g}: it must be at least {at_least:g}{unit}")
    if below is not None and not value < below:
        raise InputError(f"{name} is {value:g}: it must be below {below:g}{unit}")
    return value


def whole(name: str, value: object, *, at_least: int = 1) -> int:
    """`value` as an int of at least `at_least`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < at_least:
        raise InputError(f"{name} must be a whole number of at least {at_least}, not {value!r}")
    return int(value)


def vector(name: str, value: object, *, unit: str = "") -> Vector:
    """`value` as three finite floats."""
    label = f" [{unit}]" if unit else ""
    if isinstance(value, str) or not isinstance(value, Iterable) or len(value := tuple(value)) != 3:
        raise InputError(f"{name} must be three numbers{label}, not {value!r}")
    return tuple(number(f"{name}[{k}]", v, unit=unit) for k, v in enumerate(value))


def numbers(name: str, value: object) -> tuple[float, ...]:
    """`value` as a tuple of finite floats, at least one."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise InputError(f"{name} must be a list of numbers, not {value!r}")
    return tuple(number(f"{name}[{k}]", v) for k, v in enumerate(value))


def choice(name: str, value: object, allowed: Sequence[str]) -> str:
    """`value` if it is one of `allowed`."""
    if value not in allowed:
        raise InputError(f"{name} is {value!r}: choose one of {', '.join(map(repr, allowed))}")
    return str(value)
