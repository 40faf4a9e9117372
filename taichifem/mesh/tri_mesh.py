"""The plane triangle mesh: what a two-dimensional body is made of before it moves."""

from __future__ import annotations

from os import PathLike

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh import planar, shapes2d, writing
from taichifem.mesh.connectivity import boundary_faces, overlapping
from taichifem.mesh.simplex_mesh import SimplexMesh, check_file_source
from taichifem.mesh.validation import few, signed_sizes


class TriMesh(SimplexMesh):
    """Points and counter-clockwise triangles in the plane y = 0 of the world; the arrays are read-only.

    A point is (x, z): x to the right and z up, as seen by someone who looks along the y axis.

    Attributes:
        points: (n, 2) float64 positions [m].
        cells: (m, 3) int32 vertex indices from 0.
        regions: (m,) int32 label of each triangle, 0 unless given.
        source: how the mesh was made, for example ``{"shape": "disk", "radius": 0.5, "rings": 5}`` or
            ``{"file": "sheet.msh", "planar": True}``; None for bare arrays. `from_source` makes the mesh again.
        repairs: what validation put right.
    """

    dimension = 2
    SHAPES = shapes2d.SHAPES

    def __init__(self, points, cells, regions=None, source: dict | None = None) -> None:
        """Check the arrays, turn the triangles counter-clockwise and drop points that no triangle uses.

        Raises:
            InputError: the arrays are no mesh: wrong shapes, values that are not finite, indices out of range,
                triangles without area, an edge of more than two triangles, triangles that overlap their neighbours.
        """
        super().__init__(points, cells, regions, source)
        self._boundary, _ = boundary_faces(self.cells)
        self._boundary.flags.writeable = False
        folded = overlapping(self.cells)
        if len(folded):
            raise InputError(f"triangles {few(folded)} overlap a neighbour; remove them, or unfold the mesh")

    def areas(self) -> np.ndarray:
        """Area (m,) of each triangle [m^2], all positive."""
        return signed_sizes(self.points, self.cells)

    @property
    def area(self) -> float:
        """Area of the whole mesh [m^2]."""
        return float(self.areas().sum())

    def boundary(self) -> np.ndarray:
        """Edges (k, 2) that one triangle only has, each with the body on its left: counter-clockwise about it."""
        return self._boundary

    def surface(self) -> np.ndarray:
        """What is drawn: the triangles (m, 3) themselves. Their normals point to -y, to whoever looks along y."""
        return self.cells

    def write(self, path: str | PathLike) -> None:
        """Write points as (x, 0, z), triangles and regions in the format that the file's ending names.

        The file appears complete or not at all. `.obj` keeps no regions.

        Raises:
            InputError: unknown ending, folder missing or not writable, disk full.
        """
        x, z = self.points.T
        writing.write(path, np.column_stack([x, np.zeros(len(x)), z]), self.cells, self.regions)

    @classmethod
    def from_file(cls, path: str | PathLike) -> TriMesh:
        """Read the triangles of a file. See `taichifem.mesh.planar.read_planar`.

        Args:
            path: a mesh of triangles (`.msh .vtk .vtu .mesh .inp .node .ele .obj .stl .ply .off` and all else that
                meshio reads) in the x-z plane or in the x-y plane, whose y then points up.

        Raises:
            InputError: there is no such file, it cannot be read, or it does not hold a plane triangle mesh.
        """
        points, cells, regions = planar.read_planar(path)
        try:
            return cls(points, cells, regions, {"file": str(path), "planar": True})
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @classmethod
    def rectangle(cls, size=(1.0, 0.25), cells=(16, 4), pattern: str = "alternating") -> TriMesh:
        """A rectangle from the origin to `size` [m]. See `taichifem.mesh.shapes2d.rectangle`."""
        return cls._shape("rectangle", size=size, cells=cells, pattern=pattern)

    @classmethod
    def quadrilateral(cls, corners, cells=(8, 8), pattern: str = "alternating") -> TriMesh:
        """A convex quadrilateral with the given corners [m]. See `taichifem.mesh.shapes2d.quadrilateral`."""
        return cls._shape("quadrilateral", corners=corners, cells=cells, pattern=pattern)

    @classmethod
    def disk(cls, radius: float = 0.5, rings: int = 5) -> TriMesh:
        """A disk about the origin. See `taichifem.mesh.shapes2d.disk`."""
        return cls._shape("disk", radius=radius, rings=rings)

    @classmethod
    def ring(cls, inner: float = 0.25, outer: float = 0.5, rings: int = 4) -> TriMesh:
        """A disk with a round hole, about the origin. See `taichifem.mesh.shapes2d.ring`."""
        return cls._shape("ring", inner=inner, outer=outer, rings=rings)

    @classmethod
    def _file(cls, file: str | None = None, planar: bool = True, **unknown) -> TriMesh:
        check_file_source(file, unknown if planar else {"planar": planar, **unknown})
        return cls.from_file(file)
