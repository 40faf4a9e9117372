"""Tetrahedral meshes: shapes, files, checks and quality. NumPy only: nothing here starts Taichi."""

from taichifem.mesh.assets import asset_names, asset_path
from taichifem.mesh.quality import Quality, quality, report
from taichifem.mesh.tet_mesh import TetMesh
from taichifem.mesh.validation import Repairs

__all__ = ["Quality", "Repairs", "TetMesh", "asset_names", "asset_path", "quality", "report"]
