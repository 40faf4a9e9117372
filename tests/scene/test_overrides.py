"""Settings from the command line."""

import pytest

from taichifem.errors import InputError
from taichifem.scene import presets, read_scene


@pytest.mark.parametrize(
    ("override", "look", "expected"),
    [
        ("body.0.material.youngs=3e5", lambda s: s.bodies[0].material.youngs, 3e5),
        ("body.ball.material.youngs=7", lambda s: s.bodies[1].material, presets.preset("gel", youngs=7.0)),
        ("body.ball.material.preset=foam", lambda s: s.bodies[1].material, presets.preset("foam")),
        ("body.ball.material=steel", lambda s: s.bodies[1].material, presets.preset("steel")),
        ("body.0.materials.0.youngs=3", lambda s: s.bodies[0].materials[0], presets.preset("foam", youngs=3.0)),
        ("body.bar.pin.0.until=0.25", lambda s: s.bodies[0].pins[0].until, 0.25),
        ("simulation.fps = 25", lambda s: s.fps, 25.0),
        ("simulation.max_iterations=50", lambda s: s.max_iterations, 50),
        ("simulation.gravity=[0,0,-3]", lambda s: s.gravity, (0.0, 0.0, -3.0)),
        ("view.color=speed", lambda s: s.view.color, "speed"),
        ('view.color="speed"', lambda s: s.view.color, "speed"),
        ("name=a=b", lambda s: s.name, "a=b"),
        ("collider.0.friction=0.9", lambda s: s.colliders[0].friction, 0.9),
        ("body.1.mesh={shape='bar',cells=[1,1,1]}", lambda s: len(s.bodies[1].mesh.cells), 5),
        ("body.1.mesh.radius=1.5", lambda s: round(float(s.bodies[1].mesh.points.max()), 6), 1.5),
    ],
)
def test_override(everything, override, look, expected):
    plain, changed = read_scene(everything), read_scene(everything, [override])
    assert look(changed) == expected
    assert look(plain) != expected


def test_overrides_make_missing_tables_and_the_last_one_wins(scene_file):
    path = scene_file('[[body]]\nmesh = { shape = "sphere", resolution = 1 }')
    scene = read_scene(path, ["camera.fov=40", "camera.fov=50", "body.0.material.preset=rubber"])
    assert scene.camera.fov == 50.0 and scene.bodies[0].material == presets.preset("rubber")


@pytest.mark.parametrize(
    ("override", "fragments"),
    [
        ("body.5.scale=1", ["body has no entry 5", "0 to 1", "'ball'"]),
        ("body.bal.scale=1", ["body has no entry bal", "'ball'"]),
        ("body.0.material.yungs=1", ["body.0.material: unknown key 'yungs'", "did you mean 'youngs'", "override"]),
        ("body.0.material.youngs=soft", ["body.0.material.youngs must be a number", "'soft'", "override"]),
        ("body.ball.material.youngs=-1", ["body.1.material.youngs is -1", "above 0", "override"]),
        ("simulation.fps", ["KEY=VALUE"]),
        ("=3", ["KEY=VALUE"]),
        ("body..scale=3", ["KEY=VALUE"]),
        ("simulation.fps.high=3", ["simulation.fps is 30", "no keys below"]),
        ("body=3", ["body must be an array of tables", "override"]),
        ("simulation.gravity=[0,0,-1", ["simulation.gravity must be a list of 3 numbers", "override"]),
        ("simulation.fps=1\nname='x'", ["simulation.fps must be a number"]),
        ("body.0.scale=" + "[" * 3000, ["body.0.scale must be a number"]),
    ],
)
def test_wrong_override(everything, override, fragments):
    with pytest.raises(InputError) as caught:
        read_scene(everything, [override])
    message = str(caught.value)
    assert "\n" not in message and message.startswith(str(everything))
    for fragment in fragments:
        assert fragment in message


def test_a_fault_of_the_file_is_not_blamed_on_the_override(scene_file):
    path = scene_file('[[body]]\nmesh = { shape = "sphere" }\nscale = -1')
    with pytest.raises(InputError) as caught:
        read_scene(path, ["body.0.angle=3"])
    assert "body.0.scale is -1" in str(caught.value) and "override" not in str(caught.value)
