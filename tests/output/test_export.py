"""Exported meshes are read back."""

import xml.etree.ElementTree as ElementTree

import meshio
import numpy as np
import pytest
from stub_simulation import VELOCITY, StubSimulation

from taichifem.errors import InputError
from taichifem.output.export import FORMATS, open_export


@pytest.fixture
def simulation():
    return StubSimulation()


def export(directory, format, simulation, frames=3):
    sequence = open_export(directory, format, simulation)
    for k in range(frames):
        sequence.write(simulation)
        if k < frames - 1:
            simulation.advance_frame()
    sequence.close()
    return sequence


def test_vtu_holds_everything(tmp_path, simulation):
    export(tmp_path / "out", "vtu", simulation)
    mesh = meshio.read(tmp_path / "out" / "frame_00002.vtu")
    assert np.array_equal(mesh.points, simulation.positions)
    assert np.array_equal(mesh.cells_dict["tetra"], simulation.cells)
    assert mesh.point_data["displacement"] == pytest.approx(np.tile(VELOCITY * 2 / 30, (len(mesh.points), 1)))
    assert np.array_equal(mesh.point_data["velocity"], simulation.velocities)
    assert np.array_equal(mesh.cell_data["von_mises"][0], simulation.von_mises())
    assert np.array_equal(mesh.cell_data["cauchy_stress"][0].reshape(-1, 3, 3), simulation.cauchy_stress())
    assert np.array_equal(mesh.cell_data["region"][0], simulation.cell_regions)
    assert np.array_equal(mesh.cell_data["body"][0], simulation.cell_bodies)


def test_the_pvd_lists_files_and_times_as_it_grows(tmp_path, simulation):
    sequence = open_export(tmp_path, "vtu", simulation)
    for count in (1, 2, 3):
        sequence.write(simulation)
        (series,) = tmp_path.glob("*.pvd")
        entries = ElementTree.parse(series).getroot().findall("Collection/DataSet")
        assert [float(e.get("timestep")) for e in entries] == [k / 30 for k in range(count)]
        assert all((tmp_path / e.get("file")).exists() for e in entries)
        simulation.advance_frame()


@pytest.mark.parametrize("format", ["ply", "obj"])
def test_surfaces_hold_only_the_surface(tmp_path, simulation, format):
    export(tmp_path, format, simulation)
    mesh = meshio.read(tmp_path / f"frame_00002.{format}")
    triangles = mesh.points[mesh.cells_dict["triangle"]]
    assert triangles == pytest.approx(simulation.positions[simulation.surface], abs=1e-6)
    assert len(mesh.points) == len(np.unique(simulation.surface)) < len(simulation.positions)
    volume = np.einsum("ki,ki->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6
    assert volume == pytest.approx(0.25, rel=1e-4)  # outward


def test_npz(tmp_path, simulation):
    export(tmp_path, "npz", simulation)
    with np.load(tmp_path / "frame_00001.npz") as arrays:
        assert arrays["frame"] == 1 and arrays["time"] == pytest.approx(1 / 30)
        assert np.array_equal(arrays["positions"], simulation.rest_positions + VELOCITY / 30)
        assert np.array_equal(arrays["cells"], simulation.cells)


@pytest.mark.parametrize("format", FORMATS)
def test_files_are_numbered_by_frame_and_nothing_else_is_left(tmp_path, simulation, format):
    simulation.frame = 7  # as after resuming
    sequence = export(tmp_path, format, simulation, frames=2)
    assert [p.name for p in sequence.files] == [f"frame_0000{k}.{format}" for k in (7, 8)]
    names = {p.name for p in tmp_path.iterdir()} - {p.name for p in sequence.files}
    assert names == ({"a_b__bar_.pvd"} if format == "vtu" else set())


def test_refusals(tmp_path, simulation):
    with pytest.raises(InputError, match="export format is 'stl': choose one of 'vtu'"):
        open_export(tmp_path, "stl", simulation)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made"):
        open_export(tmp_path / "file" / "out", "vtu", simulation)
    sequence = open_export(tmp_path / "out", "ply", simulation)
    (tmp_path / "out").rmdir()
    (tmp_path / "out").write_text("now a file")
    with pytest.raises(InputError, match=r"frame_00000\.ply: cannot be written"):
        sequence.write(simulation)


def test_a_failing_write_leaves_no_half_file(tmp_path, simulation):
    simulation.von_mises = None
    sequence = open_export(tmp_path, "npz", simulation)
    with pytest.raises(TypeError):
        sequence.write(simulation)
    assert list(tmp_path.iterdir()) == [] and sequence.files == []
