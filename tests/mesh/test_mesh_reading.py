"""Mesh files: real ones from other projects, damaged ones, and what this library writes itself."""

import os
import re

import meshio
import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.mesh import TetMesh

CREDITED = re.compile(r"^\| (\S+) \| (\d+) v, (\d+) tets, (\d+) surface triangles; volume ([\d.]+)", re.M)


def test_real_meshes_have_the_counts_of_their_credits(meshes):
    rows = CREDITED.findall((meshes / "CREDITS.md").read_text())
    assert len(rows) >= 20
    for name, points, tets, triangles, volume in rows:
        mesh = TetMesh.from_file(meshes / name.replace(".node/", ""))  # "duck.node/.ele" names a pair
        assert (len(mesh.points), len(mesh.cells), len(mesh.surface())) == (int(points), int(tets), int(triangles))
        assert mesh.volume == pytest.approx(float(volume), rel=1e-5), name


def test_either_file_of_a_tetgen_pair_may_be_named(meshes):
    node, ele = (TetMesh.from_file(meshes / f"femfx_duck{end}") for end in (".node", ".ele"))
    assert len(node.cells) == 33
    assert np.array_equal(node.cells, ele.cells)


def test_regions_of_real_meshes(meshes):
    labels, counts = np.unique(TetMesh.from_file(meshes / "sfepy_cylinder_in_box.mesh").regions, return_counts=True)
    assert dict(zip(labels.tolist(), counts.tolist(), strict=True)) == {444: 869, 555: 2475}
    assert set(TetMesh.from_file(meshes / "beam3_tet.veg").regions) == {1}
    assert set(TetMesh.from_file(meshes / "uipc_ball.msh").regions) == {0}  # its cell data are no integers


def test_veg_equals_its_conversion(meshes):
    veg, vtk = (TetMesh.from_file(meshes / f"beam3_tet{end}") for end in (".veg", ".vtk"))
    assert np.array_equal(veg.points, vtk.points)
    assert np.array_equal(veg.cells, vtk.cells)


def test_malformed_files_give_one_line_or_the_right_mesh(meshes, capfd):
    files = sorted((meshes / "malformed").iterdir())
    assert len(files) == 7
    for file in files:
        if "max_tag_mismatch" in file.name:
            mesh = TetMesh.from_file(file)
            assert (len(mesh.points), len(mesh.cells)) == (14, 24)
            continue
        with pytest.raises(InputError) as caught:
            TetMesh.from_file(file)
        assert file.name in str(caught.value)
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_hexahedra_in_veg_are_refused_by_name(meshes):
    with pytest.raises(InputError, match="hexahedral"):
        TetMesh.from_file(meshes / "beam3_cubic.veg")


@pytest.mark.parametrize("ending", ["msh", "mesh", "vtk", "vtu", "inp", "node", "ele"])
def test_what_is_written_is_read_back(tmp_path, capfd, ending):
    bar = TetMesh.bar(size=(1, 1 / 3, 0.1), cells=(3, 2, 2))
    mesh = TetMesh(bar.points, bar.cells, regions=np.arange(len(bar.cells)) % 3 + 4)
    file = tmp_path / f"bar.{ending}"
    mesh.write(file)
    again = TetMesh.from_file(file)
    assert np.array_equal(again.points, mesh.points)
    assert np.array_equal(again.cells, mesh.cells)
    assert np.array_equal(again.regions, mesh.regions)
    assert again.source == {"file": str(file)}
    expected = {"bar.node", "bar.ele"} if ending in ("node", "ele") else {file.name}
    assert set(os.listdir(tmp_path)) == expected  # nothing temporary is left
    assert capfd.readouterr() == ("", "")


def test_writing_says_what_is_wrong(tmp_path, monkeypatch):
    mesh = TetMesh.bar(cells=(1, 1, 1))
    with pytest.raises(InputError, match="ending"):
        mesh.write(tmp_path / "a.docx")
    with pytest.raises(InputError, match="does not exist"):
        mesh.write(tmp_path / "nowhere" / "a.vtu")
    (tmp_path / "folder.vtu").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        mesh.write(tmp_path / "folder.vtu")
    (tmp_path / "a.vtu").write_text("old")

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(meshio.Mesh, "write", full)
    with pytest.raises(InputError, match=r"No space left on device.*free some space"):
        mesh.write(tmp_path / "a.vtu")
    assert (tmp_path / "a.vtu").read_text() == "old"


