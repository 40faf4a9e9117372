"""The parameters of shapes: checks that name what is wrong, and making a shape from them."""

import inspect
from collections.abc import Callable
from numbers import Integral, Real

import numpy as np

from taichifem.errors import InputError

Arrays = tuple[np.ndarray, np.ndarray]
AXES = {2: "two numbers, for x and z", 3: "three numbers, for x, y and z"}


def make(function: Callable[..., Arrays], parameters: dict) -> tuple[np.ndarray, np.ndarray, dict]:
    """Points, cells and the complete description of the shape that `function` makes.

    Raises:
        InputError: an unknown, a missing or a wrong parameter; the message names it.
    """
    shape, known = function.__name__, inspect.signature(function).parameters
    for name in parameters:
        if name not in known:
            raise InputError(f"shape {shape!r} has no parameter {name!r}; it has {', '.join(known)}")
    for name, parameter in known.items():
        if parameter.default is parameter.empty and name not in parameters:
            raise InputError(f"shape {shape!r}: {name} is missing; give it")
    try:
        points, cells = function(**parameters)
    except InputError as error:
        raise InputError(f"shape {shape!r}: {error}") from None
    values = {name: parameters.get(name, known[name].default) for name in known}
    plain = {name: np.asarray(value).tolist() for name, value in values.items()}
    return points, cells, {"shape": shape, **plain}


def positive(name: str, value) -> float:
    """`value` if it is a length above zero."""
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < value < np.inf:
        raise InputError(f"{name} must be a positive length in metres, not {value!r}")
    return float(value)


def whole(name: str, value) -> int:
    """`value` if it counts something."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise InputError(f"{name} must be a whole number of at least 1, not {value!r}")
    return int(value)


def each(name: str, values, check: Callable, dimension: int = 3) -> list:
    """The values for each axis, every one of them checked."""
    if isinstance(values, str) or not hasattr(values, "__len__") or len(values) != dimension:
        raise InputError(f"{name} must be {AXES[dimension]}, not {values!r}")
    return [check(f"{name}[{i}]", value) for i, value in enumerate(values)]


def grid_points(counts: np.ndarray) -> np.ndarray:
    """Every point (n, d) of the grid of whole numbers from 0 to below `counts` (d,), the last axis fastest."""
    return np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, len(counts))
