"""Meshes of tetrahedra, and of triangles in the plane: shapes, files, checks and quality.

NumPy only: nothing here starts Taichi.
"""

from taichifem.mesh.assets import asset_names, asset_path
from taichifem.mesh.embedded import EmbeddedSurface
from taichifem.mesh.kinds import Mesh, mesh_from_source
from taichifem.mesh.quality import Quality, quality
from taichifem.mesh.report import report
from taichifem.mesh.tet_mesh import TetMesh
from taichifem.mesh.tri_mesh import TriMesh
from taichifem.mesh.tri_quality import TriQuality
from taichifem.mesh.validation import Repairs

__all__ = [
    "EmbeddedSurface",
    "Mesh",
    "Quality",
    "Repairs",
    "TetMesh",
    "TriMesh",
    "TriQuality",
    "asset_names",
    "asset_path",
    "mesh_from_source",
    "quality",
    "report",
]
