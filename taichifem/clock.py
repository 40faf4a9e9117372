"""Frames, steps and time, and what goes by them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Clock:
    """Counts steps: `substeps` make a frame, `fps` frames a second.

    steps: completed in all.  frame: completed frames.  substep: steps completed of the frame in work.
    """

    fps: float
    substeps: int = 1
    steps: int = 0
    frame: int = 0
    substep: int = 0

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return 1.0 / (self.fps * self.substeps)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return (self.frame * self.substeps + self.substep) / (self.fps * self.substeps)

    @property
    def end(self) -> float:
        """Time [s] at the end of the step in work."""
        return (self.frame * self.substeps + self.substep + 1) / (self.fps * self.substeps)

    def divide(self, substeps: int) -> None:
        """Take `substeps` steps a frame; within a frame the next multiple of those so far, so that time is exact."""
        if self.substep == 0:
            self.substeps = substeps
        else:
            factor = -(-substeps // self.substeps)
            self.substeps, self.substep = factor * self.substeps, factor * self.substep

    def tick(self) -> None:
        """A step is done."""
        self.steps += 1
        self.substep += 1
        if self.substep >= self.substeps:
            self.frame, self.substep = self.frame + 1, 0


class Timed:
    """What advances by steps of a clock."""

    _clock: Clock

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return self._clock.dt

    @property
    def substeps(self) -> int:
        """Steps a frame."""
        return self._clock.substeps

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._clock.time

    @property
    def frame(self) -> int:
        """Frames completed."""
        return self._clock.frame

    @property
    def substep(self) -> int:
        """Steps completed of the frame in work."""
        return self._clock.substep

    @property
    def step_count(self) -> int:
        """Steps completed."""
        return self._clock.steps

    def step(self) -> None:
        """Advance by one time step."""
        raise NotImplementedError

    def advance_frame(self) -> None:
        """Advance to the next frame: `substeps` steps, or what is left of them."""
        frame = self.frame
        while self.frame == frame:
            self.step()

    def advance(self, *, seconds: float) -> None:
        """Advance by `seconds`, rounded to whole steps."""
        end = self.time + seconds
        while self.time + 0.5 * self.dt < end:
            self.step()
