"""Files of a live view: the scene as it is on the screen, its state, what was done, videos."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from pathlib import Path

from taichifem.description import Camera
from taichifem.live import parameters
from taichifem.live.stage import Stage
from taichifem.scene.writing import write_scene


@dataclass(frozen=True, kw_only=True)
class Keeper:
    """command_line: how the scene was asked for, as in "demo hello" or "run a.toml --set ...".
    name: of the files.  folder: where they go.
    """

    command_line: tuple[str, ...]
    name: str
    folder: Path = Path("out")

    def place(self, ending: str) -> Path:
        """A file that is not there yet."""
        for k in range(1, 10_000):
            path = self.folder / f"{self.name}-live-{k}{ending}"
            if not path.exists():
                return path
        return self.folder / f"{self.name}-live{ending}"

    def save(self, stage: Stage, camera: Camera) -> list[str]:
        """Write the scene and its state; lines that say how both are used."""
        path = self.place(".toml")
        write_scene(replace(stage.scene, camera=camera), path)
        state = path.with_suffix(".npz")
        stage.save_state(state)
        begin = f"taichifem run {shlex.quote(str(path))}"
        return [f"wrote {path}: {begin}", f"and its state: {begin} --resume {shlex.quote(str(state))}"]

    def save_interactions(self, stage: Stage) -> str:
        """Write what has been done since the start; a line that says how it is done again."""
        path = self.place(".json")
        stage.done.write(path)
        frames = max(1, stage.simulation.frame)
        return f"wrote {path}: {self._said()} --replay {shlex.quote(str(path))} --frames {frames}"

    def command(self, stage: Stage) -> str:
        """The command that runs the scene with the parameters of now. Raises InputError where none says it."""
        changes = parameters.as_overrides(stage.original, stage.scene)
        return " ".join([self._said(), *(f"--set {shlex.quote(change)}" for change in changes)])

    def _said(self) -> str:
        return shlex.join(["taichifem", *self.command_line])
