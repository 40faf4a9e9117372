"""The mouse on bodies, where no browser works it out: takes hold, pins, pokes, throws."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from taichifem.live.controls import TOOLS
from taichifem.live.picking import Hit, pick
from taichifem.live.stage import Stage
from taichifem.output.camera import Viewpoint
from taichifem.output.frame import Frame

NEAR = 0.02
"""Of the distance to what is looked at: how close to a pin the mouse has to be to take it out."""


class Pointer:
    """Turns what the mouse does with the tool that is chosen into messages for a session.

    tool: one of TOOLS.  extent: of the scene [m], which a ball starts away from.
    """

    def __init__(self, send: Callable[[dict[str, Any]], object], *, extent: float, name: str = "window") -> None:
        self.tool = TOOLS[0]
        self._send, self._extent, self._name = send, extent, name
        self._held: tuple[str, Hit] | None = None
        self._count = 0

    def press(self, stage: Stage, frame: Frame, viewpoint: Viewpoint, along: np.ndarray) -> bool:
        """The button goes down on a ray (3,) from the eye. False if nothing is met: then the camera may move."""
        if self.tool == "look":
            return False
        if self.tool == "pin" and self._unpin(stage, frame, viewpoint, along):
            return True
        hit, tools = pick(frame, viewpoint, along), stage.tools
        if self.tool == "throw":
            self._throw(hit, viewpoint, along, radius=tools.ball_radius, speed=tools.ball_speed)
            return True
        if hit is None:
            return False
        if self.tool == "poke":
            impulse = (tools.impulse * along).tolist()
            self._send({"do": "poke", "node": hit.node, "impulse": impulse, "radius": tools.radius})
        elif self.tool == "pin":
            self._send({"do": "pin", "hand": self._new_hand(), "node": hit.node, "radius": tools.radius})
        else:
            self._held = self._new_hand(), hit
            grab = {"hand": self._held[0], "node": hit.node, "stiffness": tools.strength, "radius": tools.radius}
            self._send({"do": "grab", **grab})
        return True

    def drag(self, viewpoint: Viewpoint, along: np.ndarray) -> None:
        """The mouse moves with the button down: what is held goes with it, as far from the eye as it was."""
        if self._held is not None:
            hand, hit = self._held
            here = viewpoint.eye + hit.depth / (along @ viewpoint.forward) * along
            self._send({"do": "drag", "hand": hand, "offset": (here - hit.point).tolist()})

    def release(self) -> None:
        """The button comes up."""
        if self._held is not None:
            self._send({"do": "release", "hand": self._held[0]})
            self._held = None

    def set_strength(self, stiffness: float) -> None:
        """The spring of what is held now follows its slider [N/m]."""
        if self._held is not None:
            self._send({"do": "strength", "hand": self._held[0], "stiffness": stiffness})

    def _new_hand(self) -> str:
        self._count += 1
        return f"{self._name}-{self._count}"

    def _unpin(self, stage: Stage, frame: Frame, viewpoint: Viewpoint, along: np.ndarray) -> bool:
        """Take out the pin under the mouse, if there is one."""
        for name, hand in stage.hands.items():
            arm = frame.points[hand.nodes].mean(axis=0) - viewpoint.eye
            if hand.stiffness is None and np.linalg.norm(arm - (arm @ along) * along) < NEAR * viewpoint.reach:
                self._send({"do": "release", "hand": name})
                return True
        return False

    def _throw(self, hit: Hit | None, viewpoint: Viewpoint, along: np.ndarray, *, radius: float, speed: float) -> None:
        """The ball starts in front of what it is thrown at, well before the camera."""
        reach = viewpoint.reach if hit is None else hit.depth / float(along @ viewpoint.forward)
        away = min(0.8 * reach, max(5 * radius, 0.6 * self._extent))
        origin = viewpoint.eye + (reach - away) * along
        self._send({"do": "throw", "origin": origin.tolist(), "velocity": (speed * along).tolist(), "radius": radius})
