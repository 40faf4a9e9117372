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
from taichifem.output.colors import body_colors
from taichifem.output.skin import Seen, Skin


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
    """The surface that is seen, with only its own points, in the 32 bits that viewers of these formats read.

    Where embedded surfaces have colours or places in a texture, so has it: `red`, `green`, `blue`, `s`, `t`.
    """
    seen = Skin().of(simulation)
    nodes, triangles = np.unique(seen.triangles, return_inverse=True)
    points = seen.follow(simulation.positions)[nodes].astype(np.float32)
    return meshio.Mesh(
        points, [("triangle", triangles.reshape(-1, 3).astype(np.int32))], _paint(seen, simulation, nodes)
    )


def _paint(seen: Seen, simulation: Any, nodes: np.ndarray) -> dict[str, np.ndarray]:
    """Colours and places in a texture of some points; what has none is coloured as its body, and lies at (0, 0)."""
    found: dict[str, np.ndarray] = {}
    if seen.paint is None:
        return found
    paint = seen.paint[nodes]
    if np.isfinite(paint[:, :3]).any():
        body = np.zeros(len(seen.paint), dtype=int)
        body[seen.triangles] = seen.bodies[:, None]
        plain = body_colors(len(simulation.scene.bodies), simulation.scene.view.colors)[body[nodes]]
        shades = np.where(np.isfinite(paint[:, :3]), paint[:, :3], plain)
        found |= dict(zip(("red", "green", "blue"), np.rint(255 * shades).astype(np.uint8).T.copy(), strict=True))
    if np.isfinite(paint[:, 3:]).any():
        found |= dict(zip(("s", "t"), np.nan_to_num(paint[:, 3:]).astype(np.float32).T.copy(), strict=True))
    return found


def _ply(path: Path, simulation: Any) -> None:
    _surface(simulation).write(path, file_format="ply", binary=True)


def _obj(path: Path, simulation: Any) -> None:
    """Points with colours behind them, and corners that name their place in the texture: meshio writes neither."""
    mesh = _surface(simulation)
    points, data, corners = mesh.points, mesh.point_data, mesh.cells_dict["triangle"] + 1
    if "red" in data:
        points = np.column_stack([points, *(data[name] / 255 for name in ("red", "green", "blue"))])
    with path.open("w", encoding="utf-8") as file:
        np.savetxt(file, points, fmt="v" + " %.9g" * points.shape[1])
        if "s" in data:
            np.savetxt(file, np.column_stack([data["s"], data["t"]]), fmt="vt %.9g %.9g")
            np.savetxt(file, np.repeat(corners, 2, axis=1), fmt="f %d/%d %d/%d %d/%d")
        else:
            np.savetxt(file, corners, fmt="f %d %d %d")


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
