"""Material presets."""

import pytest

from taichifem.description import Material
from taichifem.errors import InputError
from taichifem.scene import presets


@pytest.mark.parametrize("name", presets.PRESETS)
def test_preset_is_a_material_with_a_source(name):
    material, source = presets.PRESETS[name]
    assert isinstance(material, Material) and presets.preset(name) == material
    assert source.strip() and "\n" not in source and any(c.isdigit() for c in source)
    # what a mistyped power of ten would break
    assert 1e3 < material.youngs < 1e12 and 10 < material.density < 2e4 and 0 <= material.poisson <= 0.47
    assert material.mass_damping == material.stiffness_damping == 0


def test_order_of_stiffness():
    order = ["gel", "foam", "rubber", "silicone", "cork", "polyethylene", "wood", "glass", "steel"]
    moduli = [presets.preset(name).youngs for name in order]
    assert moduli == sorted(moduli) and set(order) < set(presets.PRESETS)


def test_changes():
    changed = presets.preset("rubber", youngs=3e6, model="linear")
    assert (changed.youngs, changed.model, changed.density) == (3e6, "linear", 930.0)
    with pytest.raises(InputError, match="youngs"):
        presets.preset("rubber", youngs=-1.0)


def test_unknown_preset():
    with pytest.raises(InputError, match="did you mean 'rubber'"):
        presets.preset("ruber")
    with pytest.raises(InputError, match="choose one of gel, foam"):
        presets.preset("xyz")
