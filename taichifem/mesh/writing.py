"""Writing mesh files, complete or not at all."""

import contextlib
import errno
import io
import os
import tempfile
from os import PathLike
from pathlib import Path

import meshio
import numpy as np

from taichifem.errors import InputError

BOTH = {  # ending: (meshio's format, name of the regions there, further options)
    ".msh": ("gmsh22", "gmsh:physical", {"binary": True}),
    ".mesh": ("medit", "medit:ref", {}),
    ".vtk": ("vtk", "regions", {}),
    ".vtu": ("vtu", "regions", {"compression": "zlib"}),
    ".inp": ("abaqus", None, {}),
}
TETGEN = ("tetgen", "tetgen:ref", {})
FORMATS = {  # by the number of corners of an element
    3: {**BOTH, ".obj": ("obj", None, {})},
    4: {**BOTH, ".node": TETGEN, ".ele": TETGEN},
}
ELEMENT = {3: "triangle", 4: "tetra"}


def write(path: str | PathLike, points: np.ndarray, cells: np.ndarray, regions: np.ndarray) -> None:
    """Write a mesh of tetrahedra or triangles in the format that the file's ending names.

    Args:
        path: the file to make or replace.
        points: (n, 3) positions [m].
        cells: (m, 4) or (m, 3) vertex indices.
        regions: (m,) labels.

    Raises:
        InputError: unknown ending, folder missing or not writable, disk full.
    """
    path, corners = Path(path), cells.shape[1]
    formats = FORMATS[corners]
    if path.suffix.lower() not in formats:
        raise InputError(f"{path}: meshes cannot be written with this ending; use one of {' '.join(formats)}")
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a file in it")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
    format_name, region_name, options = formats[path.suffix.lower()]
    mesh = meshio.Mesh(points, [(ELEMENT[corners], cells)])
    if region_name:
        mesh.cell_data[region_name] = [regions]
    else:
        mesh.cell_sets = {f"region_{label}": [np.flatnonzero(regions == label)] for label in np.unique(regions)}
    if format_name == "gmsh22":
        mesh.cell_data["gmsh:geometrical"] = [regions]
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing-") as folder:
            with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(said):
                mesh.write(Path(folder) / path.name, file_format=format_name, **options)
            for file in Path(folder).iterdir():
                os.replace(file, path.parent / file.name)
    except OSError as error:
        remedy = "free some space" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "choose another place"
        raise InputError(f"{path}: cannot be written ({error.strerror}); {remedy}") from None
