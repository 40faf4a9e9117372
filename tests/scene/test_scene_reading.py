"""What a scene file means."""

from dataclasses import dataclass

import numpy as np
import pytest

from taichifem.description import (
    BoxRegion,
    IndexRegion,
    Motion,
    NearestRegion,
    PlaneCollider,
    Scene,
    SphereCollider,
    SphereRegion,
)
from taichifem.scene import layout, presets, read_scene


def test_every_kind_of_key_arrives(everything):
    scene = read_scene(everything)
    bar, ball = scene.bodies
    assert (scene.name, scene.fps, scene.substeps, scene.gravity) == ("everything", 30.0, 2, (0.0, 0.0, -1.6))
    assert isinstance(scene.fps, float) and scene.integrator == "backward-euler-newton"
    assert scene.view.range == (0.0, 1e5) and scene.view.wire and scene.camera.eye == (2.0, -3.0, 1.0)
    assert bar.material == presets.preset("rubber", youngs=2e5)
    assert bar.materials == {0: presets.preset("foam")} and bar.scale == 2.0
    assert np.ptp(bar.mesh.points, axis=0) == pytest.approx([1.0, 0.2, 0.2]) and len(bar.mesh.cells) == 4 * 5
    assert [type(pin.region) for pin in bar.pins] == [BoxRegion, NearestRegion, NearestRegion, IndexRegion]
    assert (bar.pins[0].axes, bar.pins[0].until, bar.pins[2].region.count) == ("xz", 0.5, 3)
    assert bar.pins[1].motion == Motion(times=(0.0, 1.0), translation=((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), smooth=True)
    assert bar.handles[0].region == SphereRegion(center=(0.0, 0.0, 1.0), radius=0.5)
    assert bar.handles[0].motion.angle == (0.0, 360.0) and bar.handles[0].stiffness == 50.0
    assert ball.material == presets.preset("gel") and ball.velocity == (0.0, 1.0, 0.0)
    assert scene.colliders[0] == PlaneCollider(friction=0.0)
    assert isinstance(scene.colliders[1], SphereCollider) and scene.colliders[1].motion.repeat


def test_the_smallest_scene_takes_all_defaults(scene_file):
    scene = read_scene(scene_file('[[body]]\nmesh = { shape = "sphere" }'))
    assert scene.bodies[0].pins == () and scene.fps == 60 and scene.colliders == ()


def test_a_byte_order_mark_is_no_error(scene_file):
    assert read_scene(scene_file(b'\xef\xbb\xbf[[body]]\nmesh = { shape = "sphere" }'))


def test_mesh_files_are_looked_for_beside_the_scene_file(scene_file, tmp_path):
    made = read_scene(scene_file('[[body]]\nmesh = { shape = "bar", cells = [2, 1, 1] }')).bodies[0].mesh
    (tmp_path / "meshes").mkdir()
    made.write(tmp_path / "meshes" / "bar.vtu")
    scene = read_scene(scene_file('[[body]]\nmesh = { file = "meshes/bar.vtu" }'))
    assert np.array_equal(scene.bodies[0].mesh.points, made.points)


def test_every_field_of_scene_has_a_key():
    assert set(layout.keys(Scene).values()) == {field for field in Scene.__dataclass_fields__}


def test_a_new_field_is_a_new_key():
    @dataclass(frozen=True, kw_only=True)
    class Wind:
        speed: float = 0.0
        gusts: tuple[float, ...] = ()

    assert layout.keys(Wind) == {"speed": "speed", "gusts": "gusts"}


def test_scene_from_file_is_the_same(everything):
    assert Scene.from_file(str(everything), overrides=["simulation.fps=24"]).fps == 24.0
