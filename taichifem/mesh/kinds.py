"""Either kind of mesh, told apart by how it was made."""

from __future__ import annotations

from taichifem.mesh.tet_mesh import TetMesh
from taichifem.mesh.tri_mesh import TriMesh

Mesh = TetMesh | TriMesh
SHAPES = {**TetMesh.SHAPES, **TriMesh.SHAPES}


def kind_of(source: dict) -> type[TetMesh] | type[TriMesh]:
    """Which kind of mesh has this `source`: a shape of the plane or a planar file makes a TriMesh."""
    return TriMesh if source.get("planar") or source.get("shape") in TriMesh.SHAPES else TetMesh


def mesh_from_source(source: dict) -> Mesh:
    """Make again the mesh whose `source` this is.

    Raises:
        InputError: the shape or one of its parameters is unknown or wrong, or the file cannot be read.
    """
    kind = kind_of(source)
    return kind.from_source({key: value for key, value in source.items() if key != "planar" or kind is TriMesh})
