"""How a scene is looked at."""

from __future__ import annotations

from dataclasses import dataclass

from taichifem.description import check
from taichifem.errors import InputError

COLORS = ("material", "piece", "von-mises", "plastic-strain", "displacement", "speed")
RENDERERS = ("auto", "taichi", "ggui", "pyvista")


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A perspective camera. z is up.

    eye, target: positions [m]; None lets the first frame choose, so that everything is seen.
    fov: vertical field of view [degrees].
    """

    eye: check.Vector | None = None
    target: check.Vector | None = None
    fov: float = 35.0

    def __post_init__(self) -> None:
        if self.eye is not None:
            check.vector("eye", self.eye, unit="m")
        if self.target is not None:
            check.vector("target", self.target, unit="m")
        if self.eye is not None and self.eye == self.target:
            raise InputError("camera eye and target are the same point: move one of them")
        check.number("fov", self.fov, above=1, below=170, unit="degrees")


@dataclass(frozen=True, kw_only=True)
class View:
    """What a frame shows.

    color: "material" (each body's own colour), "piece" (each piece's), "von-mises" [Pa], "plastic-strain" (what has
    accumulated), "displacement" [m] or "speed" [m/s].
    range: (low, high) of the colour bar; None follows the data (the top only grows).
    wire: draw the element edges on the surface.  hud: print time, cost and counts into the picture.
    colors: one "#rrggbb" per body, in order; bodies beyond the list take the default palette.
    """

    color: str = "material"
    range: tuple[float, float] | None = None
    wire: bool = False
    hud: bool = True
    colors: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check.choice("color", self.color, COLORS)
        if self.range is not None:
            low, high = check.numbers("range", self.range) if len(self.range) == 2 else (1, 0)
            if not low < high:
                raise InputError(f"range {self.range} must be two numbers, low before high")
        for k, text in enumerate(self.colors):
            digits = text[1:] if isinstance(text, str) and text.startswith("#") else ""
            if len(digits) != 6 or any(c not in "0123456789abcdefABCDEF" for c in digits):
                raise InputError(f'colors[{k}] is {text!r}: write it as "#rrggbb"')
