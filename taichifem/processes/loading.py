"""Loads on the nodes: forces, tractions, pressures. NumPy only."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from taichifem.description import Force, Load, Pressure, Traction
from taichifem.layout import Layout, LoadGroup


class Loading:
    """The loads of a scene as forces on its nodes."""

    def __init__(self, layout: Layout) -> None:
        self._groups = layout.loads
        self._rest, self._dimension = layout.rest, layout.dimension

    @property
    def follows(self) -> bool:
        """Does some load change with the shape?"""
        return any(isinstance(group.load, Pressure) for group in self._groups)

    def shares(self, time: float) -> list[float]:
        """The part of each load that acts at `time` [s]."""
        return [group.load.share_at(time) for group in self._groups]

    def jumps(self, before: float, after: float) -> bool:
        """Does some load set in at once, or end, between the steps that end at these times [s]?"""
        for load in (group.load for group in self._groups):
            acted, acts = load.share_at(before) > 0, load.share_at(after) > 0
            if acted != acts and not (acts and load.ramp > 0):
                return True
        return False

    def forces(self, share: Callable[[Load], float], positions: np.ndarray | None = None) -> np.ndarray:
        """Forces (n,3) [N]; share: the part of a load that acts; positions (n,3) [m], None for those at rest."""
        total = np.zeros_like(self._rest)
        for group in self._groups:
            part = share(group.load)
            if part:
                self._add(total, group, part, self._rest if positions is None else positions)
        return total

    def _add(self, total: np.ndarray, group: LoadGroup, part: float, positions: np.ndarray) -> None:
        load, nodes = group.load, group.where
        if isinstance(load, Force):
            total[nodes] += part * np.asarray(load.force) / len(nodes)
            return
        if isinstance(load, Traction):
            area = np.linalg.norm(self._outward(self._rest, group), axis=1)
            face = part * area[:, None] * np.asarray(load.traction)
        else:
            face = -part * load.pressure * self._outward(positions, group)
        for corner in range(nodes.shape[1]):
            np.add.at(total, nodes[:, corner], face / nodes.shape[1])

    def _outward(self, positions: np.ndarray, group: LoadGroup) -> np.ndarray:
        """Outward normals of the faces (k,3), as long as their area [m^2]."""
        corners = positions[group.where]
        if self._dimension == 3:
            return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
        along = corners[:, 1] - corners[:, 0]
        # The boundary runs counter-clockwise in (x, z): outward is to the right of it.
        return group.thickness * np.column_stack([along[:, 2], 0 * along[:, 1], -along[:, 0]])
