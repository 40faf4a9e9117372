"""The tetrahedral mesh: what a body is made of before it moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from os import PathLike

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh import implicit, reading, shapes, tetrahedralize, writing
from taichifem.mesh.connectivity import boundary_faces
from taichifem.mesh.validation import signed_volumes, validate


class TetMesh:
    """Points and positively oriented tetrahedra; the arrays are read-only.

    Attributes:
        points: (n, 3) float64 positions [m].
        cells: (m, 4) int32 vertex indices from 0.
        regions: (m,) int32 label of each tetrahedron, 0 unless given.
        source: how the mesh was made, for example ``{"shape": "bar", "size": [1, 1, 1], "cells": [4, 4, 4]}``
            or ``{"file": "duck.ele"}``; None for bare arrays. `from_source` makes the mesh again.
        repairs: what validation put right.
    """

    def __init__(self, points, cells, regions=None, source: dict | None = None) -> None:
        """Check the arrays, orient the tetrahedra and drop points that no tetrahedron uses.

        Raises:
            InputError: the arrays are no mesh: wrong shapes, values that are not finite, indices out of
                range, elements without volume.
        """
        self.points, self.cells, self.regions, self.repairs = validate(points, cells, regions)
        self.source = source
        for array in (self.points, self.cells, self.regions):
            array.flags.writeable = False

    def __repr__(self) -> str:
        return f"TetMesh({len(self.points)} points, {len(self.cells)} tetrahedra, source={self.source})"

    def volumes(self) -> np.ndarray:
        """Volume (m,) of each tetrahedron [m^3], all positive."""
        return signed_volumes(self.points, self.cells)

    @property
    def volume(self) -> float:
        """Volume of the whole mesh [m^3]."""
        return float(self.volumes().sum())

    @property
    def bounds(self) -> np.ndarray:
        """Lowest and highest corner of the bounding box, (2, 3) [m]."""
        return np.array([self.points.min(axis=0), self.points.max(axis=0)])

    def surface(self) -> np.ndarray:
        """Boundary triangles (k, 3), their normals pointing outward; computed once.

        Raises:
            InputError: a face belongs to more than two tetrahedra.
        """
        return self._surface

    @cached_property
    def _surface(self) -> np.ndarray:
        triangles, _ = boundary_faces(self.cells)
        triangles.flags.writeable = False
        return triangles

    def transformed(self, scale=1.0, rotation=None, translation=(0.0, 0.0, 0.0)) -> TetMesh:
        """A copy that is scaled, then rotated, then moved.

        Args:
            scale: positive factor, or one per axis (3,).
            rotation: (3, 3) rotation matrix applied to column vectors, or None.
            translation: (3,) shift [m].

        Raises:
            InputError: an argument has a wrong shape, is not finite, or is no scale or rotation.
        """
        rotation = np.eye(3) if rotation is None else rotation
        scale, rotation, translation = (
            _finite(name, value, shape)
            for name, value, shape in (
                ("scale", scale, ((), (3,))),
                ("rotation", rotation, ((3, 3),)),
                ("translation", translation, ((3,),)),
            )
        )
        if np.any(scale <= 0):
            raise InputError(f"scale must be positive, not {scale.tolist()}")
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(rotation) < 0:
            raise InputError("rotation must be a 3x3 rotation matrix: orthogonal, with determinant +1")
        step = {"scale": scale.tolist(), "rotation": rotation.tolist(), "translation": translation.tolist()}
        source = self.source and {**self.source, "transforms": [*self.source.get("transforms", []), step]}
        mesh = TetMesh((self.points * scale) @ rotation.T + translation, self.cells, self.regions, source)
        mesh.repairs = replace(mesh.repairs, flipped=self.repairs.flipped, orphans=self.repairs.orphans)
        return mesh

    def write(self, path: str | PathLike) -> None:
        """Write points, tetrahedra and regions in the format that the file's ending names.

        The file appears complete or not at all. `.node` and `.ele` are written together.

        Raises:
            InputError: unknown ending, folder missing or not writable, disk full.
        """
        writing.write(path, self.points, self.cells, self.regions)

    @classmethod
    def from_file(cls, path: str | PathLike, tets: int | None = None) -> TetMesh:
        """Read a volume mesh, or read a closed surface and fill it with tetrahedra.

        Args:
            path: a volume mesh (`.msh .vtk .vtu .mesh .inp .node .ele .veg` and all else that meshio reads),
                a closed surface (`.stl .obj .ply .off .glb .gltf`), or `asset:NAME`.
            tets: about how many tetrahedra to fill a surface with; None leaves it to the tetrahedraliser.

        Raises:
            InputError: there is no such file, it cannot be read, or it does not hold what is needed.
        """
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
    def from_source(cls, source: dict) -> TetMesh:
        """Make again the mesh whose `source` this is.

        Raises:
            InputError: the shape or one of its parameters is unknown or wrong, or the file cannot be read.
        """
        source = dict(source)
        transforms = source.pop("transforms", [])
        mesh = cls._shape(source.pop("shape"), **source) if "shape" in source else cls._file(**source)
        for step in transforms:
            mesh = mesh.transformed(**step)
        return mesh

    @classmethod
    def _file(cls, file: str | None = None, tets: int | None = None, **unknown) -> TetMesh:
        if file is None or unknown:
            raise InputError(f"a mesh needs a 'shape' or a 'file'{_not(unknown)}")
        return cls.from_file(file, tets)

    @classmethod
    def _shape(cls, shape: str, **parameters) -> TetMesh:
        if shape not in shapes.SHAPES:
            raise InputError(f"unknown shape {shape!r}; choose from {', '.join(shapes.SHAPES)}")
        points, cells, source = shapes.make(shape, parameters)
        return cls(points, cells, source=source)


def _not(unknown: dict) -> str:
    return f", and knows no {', '.join(map(repr, unknown))}" if unknown else ""


def _finite(name: str, value, shapes_allowed: tuple) -> np.ndarray:
    try:
        value = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be made of numbers, not {value!r}") from None
    if value.shape not in shapes_allowed or not np.isfinite(value).all():
        raise InputError(f"{name} must be finite numbers of shape {' or '.join(map(str, shapes_allowed))}")
    return value
