"""Closed surfaces: welding, checks, and filling them with tetrahedra."""

import importlib.metadata
import importlib.util

import meshio
import numpy as np
import pytest
import trimesh

from taichifem.errors import InputError
from taichifem.mesh import TetMesh, quality, tetrahedralize
from taichifem.mesh.surfaces import closed_surface, enclosed_volume

needs_filler = pytest.mark.skipif(
    importlib.util.find_spec("pytetwild") is None, reason="the extra 'tetrahedralize' is not installed"
)


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """An empty cache for each test."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "taichifem" / "tetrahedra"


@pytest.fixture(scope="module")
def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=2)


def test_seams_are_welded(ball):
    soup = ball.vertices[ball.faces].reshape(-1, 3)
    points, triangles = closed_surface(soup, np.arange(len(soup)).reshape(-1, 3))
    assert (len(points), len(triangles)) == (len(ball.vertices), len(ball.faces))


def test_seams_of_a_real_cow_are_welded(meshes):
    cow = trimesh.load(meshes / "spot.obj", force="mesh", process=False)
    assert len(cow.vertices) > 2930
    points, triangles = closed_surface(cow.vertices, cow.faces)
    assert (len(points), len(triangles)) == (2930, 5856)


def test_surfaces_end_up_facing_outward(ball):
    mixed = ball.faces.copy()
    mixed[::3] = mixed[::3, ::-1]
    for faces in (ball.faces, ball.faces[:, ::-1], mixed):
        assert enclosed_volume(*closed_surface(ball.vertices, faces)) == pytest.approx(ball.volume)


@pytest.mark.parametrize(
    ("points", "triangles", "message"),
    [
        (np.eye(3), [[0, 1, 2]], "not closed: 3 edges are open; fill its holes"),
        (np.eye(3), [[0, 1, 2], [0, 2, 1]], "encloses no volume"),
        (np.eye(3), [[0, 1, 3]], "points it does not have"),
        (np.eye(3), np.zeros((0, 3), int), "no triangles"),
        (np.eye(3) * np.nan, [[0, 1, 2]], "finite"),
        (np.eye(3), [[0.5, 1, 2]], "integers"),
    ],
)
def test_what_encloses_nothing_is_refused(points, triangles, message):
    with pytest.raises(InputError, match=message):
        TetMesh.from_surface(points, triangles)


def test_an_open_file_is_named(tmp_path, ball):
    file = tmp_path / "open.stl"
    trimesh.Trimesh(ball.vertices, ball.faces[1:]).export(file)
    with pytest.raises(InputError, match=r"open\.stl: the surface is not closed: 3 edges"):
        TetMesh.from_file(file)


@pytest.mark.parametrize("tets", [0, -5, 2.5, True, "many"])
def test_wrong_targets_are_refused(ball, tets):
    with pytest.raises(InputError, match="number of tetrahedra"):
        TetMesh.from_surface(ball.vertices, ball.faces, tets=tets)


def test_a_missing_extra_is_named(ball, monkeypatch):
    def missing(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", missing)
    with pytest.raises(InputError, match=r'pip install "taichifem\[tetrahedralize\]"'):
        TetMesh.from_surface(ball.vertices, ball.faces)


@needs_filler
def test_a_ball_is_filled_with_about_the_wanted_number(ball, capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mesh = TetMesh.from_surface(ball.vertices, ball.faces, tets=1000)
    # The filler is not the same every time: from one run to the next the number changes by a third.
    assert 600 < len(mesh.cells) < 1700
    assert mesh.volume == pytest.approx(ball.volume, rel=0.05)
    assert quality(mesh).pieces == 1
    assert mesh.repairs.flipped == 0
    assert capfd.readouterr() == ("", "")
    assert [file.name for file in tmp_path.iterdir()] == ["cache"]  # the library's own files do not stay


@needs_filler
def test_a_tetrahedraliser_that_crashes_gives_one_line(ball, cache, monkeypatch):
    monkeypatch.setattr(tetrahedralize, "FILL", "import os; os.abort()")
    with pytest.raises(InputError, match=r"tetrahedraliser failed .* repair the surface"):
        TetMesh.from_surface(ball.vertices, ball.faces)
    assert not cache.exists()


@needs_filler
def test_results_are_cached_and_a_damaged_entry_is_made_anew(ball, cache, monkeypatch):
    first = TetMesh.from_surface(ball.vertices, ball.faces)
    (entry,) = cache.iterdir()
    fill, calls = tetrahedralize._fill, []
    monkeypatch.setattr(tetrahedralize, "_fill", lambda *a: calls.append(a) or fill(*a))
    assert np.array_equal(TetMesh.from_surface(ball.vertices, ball.faces).points, first.points)
    assert not calls
    whole = entry.read_bytes()
    for damage in (b"", b"no archive", whole[: len(whole) // 2]):
        entry.write_bytes(damage)
        again = TetMesh.from_surface(ball.vertices, ball.faces)
        assert again.volume == pytest.approx(first.volume, rel=0.01)  # fTetWild's runs differ a little
    assert len(calls) == 3
    TetMesh.from_surface(ball.vertices * 1.5, ball.faces)  # another geometry, another entry
    assert len(calls) == 4
    assert len(list(cache.iterdir())) == 2


@needs_filler
def test_a_cache_that_cannot_be_written_does_not_matter(ball, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert len(TetMesh.from_surface(ball.vertices, ball.faces).cells) > 100


@needs_filler
def test_triangles_of_a_volume_format_are_filled_when_asked(tmp_path, ball):
    file = tmp_path / "skin.vtu"
    meshio.Mesh(ball.vertices, [("triangle", ball.faces)]).write(file)
    with pytest.raises(InputError, match=r"no tetrahedra; .*taichifem mesh skin\.vtu -o OUT --tets N"):
        TetMesh.from_file(file)
    mesh = TetMesh.from_file(file, tets=600)
    assert 400 < len(mesh.cells) < 800
    assert mesh.source == {"file": str(file), "tets": 600}


@needs_filler
@pytest.mark.parametrize("ending", ["stl", "obj", "ply", "off", "glb"])
def test_surface_formats(tmp_path, ball, ending, monkeypatch):
    monkeypatch.setattr(tetrahedralize, "_fill", lambda *a: (np.eye(4, 3), np.array([[0, 1, 2, 3]], np.int32)))
    ball.export(tmp_path / f"ball.{ending}")
    assert len(TetMesh.from_file(tmp_path / f"ball.{ending}").cells) == 1


@needs_filler
@pytest.mark.slow
def test_a_real_cow_is_filled(meshes):
    mesh = TetMesh.from_file(meshes / "spot.obj", tets=1500)
    assert 1000 < len(mesh.cells) < 2000
    assert mesh.volume == pytest.approx(0.7175, rel=0.05)
    assert quality(mesh).pieces == 1
