"""A mesh that comes apart: vertices get copies, and elements that only an edge or a vertex holds are parted.

Slides 37 to 43. Elements stay as they are; only which vertices they share changes. Elements around a vertex hang
together by faces at it, so each set of them is found by walking from one element to the next across such faces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem import runtime
from taichifem.mesh.connectivity import across
from taichifem.structure.splitting_kernels import ADDED, CAPPED, SPLITS, STAMP, tear


@dataclass(frozen=True)
class Tear:
    """What a step has split. capped: more would have been.

    parent (n,): for every vertex the one that it was before the step.
    """

    splits: int
    capped: bool
    parent: np.ndarray


class Splitting:
    """The elements of a mesh while its vertices are split.

    cells (m,d+1): vertices of the elements.  beside (m,d+1): the element across the face opposite each vertex, or -1.
    origin (n,): for every vertex, copies included, the one it was at first.  tips (n,): at which do cracks end?
    """

    def __init__(self, cells: np.ndarray, origin: np.ndarray, tips: np.ndarray | None = None) -> None:
        runtime.start()
        self.cells = np.array(cells, dtype=np.int32)
        self.beside = across(self.cells)
        self._n = len(origin)
        room = max(cells.size, self._n)
        self._origin, self._tips = np.zeros(room, dtype=np.int32), np.zeros(room, dtype=np.int32)
        self._origin[: self._n] = origin
        if tips is not None:
            self._tips[: self._n] = tips
        # For the kernel: counters, marks on elements, and lists of elements, vertices, faces and groups.
        self._counters = np.zeros(4, dtype=np.int32)
        self._mark, self._side = np.zeros(len(cells), dtype=np.int32), np.zeros(len(cells), dtype=np.int32)
        self._lists = np.empty((5, cells.size), dtype=np.int32)
        # Room for where vertices are, and for what they are copies of: to make it anew takes as long as a tear.
        self._where, self._parent = np.zeros((room, 3)), np.zeros(room, dtype=np.int32)

    @property
    def origin(self) -> np.ndarray:
        return self._origin[: self._n]

    @property
    def tips(self) -> np.ndarray:
        return self._tips[: self._n].astype(bool)

    def tear(
        self,
        x: np.ndarray,
        elements: np.ndarray,
        corners: np.ndarray,
        normals: np.ndarray,
        *,
        seed: tuple[int, int],
        most: int,
    ) -> Tear:
        """Split a vertex of each of some elements, in that order, by a plane.

        x (n,3): where the vertices are [m].  elements (k,).  corners (k,): which vertex; -1 for one where a crack ends,
        if the element has one, so that cracks run on instead of crumbling, else a random one, told by `seed`.
        normals (k,3): of the plane through it.  most: splits at most.
        Where the plane does not part the elements around the vertex, nothing happens. What has an element around a
        vertex that was split waits: its stress is another one now.
        """
        of, before = np.int32, self._n
        self._parent[:before] = np.arange(before)
        self._where[:before] = x
        self._counters[:SPLITS] = before, self._counters[STAMP]
        self._counters[SPLITS:] = 0
        with runtime.precision_of("f64"):
            tear(
                self.cells.shape[1],
                self.cells.reshape(-1),
                self.beside.reshape(-1),
                self._origin,
                self._parent,
                self._tips,
                self._where,
                np.ascontiguousarray(elements, dtype=of),
                np.ascontiguousarray(corners, dtype=of),
                np.ascontiguousarray(normals, dtype=np.float64),
                np.zeros(len(self.cells), dtype=of),
                self._mark,
                self._side,
                *self._lists,
                self._counters,
                *(int(s) & 0x7FFFFFFF for s in seed),
                most,
            )
        self._n = int(self._counters[ADDED])
        return Tear(int(self._counters[SPLITS]), bool(self._counters[CAPPED]), self._parent[: self._n].copy())
