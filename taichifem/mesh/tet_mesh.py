"""The tetrahedral mesh: what a body is made of before it moves."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from os import PathLike

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh import implicit, reading, shapes, tetrahedralize, writing
from taichifem.mesh.cage import cage as enclose
from taichifem.mesh.connectivity import boundary_faces
from taichifem.mesh.embedded import EmbeddedSurface
from taichifem.mesh.simplex_mesh import SimplexMesh, check_file_source
from taichifem.mesh.validation import signed_sizes


class TetMesh(SimplexMesh):
    """Points and positively oriented tetrahedra; the arrays are read-only.

    Attributes:
        points: (n, 3) float64 positions [m].
        cells: (m, 4) int32 vertex indices from 0.
        regions: (m,) int32 label of each tetrahedron, 0 unless given.
        source: how the mesh was made, for example ``{"shape": "bar", "size": [1, 1, 1], "cells": [4, 4, 4]}``
            or ``{"file": "duck.ele"}``; None for bare arrays. `from_source` makes the mesh again.
        repairs: what validation put right.
    """

    dimension = 3
    SHAPES = shapes.SHAPES

    def volumes(self) -> np.ndarray:
        """Volume (m,) of each tetrahedron [m^3], all positive."""
        return signed_sizes(self.points, self.cells)

    @property
    def volume(self) -> float:
        """Volume of the whole mesh [m^3]."""
        return float(self.volumes().sum())

    def surface(self) -> np.ndarray:
        """Boundary triangles (k, 3), their normals pointing outward; computed once.

        Raises:
            InputError: a face belongs to more than two tetrahedra.
        """
        return self._surface

    def boundary(self) -> np.ndarray:
        """Faces that loads act on: those of the surface (k, 3)."""
        return self._surface

    @cached_property
    def _surface(self) -> np.ndarray:
        triangles, _ = boundary_faces(self.cells)
        triangles.flags.writeable = False
        return triangles

    def write(self, path: str | PathLike) -> None:
        """Write points, tetrahedra and regions in the format that the file's ending names.

        The file appears complete or not at all. `.node` and `.ele` are written together.

        Raises:
            InputError: unknown ending, folder missing or not writable, disk full.
        """
        writing.write(path, self.points, self.cells, self.regions)

    @classmethod
    def from_file(cls, path: str | PathLike, tets: int | None = None, cage: int | None = None) -> TetMesh:
        """Read a volume mesh, or read a closed surface and fill it with tetrahedra, or any surface and enclose it.

        Args:
            path: a volume mesh (`.msh .vtk .vtu .mesh .inp .node .ele .veg` and all else that meshio reads),
                a closed surface (`.stl .obj .ply .off .glb .gltf`), or `asset:NAME`.
            tets: about how many tetrahedra to fill a surface with; None leaves it to the tetrahedraliser.
            cage: make a coarse mesh of about as many tetrahedra around the surface instead, for it to be embedded in.

        Raises:
            InputError: there is no such file, it cannot be read, or it does not hold what is needed.
        """
        if cage is not None:
            if tets is not None:
                raise InputError(f"{path}: tets fills a surface and cage encloses it: give one of them")
            return cls(*enclose(EmbeddedSurface.from_file(path), cage), source={"file": str(path), "cage": cage})
        content = reading.read(path, surface_wanted=tets is not None)
        source = {"file": str(path)} | ({} if tets is None else {"tets": tets})
        try:
            if isinstance(content, reading.Surface):
                return cls.from_surface(content.points, content.triangles, tets, source)
            if tets is not None:
                raise InputError("is made of tetrahedra already; leave out the number of tets")
            mesh = cls(content.points, content.cells, content.regions, source)
            mesh.surface()
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        return mesh

    @classmethod
    def from_surface(cls, points, triangles, tets: int | None = None, source: dict | None = None) -> TetMesh:
        """Fill a closed surface with tetrahedra; the result is kept in the user's cache folder.

        Args:
            points: (n, 3) positions [m]; points at the same place are merged.
            triangles: (k, 3) vertex indices.
            tets: about how many tetrahedra are wanted (within some 30 %); None takes the library's default.

        Raises:
            InputError: the surface is open, or the extra `tetrahedralize` is not installed.
        """
        return cls(*tetrahedralize.tetrahedralize(points, triangles, tets), source=source)

    @classmethod
    def from_implicit(cls, function: Callable[[np.ndarray], np.ndarray], lower, upper, spacing: float) -> TetMesh:
        """Mesh the solid where `function` is negative. See `taichifem.mesh.implicit.stuff`."""
        return cls(*implicit.stuff(function, lower, upper, spacing))

    @classmethod
    def bar(cls, size=(1.0, 0.25, 0.25), cells=(16, 4, 4), split: int = 5) -> TetMesh:
        """A box from the origin to `size` [m]. See `taichifem.mesh.shapes.bar`."""
        return cls._shape("bar", size=size, cells=cells, split=split)

    @classmethod
    def cylinder(cls, radius: float = 0.25, height: float = 1.0, resolution: int = 3) -> TetMesh:
        """A solid cylinder about the z axis. See `taichifem.mesh.shapes.cylinder`."""
        return cls._shape("cylinder", radius=radius, height=height, resolution=resolution)

    @classmethod
    def hollow_cylinder(
        cls, inner_radius: float = 0.15, outer_radius: float = 0.25, height: float = 0.5, resolution: int = 2
    ) -> TetMesh:
        """A tube about the z axis. See `taichifem.mesh.shapes.hollow_cylinder`."""
        sizes = {"inner_radius": inner_radius, "outer_radius": outer_radius, "height": height}
        return cls._shape("hollow_cylinder", **sizes, resolution=resolution)

    @classmethod
    def sphere(cls, radius: float = 0.5, resolution: int = 5) -> TetMesh:
        """A ball about the origin. See `taichifem.mesh.shapes.sphere`."""
        return cls._shape("sphere", radius=radius, resolution=resolution)

    @classmethod
    def torus(cls, major_radius: float = 0.35, minor_radius: float = 0.15, resolution: int = 3) -> TetMesh:
        """A solid ring about the z axis. See `taichifem.mesh.shapes.torus`."""
        return cls._shape("torus", major_radius=major_radius, minor_radius=minor_radius, resolution=resolution)

    @classmethod
    def _file(cls, file: str | None = None, tets: int | None = None, cage: int | None = None, **unknown) -> TetMesh:
        check_file_source(file, unknown)
        return cls.from_file(file, tets, cage)
