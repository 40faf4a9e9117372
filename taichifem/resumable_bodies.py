"""Bodies whose state can be kept, in memory or in a file, and gone on from."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from taichifem import checkpoint, transfer
from taichifem.checkpoint import Resumable
from taichifem.clock import Clock
from taichifem.description import Scene
from taichifem.interactive import InteractiveBodies
from taichifem.state import element_fields, node_fields


class ResumableBodies(Resumable, InteractiveBodies):
    """Bodies with a clock, and whatever else their next steps depend on."""

    def __init__(self, scene: Scene, *, precision: str, arch: str | None, threads: int | None) -> None:
        super().__init__(scene, precision=precision, arch=arch, threads=threads)
        self._clock = Clock(fps=scene.fps, substeps=scene.substeps or 1)
        self._fresh = True  # methods that look back have nothing to look at yet

    def _fingerprint(self) -> str:
        layout = self._whole
        return checkpoint.fingerprint(
            layout.rest,
            layout.cells,
            layout.cell_materials,
            text=f"{self.precision} {len(self.scene.colliders)} {self.scene.integrator}",
        )

    def snapshot(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and a header with all that the next steps depend on, for `restore`."""
        w = self._world
        with self._kernels():
            arrays = {name: transfer.read(w, getattr(w, name), count) for name, count in self._state().items()}
        arrays |= self._read_contacts(self._counts.colliders)
        arrays |= {"cells": self.cells, "origins": self.origins, "tips": self.crack_tips}
        header = {"scene": self._fingerprint(), "clock": asdict(self._clock), "fresh": self._fresh, "due": self._due}
        return arrays, header

    def restore(self, arrays: dict[str, np.ndarray], header: dict) -> None:
        """Go on from a `snapshot` of the same meshes and time step; hands let go.

        One of other laws or another integrator will do too: what only one of the two knows of begins at rest.
        """
        w, same = self._world, header["scene"] == self._fingerprint()
        self._hands.clear()
        topology = ("cells", self.cells), ("tips", self.crack_tips)
        if all(np.array_equal(arrays[name], now) for name, now in topology):
            self._surroundings.forget()
        else:
            self._become(arrays["cells"], arrays["origins"], arrays["tips"])
        with self._kernels():
            for name in self._state():
                if name in arrays:
                    transfer.write(w, getattr(w, name), arrays[name])
        self._write_contacts(arrays)
        self._clock, self._fresh, self._due = Clock(**header["clock"]), not same or bool(header["fresh"]), header["due"]
        if not same and self._clock.substep == 0:
            self._clock.substeps = self.scene.substeps or 1
        self._surround(self.time, self.dt)
        self._resumed(same)

    def _state(self) -> dict[str, int]:
        """Fields that go into a checkpoint, and how many entries of each."""
        of_nodes = dict.fromkeys(node_fields(self.scene), self._counts.nodes)
        return of_nodes | dict.fromkeys(element_fields(self._laws), self._counts.elements)

    def _resumed(self, same: bool) -> None:
        """The state is another now; of the same laws and method?"""
