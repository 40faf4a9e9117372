"""The moving mesh as a sequence of files, one per frame."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np

from taichifem.description import check
from taichifem.errors import InputError
from taichifem.files import replacing
from taichifem.output.skin import Skin


def open_export(directory: str | os.PathLike, format: str, simulation: Any) -> MeshSequence:
    """A writer of frames of `simulation` into `directory`, which is made if missing.

    Args:
        format: "vtu" (everything with displacement, velocity and stress, and a .pvd file that ParaView opens as
            a series), "ply" or "obj" (the surface), "npz" (arrays).

    Raises:
        InputError: unknown format, or a place that cannot be written.
    """
    check.choice("export format", format, tuple(FORMATS))
    directory = Path(directory)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{directory}: cannot be made: {error.strerror}: choose another folder") from None
    return MeshSequence(directory, format, simulation.scene.name)


class MeshSequence:
    """Writes `frame_00000.vtu` and so on, numbered by `simulation.frame`; each appears complete or not at all.

    directory: where.  files: what was written, in order.
    """

    def __init__(self, directory: Path, format: str, name: str) -> None:
        self.directory, self.format, self.files = directory, format, []
        self._series = directory / (f"{_safe(name)}.pvd")
        self._times: list[float] = []

    def write(self, simulation: Any) -> None:
        """Write the state of `simulation`. Raises InputError if that fails."""
        path = self.directory / f"frame_{simulation.frame:05d}.{self.format}"
        with replacing(path) as part:
            FORMATS[self.format](part, simulation)
        self.files.append(path)
        self._times.append(simulation.time)
        if self.format == "vtu":
            with replacing(self._series) as part:
                part.write_text(self._collection(), encoding="utf-8")

    def close(self) -> None:
        """Nothing is left to do: every file is complete."""

    def _collection(self) -> str:
        """ParaView's list of files and times [s]."""
        entries = "".join(
            f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(file.name)}/>\n'
            for time, file in zip(self._times, self.files, strict=True)
        )
        head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
        return f"{head}{entries}  </Collection>\n</VTKFile>\n"


def _safe(name: str) -> str:
    """`name` as a file name: without what folders or systems mind."""
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name).strip(".") or "scene"


def write_vtu(path: Path, simulation: Any, **point_data: np.ndarray) -> None:
    """Write the state of `simulation` as a .vtu file: displacement, velocity, stress, plastic strain, bodies,
    and further node data."""
    points, kind = simulation.positions, "tetra" if simulation.cells.shape[1] == 4 else "triangle"
    meshio.Mesh(
        points,
        [(kind, simulation.cells)],
        point_data={
            "displacement": points - simulation.rest_positions,
            "velocity": simulation.velocities,
            **point_data,
        },
        cell_data={
            "von_mises": [simulation.von_mises()],
            "cauchy_stress": [simulation.cauchy_stress().reshape(-1, 9)],
            "plastic_strain": [simulation.plastic_strain().reshape(-1, 9)],
            "equivalent_plastic_strain": [simulation.equivalent_plastic_strain()],
            "body": [np.asarray(simulation.cell_bodies, np.int32)],
            "region": [np.asarray(simulation.cell_regions, np.int32)],
        },
    ).write(path, file_format="vtu", compression="zlib")


def _surface(simulation: Any) -> meshio.Mesh:
    """The surface that is seen, with only its own points, in the 32 bits that viewers of these formats read."""
    seen = Skin().of(simulation)
    nodes, triangles = np.unique(seen.triangles, return_inverse=True)
    points = seen.follow(simulation.positions)[nodes].astype(np.float32)
    return meshio.Mesh(points, [("triangle", triangles.reshape(-1, 3).astype(np.int32))])


def _ply(path: Path, simulation: Any) -> None:
    _surface(simulation).write(path, file_format="ply", binary=True)


def _obj(path: Path, simulation: Any) -> None:
    _surface(simulation).write(path, file_format="obj")


def _npz(path: Path, simulation: Any) -> None:
    with path.open("wb") as file:  # given a name, NumPy would add an ending to it
        np.savez_compressed(
            file,
            time=simulation.time,
            frame=simulation.frame,
            positions=simulation.positions,
            velocities=simulation.velocities,
            rest_positions=simulation.rest_positions,
            cells=simulation.cells,
            cell_bodies=simulation.cell_bodies,
            surface=simulation.surface,
            von_mises=simulation.von_mises(),
            cauchy_stress=simulation.cauchy_stress(),
            plastic_strain=simulation.plastic_strain(),
            equivalent_plastic_strain=simulation.equivalent_plastic_strain(),
        )


FORMATS: dict[str, Callable[[Path, Any], None]] = {"vtu": write_vtu, "ply": _ply, "obj": _obj, "npz": _npz}
