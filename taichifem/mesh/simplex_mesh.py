"""What meshes of triangles and of tetrahedra have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import ClassVar, Self

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh import parameters
from taichifem.mesh.validation import ELEMENTS, validate


class SimplexMesh:
    """Points and positively oriented elements; the arrays are read-only. Use TetMesh or TriMesh.

    Attributes:
        dimension: 3 for tetrahedra, 2 for triangles: the number of coordinates of a point.
        SHAPES: the shapes that can be made, by name.
    """

    dimension: ClassVar[int]
    SHAPES: ClassVar[dict[str, Callable[..., parameters.Arrays]]]

    def __init__(self, points, cells, regions=None, source: dict | None = None) -> None:
        """Check the arrays, orient the elements and drop points that no element uses.

        Raises:
            InputError: the arrays are no mesh: wrong shapes, values that are not finite, indices out of
                range, elements without volume or area.
        """
        self.points, self.cells, self.regions, self.repairs = validate(points, cells, regions, self.dimension)
        self.source = source
        for array in (self.points, self.cells, self.regions):
            array.flags.writeable = False

    def __repr__(self) -> str:
        elements = f"{len(self.cells)} {ELEMENTS[self.dimension]}"
        return f"{type(self).__name__}({len(self.points)} points, {elements}, source={self.source})"

    @property
    def bounds(self) -> np.ndarray:
        """Lowest and highest corner of the bounding box, (2, dimension) [m]."""
        return np.array([self.points.min(axis=0), self.points.max(axis=0)])

    def transformed(self, scale=1.0, rotation=None, translation=None) -> Self:
        """A copy that is scaled, then rotated, then moved.

        Args:
            scale: positive factor, or one per axis (d,), where d is the mesh's dimension.
            rotation: (d, d) rotation matrix applied to column vectors, or None.
            translation: (d,) shift [m], or None.

        Raises:
            InputError: an argument has a wrong shape, is not finite, or is no scale or rotation.
        """
        size = self.dimension
        rotation = np.eye(size) if rotation is None else rotation
        translation = np.zeros(size) if translation is None else translation
        scale, rotation, translation = (
            _finite(name, value, shape)
            for name, value, shape in (
                ("scale", scale, ((), (size,))),
                ("rotation", rotation, ((size, size),)),
                ("translation", translation, ((size,),)),
            )
        )
        if np.any(scale <= 0):
            raise InputError(f"scale must be positive, not {scale.tolist()}")
        if not np.allclose(rotation @ rotation.T, np.eye(size), atol=1e-6) or np.linalg.det(rotation) < 0:
            raise InputError(f"rotation must be a {size}x{size} rotation matrix: orthogonal, with determinant +1")
        step = {"scale": scale.tolist(), "rotation": rotation.tolist(), "translation": translation.tolist()}
        source = self.source and {**self.source, "transforms": [*self.source.get("transforms", []), step]}
        mesh = type(self)((self.points * scale) @ rotation.T + translation, self.cells, self.regions, source)
        mesh.repairs = replace(mesh.repairs, flipped=self.repairs.flipped, orphans=self.repairs.orphans)
        return mesh

    @classmethod
    def from_source(cls, source: dict) -> Self:
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
    def _shape(cls, shape: str, **given) -> Self:
        if shape not in cls.SHAPES:
            raise InputError(f"unknown shape {shape!r}; choose from {', '.join(cls.SHAPES)}")
        points, cells, source = parameters.make(cls.SHAPES[shape], given)
        return cls(points, cells, source=source)


def check_file_source(file: str | None, unknown: dict) -> None:
    """Refuse a source that names no file, or that has more than a file can be read with."""
    if file is None or unknown:
        no = f", and knows no {', '.join(map(repr, unknown))}" if unknown else ""
        raise InputError(f"a mesh needs a 'shape' or a 'file'{no}")


def _finite(name: str, value, shapes_allowed: tuple) -> np.ndarray:
    try:
        value = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be made of numbers, not {value!r}") from None
    if value.shape not in shapes_allowed or not np.isfinite(value).all():
        raise InputError(f"{name} must be finite numbers of shape {' or '.join(map(str, shapes_allowed))}")
    return value
