"""A written scene reads back as the same scene."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from taichifem.description import Body, BoxRegion, Material, NearestRegion, Pin, Scene
from taichifem.errors import InputError
from taichifem.mesh import TetMesh
from taichifem.scene import read_scene, write_scene


def same(a: Scene, b: Scene) -> bool:
    """Equal, where meshes are equal if their arrays are."""
    for one, other in zip(a.bodies, b.bodies, strict=True):
        for name in ("points", "cells", "regions"):
            if not np.array_equal(getattr(one.mesh, name), getattr(other.mesh, name)):
                return False
    bodies = [replace(body, mesh=original.mesh) for body, original in zip(b.bodies, a.bodies, strict=True)]
    return replace(b, bodies=tuple(bodies)) == a


def test_round_trip_of_everything(everything, tmp_path):
    scene = read_scene(everything)
    write_scene(scene, tmp_path / "copy.toml")
    assert same(scene, read_scene(tmp_path / "copy.toml"))
    assert not same(scene, read_scene(everything, ["body.0.pin.1.motion.smooth=false"]))


def test_only_what_is_not_default_is_written(tmp_path):
    write_scene(Scene(bodies=[Body(mesh=TetMesh.bar(cells=(1, 1, 1)))], fps=24), tmp_path / "s.toml")
    tree = tomllib.loads((tmp_path / "s.toml").read_text())
    assert tree["simulation"] == {"fps": 24} and set(tree) == {"simulation", "body"}
    assert set(tree["body"][0]) == {"mesh"} and tree["body"][0]["mesh"]["shape"] == "bar"


def test_a_mesh_without_source_is_saved_beside_the_scene_once(tmp_path):
    bar = TetMesh.bar(cells=(2, 1, 1))
    own = TetMesh(bar.points * 1.25, bar.cells, regions=np.arange(len(bar.cells)) % 2)
    bodies = [Body(mesh=own, materials={1: Material(youngs=5.0)}), Body(mesh=own, position=(0.0, 0.0, 2.0))]
    scene = Scene(bodies=tuple(bodies))
    write_scene(scene, tmp_path / "new" / "s.toml")
    assert sorted(p.name for p in (tmp_path / "new").iterdir()) == ["s.mesh-0.vtu", "s.toml"]
    assert same(scene, read_scene(tmp_path / "new" / "s.toml"))


def test_a_moved_mesh_is_saved_as_it_is(tmp_path):
    moved = TetMesh.bar(cells=(1, 1, 1)).transformed(scale=3.0)
    scene = Scene(bodies=(Body(mesh=moved),))
    write_scene(scene, tmp_path / "s.toml")
    assert same(scene, read_scene(tmp_path / "s.toml"))


def test_numpy_values_and_bare_regions_are_written(tmp_path):
    pins = [NearestRegion(point=np.array([0.0, 0.0, 1.0])), BoxRegion(lower=(0, 0, 0), upper=(1, 1, 1))]
    body = Body(mesh=TetMesh.bar(cells=(1, 1, 1)), pins=pins, position=np.ones(3), scale=np.float32(0.5))
    write_scene(Scene(bodies=[body], fps=np.int64(30)), tmp_path / "s.toml")
    read = read_scene(tmp_path / "s.toml")
    assert read.fps == 30.0 and read.bodies[0].position == (1.0, 1.0, 1.0) and read.bodies[0].scale == 0.5
    assert read.bodies[0].pins[0] == Pin(region=NearestRegion(point=(0.0, 0.0, 1.0)))


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text("old")
    broken = Scene(bodies=[Body(mesh=TetMesh.bar(cells=(1, 1, 1)))], name=object())
    with pytest.raises(TypeError):
        write_scene(broken, path)
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    scene = Scene(bodies=[Body(mesh=TetMesh.bar(cells=(1, 1, 1)))])
    with pytest.raises(InputError, match=r"s\.toml: cannot be written"):
        write_scene(scene, tmp_path / "file" / "s.toml")
