"""A mesh that comes apart: vertices get copies, and elements that only an edge or a vertex holds are parted.

Slides 37 to 43. NumPy only. Elements stay as they are; only which vertices they share changes.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


class Splitting:
    """The elements of a mesh while its vertices are split.

    cells (m,d+1): vertices of the elements.  origin: for every vertex, copies included, the one it was at first.
    """

    def __init__(self, cells: np.ndarray, n_nodes: int) -> None:
        self.cells = cells.copy()
        self.origin = list(range(n_nodes))
        corner = cells.ravel()
        self._by_node = np.argsort(corner, kind="stable") // cells.shape[1]
        self._start = np.searchsorted(np.sort(corner), np.arange(n_nodes + 1))
        self._changed: dict[int, np.ndarray] = {}

    def star(self, node: int) -> np.ndarray:
        """The elements around a vertex."""
        if node in self._changed:
            return self._changed[node]
        return self._by_node[self._start[node] : self._start[node + 1]]

    def split(self, node: int, elements: np.ndarray) -> int:
        """Give some, not all, of the elements around a vertex a copy of it in its place; its number."""
        copy = len(self.origin)
        self.origin.append(self.origin[node])
        rest = np.setdiff1d(self.star(node), elements)
        corners = self.cells[elements]
        corners[corners == node] = copy
        self.cells[elements] = corners
        self._changed[node], self._changed[copy] = rest, np.sort(elements)
        return copy

    def cut(self, node: int, elements: np.ndarray) -> list[int]:
        """Split a vertex, and part what holds on by an edge or a vertex only; the ends of the cut.

        The ends are the other vertices of the faces that came open, as far as the two sides still share them.
        """
        rest = np.setdiff1d(self.star(node), elements)
        ends = self._shared(node, elements, rest)
        touched = [node, self.split(node, elements), *ends]
        before = {end: len(self.star(end)) for end in ends}
        self.part(touched)
        return [end for end in ends if len(self.star(end)) == before[end]]

    def part(self, nodes: Iterable[int]) -> None:
        """Give each group of elements around a vertex that no face joins to the others a copy of its own."""
        for node in nodes:
            for group in self._groups(node)[1:]:
                self.split(node, group)

    def _shared(self, node: int, some: np.ndarray, others: np.ndarray) -> list[int]:
        """Vertices besides `node` of the faces around it that lie between two sets of elements."""
        theirs = {face for e in others for face in self._faces(e, node)}
        found = {v for e in some for face in self._faces(e, node) if face in theirs for v in face}
        return sorted(found)

    def _faces(self, element: int, node: int) -> list[tuple[int, ...]]:
        """The faces of an element at a vertex, each as its other vertices."""
        others = sorted(v for v in self.cells[element].tolist() if v != node)
        return [tuple(v for v in others if v != left_out) for left_out in others]

    def _groups(self, node: int) -> list[np.ndarray]:
        """The elements around a vertex, in groups that hang together by faces at it; the largest first."""
        group = {int(e): [int(e)] for e in self.star(node)}
        seen: dict[tuple[int, ...], int] = {}
        for element in list(group):
            for face in self._faces(element, node):
                other = seen.setdefault(face, element)
                if group[other] is not group[element]:
                    joined = group[other] + group[element]
                    for e in joined:
                        group[e] = joined
        distinct = {id(g): g for g in group.values()}.values()
        return [np.array(sorted(g)) for g in sorted(distinct, key=lambda g: (-len(g), min(g)))]
