"""Reading plane triangle meshes out of files whose points may have three coordinates."""

from os import PathLike

import meshio
import numpy as np

from taichifem.errors import InputError
from taichifem.mesh.obj import read_obj
from taichifem.mesh.reading import attempt, located, region_labels
from taichifem.mesh.tetgen import read_tetgen
from taichifem.mesh.validation import checked_cells, checked_points

FLAT = 1e-6  # largest deviation from a plane over the diagonal of the bounding box: what single precision leaves
DIFFERENT = ("tetra", "hexahedron", "wedge", "pyramid", "quad", "polygon", "polyhedron", "triangle")


def read_planar(path: str | PathLike) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Read the triangles of a file that lie in the x-z plane (y constant) or in the x-y plane (z constant).

    The constant is dropped. In the x-y plane, which is where drawings and most 2-D meshes lie, y becomes z.

    Args:
        path: the file; its ending tells the format.

    Returns:
        Points (n, 2) as (x, z) [m], triangles (m, 3), and regions (m,) or None.

    Raises:
        InputError: no such file, unknown ending, unreadable content, elements that are not triangles, or a mesh
            that is not flat.
    """
    place = located(path)
    suffix = place.suffix.lower()
    try:
        if suffix in (".node", ".ele"):
            return attempt(lambda file: read_tetgen(file, dimension=2), place)
        if suffix not in meshio.extension_to_filetypes:
            known = ".msh .vtk .vtu .mesh .inp .node .ele .obj .stl .ply .off"
            raise InputError(f"has an ending that is not known for triangles; use one of {known}")
        if suffix == ".obj":
            points, cells, regions = attempt(read_obj, place)
        else:
            points, cells, regions = _triangles(attempt(meshio.read, place))
        cells = checked_cells(cells, len(points), 2)
        return _flattened(points, cells), cells, regions
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _triangles(mesh: meshio.Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    kinds = [block.type for block in mesh.cells]
    for kind in kinds:
        if kind == "tetra":
            raise InputError("holds tetrahedra; it is no planar mesh")
        if kind != "triangle" and kind.startswith(DIFFERENT):
            raise InputError(f"holds {kind} elements; convert them to linear (3-node) triangles")
    blocks = [i for i, kind in enumerate(kinds) if kind == "triangle" and len(mesh.cells[i].data)]
    if not blocks:
        raise InputError("has no triangles; export a triangulated mesh")
    cells = np.concatenate([mesh.cells[i].data for i in blocks])
    return np.asarray(mesh.points), cells, region_labels(mesh, blocks)


def _flattened(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Points as (n, 2); only those that triangles use need to lie in the plane."""
    if points.ndim == 2 and points.shape[1] == 2:
        return points
    points = checked_points(points, 3)
    size = np.ptp(points[np.unique(cells)], axis=0)
    flat = size <= FLAT * np.linalg.norm(size)
    if flat[1]:
        return points[:, [0, 2]]
    if flat[2]:
        return points[:, [0, 1]]
    if flat[0]:
        raise InputError("lies in the y-z plane (x is constant); turn it into the x-z plane")
    shown = " x ".join(f"{length:.4g}" for length in size)
    raise InputError(f"is not flat: it extends {shown} m along x, y and z; lay it in the x-z or in the x-y plane")
