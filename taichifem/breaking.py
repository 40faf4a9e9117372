"""Bodies that break: the mesh changes between two steps, and all that depends on it follows."""

from __future__ import annotations

import numpy as np

from taichifem import transfer
from taichifem.bodies import Bodies
from taichifem.description import Scene
from taichifem.mesh.connectivity import pieces
from taichifem.processes import fracture
from taichifem.state import element_fields, node_fields
from taichifem.topology import split_layout


class BreakingBodies(Bodies):
    """Bodies whose elements may part. Nodes that come from splits follow those of the scene, in their order."""

    def __init__(self, scene: Scene, *, precision: str, arch: str | None, threads: int | None) -> None:
        super().__init__(scene, precision=precision, arch=arch, threads=threads)
        self._may_break = any(material.fracture for material in self._materials)
        self._origin = np.arange(self._counts.nodes)  # of which node of the scene each is a copy
        self._tips = np.zeros(self._counts.nodes, dtype=bool)  # where cracks end
        self.splits, self.more_splits = 0, False  # in the last step: how many, and was the cap hit?
        self._pieces: tuple[int, np.ndarray, np.ndarray] | None = None

    @property
    def piece_count(self) -> int:
        """Number of pieces: sets of elements that hang together."""
        return self._labelled()[0]

    @property
    def cell_pieces(self) -> np.ndarray:
        """Piece of each element (m,), from 0; those of the first elements come first."""
        return self._labelled()[1]

    @property
    def surface_pieces(self) -> np.ndarray:
        """Piece of each triangle of the surface (k,)."""
        return self._labelled()[2][self.surface[:, 0]]

    @property
    def origins(self) -> np.ndarray:
        """Of which node of the scene each node is a copy (n,); those of the scene are their own."""
        return self._origin.copy()

    @property
    def crack_faces(self) -> np.ndarray:
        """Which triangles of the surface (k,) fracture has opened."""
        return self._layout.cracked

    def _labelled(self) -> tuple[int, np.ndarray, np.ndarray]:
        """Number of pieces, and the piece of each element and of each node."""
        if self._pieces is None:
            count, of_node = pieces(self.cells, self._counts.nodes)
            of_cell = of_node[self.cells[:, 0]]
            _, first = np.unique(of_cell, return_index=True)
            rank = np.empty(count, dtype=np.int32)
            rank[of_cell[np.sort(first)]] = np.arange(count)
            self._pieces = count, rank[of_cell], rank[of_node]
        return self._pieces

    def _break(self, step: int) -> bool:
        """Split what is torn beyond its toughness; did anything part? step: number of the step, for the seed."""
        self.splits, self.more_splits = 0, False
        torn = self._find_torn()
        if not len(torn.place):
            return False
        broken = fracture.propagate(
            self.cells,
            self.positions,
            torn,
            self._tips,
            rng=np.random.default_rng([self.scene.seed, step]),
            most=self.scene.max_splits,
        )
        if broken is None:
            return False
        self.splits, self.more_splits = broken.splits, broken.capped
        self._reshape(broken.split.cells, np.array(broken.split.origin))
        self._tips = broken.tips
        return True

    def _find_torn(self) -> fracture.Torn:
        """What is torn beyond its toughness now."""
        w, n, m = self._world, self._counts.nodes, self._counts.elements
        criteria = [material.fracture for material in self._materials if material.fracture]
        used = {criterion.criterion for criterion in criteria}
        self._measure()
        with self._kernels():
            for done in range(max((criterion.smoothing for criterion in criteria), default=0)):
                fracture.average(w, n, m, done)
            if "principal-stress" in used:
                fracture.find_tension(w, m)
            if "separation-tensor" in used:
                fracture.find_separation(w, n, m)
        tension = self._read(w.energy) if "principal-stress" in used else np.zeros(0)
        parting = self._read(w.parting) if "separation-tensor" in used else np.zeros((0, 4))
        stress = self._read(w.stress) if (tension > 1).any() else np.zeros((len(tension), 3, 3))
        return fracture.Torn.of(tension, stress, parting)

    def _reshape(self, cells: np.ndarray, parent: np.ndarray) -> None:
        """Go on with the elements `cells`; parent (n,): the present node that each node is, or is a copy of."""
        w, counts = self._world, self._counts
        of_nodes, of_elements = node_fields(self.scene), element_fields(self._laws)
        with self._kernels():
            nodes = {k: self._given(transfer.read(w, getattr(w, k), counts.nodes))[parent] for k in of_nodes}
            elements = {k: self._given_cells(transfer.read(w, getattr(w, k), counts.elements)) for k in of_elements}
            contacts = transfer.read_contacts(w, counts.colliders, counts.nodes)
        before = np.argsort(self._layout.node_order)[parent]
        self._become(cells, self._origin[parent])
        layout = self._layout
        with self._kernels():
            for name, values in nodes.items():
                transfer.write(w, getattr(w, name), values[layout.node_order])
            for name, values in elements.items():
                transfer.write(w, getattr(w, name), values[layout.cell_order])
            here = before[layout.node_order]
            transfer.write_contacts(w, {name: values[:, here] for name, values in contacts.items()})

    def _become(self, cells: np.ndarray, origin: np.ndarray) -> None:
        """Have the elements `cells`, of nodes and copies of the scene's nodes `origin`, everything at rest."""
        whole = len(origin) == len(self._whole.rest)
        self._origin, self._pieces = origin, None
        self._take(self._whole if whole else split_layout(self._whole, cells, origin))
        self._fill()
