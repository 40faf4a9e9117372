"""Reading mesh files: every format ends up as plain arrays, every failure as one line."""

import contextlib
import io
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import trimesh

from taichifem.errors import InputError
from taichifem.mesh.assets import PREFIX, asset_path
from taichifem.mesh.tetgen import read_tetgen
from taichifem.mesh.veg import read_veg

SURFACE_SUFFIXES = {".stl", ".obj", ".ply", ".off", ".glb", ".gltf"}
REGION_NAMES = ("gmsh:physical", "medit:ref", "cell_tags", "regions", "region", "mat_id", "material")
OTHER_SOLIDS = ("hexahedron", "wedge", "pyramid", "tetra")  # "tetra" followed by a number of nodes


@dataclass(frozen=True)
class Solid:
    """What a volume mesh file holds: points (n, 3), cells (m, 4), regions (m,) or None."""

    points: np.ndarray
    cells: np.ndarray
    regions: np.ndarray | None = None


@dataclass(frozen=True)
class Surface:
    """What a surface file holds: points (n, 3), triangles (k, 3), and of the points colours (n, 3) in [0, 1] or None,
    places in a texture (n, 2) or None."""

    points: np.ndarray
    triangles: np.ndarray
    colors: np.ndarray | None = None
    uv: np.ndarray | None = None


def read(path: str | PathLike, surface_wanted: bool = False) -> Solid | Surface:
    """Read a mesh file of any known format, or `asset:NAME`.

    Args:
        path: the file; its ending tells the format.
        surface_wanted: take the triangles of a volume format without tetrahedra, instead of refusing.

    Raises:
        InputError: no such file, unknown ending, unreadable content, or elements that are not tetrahedra.
    """
    name, path = str(path), located(path)
    suffix = path.suffix.lower()
    try:
        if suffix in SURFACE_SUFFIXES:
            return _read_surface(path)
        if suffix == ".veg":
            return Solid(*attempt(read_veg, path))
        if suffix in (".node", ".ele"):
            return Solid(*attempt(read_tetgen, path))
        if suffix not in meshio.extension_to_filetypes:
            known = ".msh .vtk .vtu .mesh .inp .node .ele .veg .stl .obj .ply .glb"
            raise InputError(f"has an ending that is not known; use one of {known}")
        return _sort_cells(attempt(meshio.read, path), path, surface_wanted)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def located(path: str | PathLike) -> Path:
    """The file that `path` or `asset:NAME` means.

    Raises:
        InputError: there is none.
    """
    name = str(path)
    path = asset_path(name.removeprefix(PREFIX)) if name.startswith(PREFIX) else Path(path)
    if path.is_dir():
        raise InputError(f"{name}: is a folder; name a mesh file in it")
    if not path.exists():
        raise InputError(f"{name}: there is no such file; check the path")
    return path


def attempt(reader: Callable[[Path], Any], path: Path) -> Any:
    """Run a reader in silence and turn whatever it does wrong into one line."""
    try:
        silence = contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO())
        with silence[0], silence[1], warnings.catch_warnings(action="ignore"):
            return reader(path)
    except InputError:
        raise
    except (PermissionError, IsADirectoryError) as error:
        raise InputError(f"cannot be read ({error.strerror}); check its permissions") from None
    except MemoryError:
        raise InputError("does not fit into memory; use a coarser mesh") from None
    except ImportError as error:
        if error.name == "charset_normalizer":
            raise InputError("holds text that is not UTF-8, or none; save it as UTF-8") from None
        raise InputError(f"needs the package {error.name} to be read: pip install {error.name}") from None
    except (Exception, SystemExit) as error:
        said_why = not isinstance(error, SystemExit) and str(error).strip()
        reason = f" ({' '.join(str(error).split())[:120]})" if said_why else ""
        raise InputError(f"is damaged or is no {path.suffix} file{reason}; export it again") from None


def _sort_cells(mesh: meshio.Mesh, path: Path, surface_wanted: bool) -> Solid | Surface:
    kinds = [block.type for block in mesh.cells]
    for kind in kinds:
        if kind != "tetra" and kind.startswith(OTHER_SOLIDS):
            raise InputError(f"holds {kind} elements; convert them to linear (4-node) tetrahedra")
    points = np.asarray(mesh.points)
    blocks = [i for i, kind in enumerate(kinds) if kind == "tetra" and len(mesh.cells[i].data)]
    if blocks:
        return Solid(points, np.concatenate([mesh.cells[i].data for i in blocks]), region_labels(mesh, blocks))
    triangles = [block.data for block in mesh.cells if block.type == "triangle"]
    if triangles and surface_wanted:
        return Surface(points, np.concatenate(triangles))
    raise InputError(
        f"has no tetrahedra; a closed surface can be tetrahedralised with `taichifem mesh {path.name} -o OUT --tets N`"
    )


def region_labels(mesh: meshio.Mesh, blocks: list[int]) -> np.ndarray | None:
    """One integer per element of `blocks` from the first suitable cell data, or from sets of elements."""
    others = [name for name in mesh.cell_data if name not in REGION_NAMES and name != "gmsh:geometrical"]
    for name in (*REGION_NAMES, *others, "gmsh:geometrical"):
        if name not in mesh.cell_data:
            continue
        data = np.concatenate([np.asarray(mesh.cell_data[name][i]) for i in blocks])
        if data.ndim == 2 and data.shape[1] == 1:
            data = data[:, 0]
        if data.ndim == 1 and np.issubdtype(data.dtype, np.integer):
            return data.astype(np.int32)
    return _regions_from_sets(mesh, blocks)


def _regions_from_sets(mesh: meshio.Mesh, blocks: list[int]) -> np.ndarray | None:
    if not mesh.cell_sets:
        return None
    labels = [np.zeros(len(block.data), np.int32) for block in mesh.cells]
    for label, (name, members) in enumerate(mesh.cell_sets.items(), start=1):
        digits = name.removeprefix("region_")
        for i in blocks:
            if members[i] is not None:
                labels[i][np.asarray(members[i], int)] = int(digits) if digits.isdecimal() else label
    return np.concatenate([labels[i] for i in blocks])


def _read_surface(path: Path) -> Surface:
    mesh = attempt(lambda file: trimesh.load(file, force="mesh", process=False), path)
    triangles = getattr(mesh, "faces", None)
    if triangles is None or len(triangles) == 0:
        raise InputError("holds no triangles; export a closed surface")
    colors = None
    if getattr(mesh.visual, "kind", None) == "vertex":
        colors = np.asarray(mesh.visual.vertex_colors, float)[:, :3] / 255
    uv = getattr(mesh.visual, "uv", None)
    uv = None if uv is None or len(uv) != len(mesh.vertices) else np.asarray(uv, float)[:, :2]
    return Surface(np.asarray(mesh.vertices, float), np.asarray(triangles), colors, uv)
