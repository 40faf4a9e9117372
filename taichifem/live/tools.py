"""What a person works with: the strength of the hand, the ball, how fast time goes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.description import Scene, check


@dataclass(frozen=True, kw_only=True)
class Tools:
    """strength: of the hand's spring [N/m].  radius: of what it holds [m].  impulse: of a poke [N s].
    ball_radius [m], ball_speed [m/s]: of what is thrown.  pace: simulated seconds a second, at most.
    Raises InputError for values that are not above 0.
    """

    strength: float
    radius: float
    impulse: float
    ball_radius: float
    ball_speed: float = 5.0
    pace: float = 1.0

    def __post_init__(self) -> None:
        for name in ("strength", "radius", "impulse", "ball_radius", "ball_speed", "pace"):
            check.number(name, getattr(self, name), above=0)


def tools_for(scene: Scene) -> Tools:
    """Tools of a size and strength that suit the bodies of a scene."""
    sizes = [np.ptp(body.placed_points(), axis=0) for body in scene.bodies]
    size = float(np.median([np.cbrt(np.prod(np.maximum(s, 0.1 * s.max()))) for s in sizes]))
    youngs = float(np.median([body.material.youngs for body in scene.bodies]))
    mass = float(np.median([body.material.density * size**3 for body in scene.bodies]))
    # Where nothing has inertia, a poke is a force that dents.
    impulse = 1.5e-3 * youngs * size**2 if scene.integrator == "quasi-static" else 0.5 * mass
    return Tools(
        strength=_rounded(0.1 * youngs * size),
        radius=_rounded(0.2 * size),
        impulse=_rounded(impulse),
        ball_radius=_rounded(0.3 * size),
    )


def _rounded(value: float) -> float:
    """To two digits: it stands in a field that people read."""
    return float(f"{value:.2g}")
