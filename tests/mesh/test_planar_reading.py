"""Files of plane triangles: what is written is read back, both planes are known, anything else is refused by name."""

import os
import re

import meshio
import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.mesh import TetMesh, TriMesh, mesh_from_source

POINTS = np.array([[0, 0], [1, 0], [1.5, 2], [0, 1]])
CELLS = np.array([[0, 1, 2], [0, 2, 3]])


def spread(points, plane: str, constant: float = 0.0) -> np.ndarray:
    """Plane points in space, in the plane that is named by its two axes."""
    spatial = np.full((len(points), 3), constant)
    spatial[:, ["xyz".index(axis) for axis in plane]] = points
    return spatial


@pytest.mark.parametrize("ending", ["msh", "mesh", "vtk", "vtu", "inp", "obj"])
def test_what_is_written_is_read_back(tmp_path, capfd, ending):
    made = TriMesh.rectangle(size=(1, 1 / 3), cells=(3, 2))
    mesh = TriMesh(made.points, made.cells, regions=np.arange(len(made.cells)) % 3 + 4)
    file = tmp_path / f"sheet.{ending}"
    mesh.write(file)
    assert capfd.readouterr() == ("", "")
    assert np.array_equal(meshio.read(file).points, spread(mesh.points, "xz"))
    capfd.readouterr()  # what meshio says
    again = TriMesh.from_file(file)
    assert np.array_equal(again.points, mesh.points)
    assert np.array_equal(again.cells, mesh.cells)
    assert np.array_equal(again.regions, mesh.regions if ending != "obj" else 0 * mesh.regions)
    assert again.source == {"file": str(file), "planar": True}
    assert np.array_equal(mesh_from_source(again.source).points, mesh.points)
    assert os.listdir(tmp_path) == [file.name]  # nothing temporary is left
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ending", ["msh", "vtk", "vtu", "inp", "obj", "stl", "ply", "off"])
@pytest.mark.parametrize("plane", ["xz", "xy"])
def test_both_planes_of_every_format(tmp_path, ending, plane, capfd):
    file = tmp_path / f"sheet.{ending}"
    meshio.Mesh(spread(POINTS, plane, 0.25), [("triangle", CELLS)]).write(file)
    capfd.readouterr()  # what meshio says about its own writing
    mesh = TriMesh.from_file(file)
    assert mesh.area == pytest.approx(1.75, rel=1e-6)
    assert np.allclose(mesh.points[mesh.cells], POINTS[CELLS])
    assert mesh.repairs.flipped == 0 and mesh.regions.tolist() == [0, 0]
    assert capfd.readouterr() == ("", "")


def test_points_of_two_coordinates(tmp_path):
    (tmp_path / "a.mesh").write_text(
        "MeshVersionFormatted 2\nDimension 2\nVertices\n3\n0 0 0\n1 0 0\n0 1 0\nTriangles\n1\n1 2 3 8\nEnd\n"
    )
    mesh = TriMesh.from_file(tmp_path / "a.mesh")
    assert mesh.points.tolist() == [[0, 0], [1, 0], [0, 1]] and mesh.regions.tolist() == [8]


def test_either_file_of_a_pair_of_the_program_triangle(tmp_path):
    (tmp_path / "a.node").write_text("4 2 0 1\n1 0 0 1\n2 1 0 1\n3 1.5 2 1\n4 0 1 1\n# made by hand\n")
    (tmp_path / "a.ele").write_text("2 3 1\n1 1 2 3 5\n2 1 3 4 6\n")
    for name in ("a.node", "a.ele"):
        mesh = TriMesh.from_file(tmp_path / name)
        assert np.array_equal(mesh.points, POINTS) and np.array_equal(mesh.cells, CELLS)
        assert mesh.regions.tolist() == [5, 6]
    with pytest.raises(InputError, match=r"a\.ele: has 2-dimensional points and 3-node elements; 3 and 4 are needed"):
        TetMesh.from_file(tmp_path / "a.ele")


def test_groups_colours_seams_and_numbers_from_the_end_of_obj(tmp_path):
    head = "\n".join([*(f"v {x} 0 {z} 0.5 0.5 0.5" for x, z in POINTS), "vn 0 -1 0", "vt 0 0", "vt 1 1", ""])
    faces = "f 1/1/1 2/2/1 3/1/1 # no group\ng none\ng left\nf -4//1 -2//1 4//1\n"
    (tmp_path / "a.obj").write_text("o sheet\n" + head + faces)
    mesh = TriMesh.from_file(tmp_path / "a.obj")
    assert np.array_equal(mesh.points, POINTS) and np.array_equal(mesh.cells, CELLS)
    assert mesh.regions.tolist() == [0, 1]
    (tmp_path / "quad.obj").write_text(head + "f 1 2 3 4\n")
    with pytest.raises(InputError, match="holds faces of 4 corners; convert"):
        TriMesh.from_file(tmp_path / "quad.obj")


