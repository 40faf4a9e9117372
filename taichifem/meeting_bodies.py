"""Bodies, and pieces of them, that are in each other's way."""

from __future__ import annotations

import numpy as np

from taichifem import transfer
from taichifem.breaking import BreakingBodies
from taichifem.description import Scene
from taichifem.layout import Layout
from taichifem.mesh.connectivity import across
from taichifem.processes import meeting


class MeetingBodies(BreakingBodies):
    """Bodies whose pieces keep out of each other, by springs that are elements of the matrix, behind the others."""

    _met: np.ndarray | None = None  # nodes of the springs (k,4), by the world's numbers; None: the world is not told

    def __init__(self, scene: Scene, *, precision: str, arch: str | None, threads: int | None) -> None:
        super().__init__(scene, precision=precision, arch=arch, threads=threads)
        edges = self._whole.rest[self._whole.cells]
        self._grid = float(np.linalg.norm(edges[:, 1:] - edges[:, :1], axis=2).mean())
        self.more_meetings = False

    @property
    def meetings(self) -> int:
        """Springs between pieces in the last step."""
        return self._counts.meetings

    def _take(self, layout: Layout) -> None:
        super()._take(layout)
        self._met = None

    def _meet(self, dt: float) -> None:
        """Find the springs between pieces for a step of dt [s]."""
        if not self.scene.pieces_meet or (self.piece_count == 1 and self._met is None):
            return
        if self._met is None:
            self._introduce()
        w, counts = self._world, self._counts
        with self._kernels():
            w.friction[None] = self.scene.body_friction
            counts.meetings = meeting.find(w, counts.nodes, counts.elements, dt=dt, size=self._grid)
            cells = transfer.read_integers(w.meeting_cell, counts.meetings)
        self.more_meetings = len(cells) == w.meeting_cell.shape[0]
        if not np.array_equal(cells, self._met):
            self._plan_for(np.concatenate([self._layout.cells, cells]))
            self._met = cells

    def _introduce(self) -> None:
        """Tell the world which elements are beside each other, and which belong together."""
        w, layout, (_, of_cell, _) = self._world, self._layout, self._labelled
        beside = self._splitting.beside if self._may_break else across(self.cells)
        beside = np.where(beside < 0, -1, layout.cell_number[beside])[layout.cell_order]
        with self._kernels():
            transfer.write_integers(w.beside, beside)
            transfer.write_integers(w.piece, of_cell[layout.cell_order])
        self._met = np.zeros((0, 4), dtype=np.int32)