POINTS = np.concatenate([np.eye(3), np.zeros((1, 3)), np.eye(3) + 1, [[5, 5, 5]]])


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "pyramid", "tetra10"])
def test_other_solid_elements_are_refused_by_name(tmp_path, kind):
    size = meshio._mesh.num_nodes_per_cell[kind]
    points = np.random.default_rng(1).random((12, 3))
    other = np.arange(size)[None]
    meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]]), (kind, other)]).write(tmp_path / "mixed.vtu")
    with pytest.raises(InputError, match=f"holds {kind} elements; convert"):
        TetMesh.from_file(tmp_path / "mixed.vtu")


def test_lower_dimensional_elements_are_ignored(tmp_path):
    cells = [("vertex", [[0]]), ("line", [[0, 1]]), ("tetra", [[3, 0, 1, 2]]), ("triangle", [[4, 5, 6]])]
    data = {"mat_id": [np.array([9]), np.array([8]), np.array([7]), np.array([6])]}
    meshio.Mesh(POINTS, cells, cell_data=data).write(tmp_path / "mixed.vtu")
    mesh = TetMesh.from_file(tmp_path / "mixed.vtu")
    assert (len(mesh.points), len(mesh.cells), mesh.regions.tolist()) == (4, 1, [7])


def test_veg_sets_regions_and_ids_from_zero(tmp_path):
    file = tmp_path / "two.veg"
    rows = "\n".join(f"{i} {x} {y} {z}" for i, (x, y, z) in enumerate(POINTS[:5]))
    file.write_text(
        f"# comment\n*VERTICES\n5 3 0 0\n{rows}\n*ELEMENTS\nTETS\n2 4 0\n0 3 0 1 2\n1, 0, 1, 2, 4\n"
        "*MATERIAL soft\nENU, 1, 2, 0.3\n*SET left\n0\n*SET right\n1,\n*REGION\nright, soft\n*REGION\nleft, soft\n"
    )
    mesh = TetMesh.from_file(file)
    assert mesh.regions.tolist() == [2, 1]
    assert len(mesh.points) == 5


def test_tetgen_comments_attributes_and_ids_from_zero(tmp_path):
    (tmp_path / "a.node").write_text("# made by hand\n4 3 0 0 # four\n0 0 0 0\n1\t1 0 0\n2 0 1 0\n\n3 0 0 1\n# end\n")
    (tmp_path / "a.ele").write_text("1 4 1\n0 0 1 2 3 12\n")
    mesh = TetMesh.from_file(tmp_path / "a.node")
    assert mesh.volume == pytest.approx(1 / 6)
    assert mesh.regions.tolist() == [12]
    (tmp_path / "a.ele").unlink()
    with pytest.raises(InputError, match=r"a\.node: needs a\.ele beside it"):
        TetMesh.from_file(tmp_path / "a.node")


ENDINGS = [
    "msh",
    "vtk",
    "vtu",
    "mesh",
    "inp",
    "node",
    "ele",
    "veg",
    "stl",
    "obj",
    "ply",
    "off",
    "glb",
    "xyz",
    "bdf",
    "svg",
]


@pytest.mark.parametrize("ending", [*ENDINGS, "h5m"])
@pytest.mark.parametrize(
    "content", [b"", b"garbage \xff\x00 text\n", b"1 2 3\n4 5 6\n"], ids=["empty", "bytes", "text"]
)
def test_garbage_gives_one_line(tmp_path, capfd, ending, content):
    file = tmp_path / f"bad.{ending}"
    file.write_bytes(content)
    (tmp_path / "bad.ele").write_bytes(content)
    (tmp_path / "bad.node").write_bytes(content)
    with pytest.raises(InputError, match=re.escape(str(file))) as caught:
        TetMesh.from_file(file)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_missing_files_folders_and_endings(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        TetMesh.from_file(tmp_path / "none.msh")
    with pytest.raises(InputError, match="is a folder"):
        TetMesh.from_file(tmp_path)
    (tmp_path / "a.docx").write_text("x")
    with pytest.raises(InputError, match="ending that is not known"):
        TetMesh.from_file(tmp_path / "a.docx")
    TetMesh.bar(cells=(1, 1, 1)).write(tmp_path / "bar.vtu")
    with pytest.raises(InputError, match="tetrahedra already"):
        TetMesh.from_file(tmp_path / "bar.vtu", tets=100)
