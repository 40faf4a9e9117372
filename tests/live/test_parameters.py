"""The one list of parameters: complete, consistent with the scene file, and what a change of one brings with it."""

import dataclasses

import pytest

import taichifem as tf
from taichifem import InputError
from taichifem.live import parameters
from taichifem.live.panel import panel
from taichifem.live.parameters import MATERIAL, SIMULATION, as_overrides, changed, differences, find, get
from taichifem.live.tools import tools_for
from taichifem.scene import read_scene

FILE = """
[[body]]
name = "bar"
mesh = { shape = "bar", size = [0.4, 0.2, 0.2], cells = [2, 1, 1] }
material = { youngs = 1e5 }
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "bar.toml"
    path.write_text(FILE)
    return read_scene(path)


REDUCED = "basis", "modes"
"""What only models have that the live view refuses."""


def with_material(scene, **changes):
    body = scene.bodies[0]
    material = body.material
    for name, value in changes.items():
        material = changed(material, name, value)
    return dataclasses.replace(scene, bodies=[dataclasses.replace(body, material=material)])


def test_every_field_of_a_material_is_there():
    assert {p.name for p in MATERIAL} == {f.name for f in dataclasses.fields(tf.Material)} - {"fracture", *REDUCED} | {
        "toughness"
    }


def test_rows_are_those_that_apply(scene):
    def names(scene):
        return [row["path"].rpartition(".")[2] for row in panel(scene, tools_for(scene))[0]["rows"]]

    assert "rotation" in names(scene) and "yield_stress" not in names(scene)
    plastic = with_material(scene, model="invertible", plasticity="tresca")
    assert {"wraps", "threshold", "yield_stress", "hardening", "viscosity"} <= set(names(plastic))
    assert "rotation" not in names(plastic) and "creep_rate" not in names(plastic)
    springs = with_material(scene, model="mass-spring", plasticity="creep")
    assert {"spring_stiffness", "compression_limit", "creep_rate"} <= set(names(springs))


def test_every_path_of_the_panel_is_found_and_leads_to_its_value(scene):
    for group in panel(scene, tools_for(scene)):
        for row in group["rows"]:
            _, parameter = find(row["path"])
            assert parameter.label == row["label"]
    for wrong in ("body.0.material.colour", "body", "simulation.gravity", "tools.", "", "body.0.material.youngs.x"):
        with pytest.raises(InputError, match="there is no parameter"):
            find(wrong)


def test_a_plastic_law_brings_limits_and_takes_them_away_again(scene):
    material = scene.bodies[0].material
    steel = changed(material, "plasticity", "von-mises")
    assert steel.yield_stress == 0.05 * material.youngs
    assert changed(changed(steel, "yield_stress", 7.0), "plasticity", "tresca").yield_stress == 7.0
    creep = changed(steel, "plasticity", "creep")
    assert (creep.yield_stress, creep.yield_strain) == (None, 0.05)
    assert changed(creep, "plasticity", "none") == material


def test_values_are_checked(scene):
    for path, value, words in (
        ("body.0.material.youngs", "stiff", "must be a number"),
        ("body.0.material.youngs", True, "must be a number"),
        ("body.0.material.youngs", None, "must be a number"),
        ("view.wire", 1, "must be a switch"),
        ("body.0.material.model", 1, "must be a choice"),
    ):
        with pytest.raises(InputError, match=words):
            parameters.check_value(find(path)[1], value)
    for name, value in (("youngs", -1.0), ("poisson", 0.5), ("model", "rubber"), ("toughness", 0.0)):
        with pytest.raises(InputError):
            changed(scene.bodies[0].material, name, value)


def test_differences_make_one_scene_of_the_other_and_so_do_overrides(scene, tmp_path):
    other = with_material(scene, plasticity="creep", yield_strain=0.2, youngs=2e5, toughness=3e4)
    other = dataclasses.replace(other, gravity=(0.0, 1.0, -2.0), substeps=3)
    made = scene
    for path, value in differences(scene, other):
        place, parameter = find(path)
        if place == "simulation":
            made = changed(made, parameter.name, value)
        else:
            made = with_material(made, **{parameter.name: value})
        assert get(made if place == "simulation" else made.bodies[0].material, parameter.name) == value
    assert made == other
    again = read_scene(tmp_path / "bar.toml", overrides=as_overrides(scene, other))
    assert again.bodies[0].material == other.bodies[0].material
    assert (again.gravity, again.substeps) == (other.gravity, other.substeps)
    with pytest.raises(InputError, match="save the scene instead"):
        as_overrides(other, scene)


def test_the_scene_has_all_that_can_be_changed(scene):
    for parameter in SIMULATION:
        get(scene, parameter.name)
    with pytest.raises(InputError):
        changed(scene, "tolerance", 2.0)
