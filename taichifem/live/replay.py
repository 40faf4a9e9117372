"""Interactions done again, without anybody: what the live view has written is repeated step by step."""

from __future__ import annotations

from typing import Any

from taichifem.live.interactions import Interactions
from taichifem.live.stage import Stage


class Replay:
    """Looks like a simulation, and does what the list says before the steps that it names."""

    def __init__(self, stage: Stage, interactions: Interactions) -> None:
        self._stage = stage
        self._left = list(reversed(interactions.entries))

    def advance_frame(self) -> None:
        """Advance to the next frame. Raises InputError for an action that is impossible in this scene."""
        frame = self.frame
        while self.frame == frame:
            while self._left and self._left[-1][0] <= self.step_count:
                self._stage.do(self._left.pop()[1])
            self._stage.step()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stage.simulation, name)
