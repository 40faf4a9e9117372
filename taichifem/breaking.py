"""Bodies that break: the mesh changes between two steps, and all that depends on it follows."""

from __future__ import annotations

import numpy as np

from taichifem import carrying
from taichifem.description import Scene
from taichifem.errors import InputError
from taichifem.measured_bodies import MeasuredBodies
from taichifem.processes import fracture
from taichifem.structure.pieces import label_pieces
from taichifem.structure.splitting import Splitting
from taichifem.surface import Surface, split_surface
from taichifem.topology import split_layout


class BreakingBodies(MeasuredBodies):
    """Bodies whose elements may part. Nodes that come from splits follow those of the scene, in their order."""

    def __init__(self, scene: Scene, *, precision: str, arch: str | None, threads: int | None) -> None:
        super().__init__(scene, precision=precision, arch=arch, threads=threads)
        self._may_break = any(material.fracture for material in self._materials)
        self._splitting = Splitting(super().cells, np.arange(self._counts.nodes)) if self._may_break else None
        self._intact = self._splitting.beside.copy() if self._may_break else None
        self.splits, self.more_splits = 0, False  # in the last step: how many, and was the cap hit?
        self._pieces: tuple[int, np.ndarray, np.ndarray] | None = None
        self._opened: Surface | None = None

    @property
    def cells(self) -> np.ndarray:
        """Elements (m,d+1): tetrahedra, or triangles of planar bodies."""
        return self._splitting.cells.copy() if self._may_break else super().cells

    @property
    def piece_count(self) -> int:
        """Number of pieces: sets of elements that hang together."""
        return self._labelled[0]

    @property
    def cell_pieces(self) -> np.ndarray:
        """Piece of each element (m,), from 0; those of the first elements come first."""
        return self._labelled[1]

    @property
    def surface_pieces(self) -> np.ndarray:
        """Piece of each triangle of the surface (k,)."""
        return self._labelled[2][self.surface[:, 0]]

    @property
    def origins(self) -> np.ndarray:
        """Of which node of the scene each node is a copy (n,); those of the scene are their own."""
        return self._splitting.origin.copy() if self._may_break else np.arange(self._counts.nodes)

    @property
    def crack_tips(self) -> np.ndarray:
        """At which nodes (n,) do cracks end?"""
        return self._splitting.tips if self._may_break else np.zeros(self._counts.nodes, dtype=bool)

    @property
    def crack_faces(self) -> np.ndarray:
        """Which triangles of the surface (k,) fracture has opened."""
        return self._surface.cracked

    @property
    def _labelled(self) -> tuple[int, np.ndarray, np.ndarray]:
        """Number of pieces, and the piece of each element and of each node."""
        if self._pieces is None:
            self._pieces = label_pieces(self.cells, self._counts.nodes)
        return self._pieces

    @property
    def _surface(self) -> Surface:
        if not self._may_break:
            return super()._surface
        if self._opened is None:
            self._opened = split_surface(self.cells, self._splitting.beside, self._intact, self.cell_bodies)
        return self._opened

    def _break(self, step: int) -> bool:
        """Split what is torn beyond its toughness; did anything part? step: number of the step, for the seed."""
        self.splits, self.more_splits = 0, False
        torn = self._find_torn()
        if not len(torn.element):
            return False
        order = self._layout.cell_order
        done = self._splitting.tear(
            self.positions,
            order[torn.element],
            torn.corner,
            torn.normal,
            seed=(self.scene.seed, step),
            most=self.scene.max_splits,
        )
        self.splits, self.more_splits = done.splits, done.capped
        if done.splits:
            self._reshape(done.parent)
        return done.splits > 0

    def _find_torn(self) -> fracture.Torn:
        self._measure()
        criteria = [material.fracture for material in self._materials if material.fracture]
        with self._kernels():
            return fracture.find_torn(self._world, self._counts, criteria)

    def _reshape(self, parent: np.ndarray) -> None:
        """Go on with the elements as they are split; parent (n,): the present node that each is, or is a copy of."""
        w, counts, before = self._world, self._counts, self._layout.node_number
        with self._kernels():
            state = carrying.read_nodes(w, counts)
        self._take(self._split_layout())
        self._fill_topology()
        with self._kernels():
            carrying.write_nodes(w, counts, state, before[parent[self._layout.node_order]])

    def _become(self, cells: np.ndarray, origin: np.ndarray, tips: np.ndarray) -> None:
        """Have the elements `cells`, of nodes and copies of the scene's nodes `origin`, everything at rest."""
        if not self._may_break:
            raise InputError("the state is of a body that broke, and nothing of this scene breaks: give it a toughness")
        self._splitting = Splitting(cells, origin, tips)
        self._take(self._split_layout())
        self._fill()

    def _split_layout(self):
        split = self._splitting
        self._pieces, self._opened = label_pieces(split.cells, len(split.origin)), None
        whole = len(split.origin) == len(self._whole.rest)
        return self._whole if whole else split_layout(self._whole, split.cells, split.origin, self._pieces[2])
