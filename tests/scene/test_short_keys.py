"""Short keys reach every material, whatever way it is written."""

import pytest

from taichifem.description import Material
from taichifem.errors import InputError
from taichifem.scene import presets, read_scene
from taichifem.scene.short_keys import spelled_out

TREE = {
    "body": [
        {"material": "gel", "materials": {"0": "foam", "2": {"youngs": 1e5}}},
        {"name": "bare"},
        {"material": {"preset": "rubber"}},
    ]
}
PLACES = ["body.0.material", "body.0.materials.0", "body.0.materials.2", "body.1.material", "body.2.material"]


@pytest.mark.parametrize(
    ("text", "settings"),
    [
        ("model=stvk", [f"{place}.model=stvk" for place in PLACES]),
        (" youngs = 2e5", [f"{place}.youngs=2e5" for place in PLACES]),
        ("substeps=4", ["simulation.substeps=4"]),
        ("integrator=backward-euler", ["simulation.integrator=backward-euler"]),
        ("body.ball.scale=2", ["body.ball.scale=2"]),
        ("body.0.material.model=invertible:stvk", ["body.0.material.model=invertible", "body.0.material.wraps=stvk"]),
    ],
)
def test_places(text, settings):
    assert spelled_out(TREE, text) == settings


def test_a_model_may_say_what_it_wraps(everything):
    scene = read_scene(everything, choice="model=invertible:neo-hookean")
    (bar, ball) = scene.bodies
    law = {"model": "invertible", "wraps": "neo-hookean"}
    assert bar.material == presets.preset("rubber", youngs=2e5, **law)
    assert bar.materials[0] == presets.preset("foam", **law)
    assert ball.material == presets.preset("gel", **law)


def test_a_body_without_a_material_gets_one(scene_file):
    path = scene_file('[[body]]\nmesh = { shape = "sphere", resolution = 1 }')
    assert read_scene(path, choice="density=7").bodies[0].material == Material(density=7.0)


def test_a_choice_comes_after_the_overrides_and_knows_what_they_made(everything):
    settings = ["simulation.fps=20", "body.bar.materials.0=steel", "body.bar.material.poisson=0.1"]
    scene = read_scene(everything, settings, choice="poisson=0.2")
    assert scene.fps == 20
    assert {m.poisson for b in scene.bodies for m in (b.material, *b.materials.values())} == {0.2}
    assert read_scene(everything, settings, choice="fps=40").fps == 40


@pytest.mark.parametrize(
    ("choice", "fragments"),
    [
        ("moddel=stvk", ["choice 'moddel=stvk'", "unknown key 'moddel'", "did you mean 'model'?"]),
        ("gravty=3", ["did you mean 'gravity'?"]),
        ("name=x", ["unknown key 'name'"]),
        ("model=stvkk", ["body.0.material.model is 'stvkk'", "choose one of", "set by the override 'model=stvkk'"]),
        ("model=invertible:linear", ["wraps is 'linear'", "choose one of", "'model=invertible:linear'"]),
        ("model=stvk:linear", ["only invertible wraps", "model=invertible:linear"]),
        ("poisson=0.5", ["body.0.material.poisson is 0.5", "below 0.5"]),
        ("substeps=0", ["simulation.substeps", "at least 1"]),
        ("body.bal.scale=2", ["body has no entry bal"]),
    ],
)
def test_wrong_choice(everything, choice, fragments):
    with pytest.raises(InputError) as caught:
        read_scene(everything, choice=choice)
    message = str(caught.value)
    assert "\n" not in message and message.startswith(str(everything))
    for fragment in fragments:
        assert fragment in message


def test_a_file_without_bodies_is_told_as_ever(scene_file):
    with pytest.raises(InputError, match="give 'body'"):
        read_scene(scene_file("name = 'x'"), choice="model=stvk")
    with pytest.raises(InputError, match="must be"):
        read_scene(scene_file("body = [3]"), choice="model=stvk")