def test_other_elements_and_unused_points_may_lie_anywhere(tmp_path):
    points = np.concatenate([spread(POINTS, "xz"), [[5, 5, 5]]])
    cells = [("vertex", [[4]]), ("line", [[0, 1]]), ("triangle", CELLS[:1]), ("triangle", CELLS[1:])]
    data = {"mat_id": [np.array([9]), np.array([8]), np.array([7]), np.array([6])]}
    meshio.Mesh(points, cells, cell_data=data).write(tmp_path / "mixed.vtu")
    mesh = TriMesh.from_file(tmp_path / "mixed.vtu")
    assert mesh.repairs.orphans == 1 and mesh.regions.tolist() == [7, 6]


def test_a_clockwise_file_is_flipped(tmp_path):
    meshio.Mesh(spread(POINTS, "xy"), [("triangle", CELLS[:, ::-1])]).write(tmp_path / "a.vtu")
    mesh = TriMesh.from_file(tmp_path / "a.vtu")
    assert mesh.repairs.flipped == 2 and mesh.area == pytest.approx(1.75)


TILTED = spread(POINTS, "xz") + np.outer(POINTS[:, 0], [0, 1e-3, 0])


@pytest.mark.parametrize(
    ("points", "cells", "message"),
    [
        (spread(POINTS, "yz", 3.0), CELLS, r"y-z plane \(x is constant\); turn it"),
        (TILTED, CELLS, r"not flat: it extends 1\.5 x 0\.0015 x 2 m along x, y and z; lay it"),
        (spread(POINTS, "xz") * [1, 1, np.nan], CELLS, "not finite"),
        (spread(POINTS * [1, 0], "xz"), CELLS, "have no area"),
        (spread(POINTS, "xz"), CELLS + 2, r"outside 0\.\.3"),
        (spread(POINTS, "xz"), CELLS[[0, 0]], "overlap"),
    ],
)
def test_what_is_no_plane_mesh_is_refused(tmp_path, points, cells, message):
    file = tmp_path / "a.vtk"
    meshio.Mesh(points, [("triangle", cells)]).write(file)
    with pytest.raises(InputError, match=message) as caught:
        TriMesh.from_file(file)
    assert str(caught.value).startswith(f"{file}: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", ["quad", "triangle6", "tetra", "hexahedron", "tetra10"])
def test_other_elements_are_refused_by_name(tmp_path, kind):
    size = meshio._mesh.num_nodes_per_cell[kind]
    points = np.random.default_rng(1).random((12, 3)) * [1, 0, 1]
    meshio.Mesh(points, [("triangle", [[0, 1, 2]]), (kind, np.arange(size)[None])]).write(tmp_path / "mixed.vtu")
    message = "holds tetrahedra; it is no planar mesh" if kind == "tetra" else f"holds {kind} elements; convert"
    with pytest.raises(InputError, match=message):
        TriMesh.from_file(tmp_path / "mixed.vtu")


@pytest.mark.parametrize("name", ["spot.obj", "beam3_tet.veg", "beam3_tet.msh", "femfx_duck.node"])
def test_solids_and_curved_surfaces_of_other_projects_are_refused(meshes, name):
    message = "not flat|ending that is not known for triangles|holds tetrahedra|3-dimensional points"
    with pytest.raises(InputError, match=message):
        TriMesh.from_file(meshes / name)


@pytest.mark.parametrize(
    "ending", ["msh", "vtk", "vtu", "mesh", "inp", "node", "ele", "veg", "stl", "obj", "ply", "off", "glb", "svg"]
)
@pytest.mark.parametrize(
    "content", [b"", b"garbage \xff\x00 text\n", b"1 2 3\n4 5 6\n"], ids=["empty", "bytes", "text"]
)
def test_garbage_gives_one_line(tmp_path, capfd, ending, content):
    file = tmp_path / f"bad.{ending}"
    for name in (file.name, "bad.ele", "bad.node"):
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=re.escape(str(file))) as caught:
        TriMesh.from_file(file)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_missing_files_assets_and_endings(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        TriMesh.from_file(tmp_path / "none.msh")
    with pytest.raises(InputError, match="is a folder"):
        TriMesh.from_file(tmp_path)
    with pytest.raises(InputError, match="asset:bear: holds tetrahedra"):
        TriMesh.from_file("asset:bear")
    with pytest.raises(InputError, match=r"one of \.msh \.mesh \.vtk \.vtu \.inp \.obj"):
        TriMesh.disk().write(tmp_path / "a.node")
    with pytest.raises(InputError, match="knows no 'planar'"):
        TriMesh.from_source({"file": "a.msh", "planar": False})
    assert list(tmp_path.iterdir()) == []
