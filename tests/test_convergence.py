"""Benchmarks approach what is known under refinement; `convergence.py` prints them as tables."""

import json
from itertools import pairwise

import convergence
import pytest

SLOW = pytest.mark.slow


def assert_towards(values, known: float, within: float, *, from_below: bool = True) -> None:
    """Every refinement is nearer to what is known, and the last is near enough."""
    errors = [value / known - 1 for value in values]
    assert all(abs(fine) < 0.8 * abs(coarse) for coarse, fine in pairwise(errors)), values
    assert abs(errors[-1]) < within, values
    assert not from_below or max(errors) < 0, values


@pytest.mark.parametrize(
    ("sizes", "within"),
    [((4, 8), 0.12), pytest.param((4, 8, 16, 32, 64), 0.003, marks=SLOW)],
)
def test_cook_membrane_in_the_plane(sizes, within):
    assert_towards(convergence.cook_membrane(sizes), convergence.COOK, within)


@pytest.mark.parametrize(
    ("sizes", "within"),
    [([(4, 1), (8, 1)], 0.33), pytest.param([(4, 1), (8, 1), (16, 1), (32, 1), (64, 2)], 0.012, marks=SLOW)],
)
def test_cook_slab_equals_scikit_fem(oracles, sizes, within):
    rows = json.loads((oracles / "cook_membrane.json").read_text())["slab_3d"]["rows"]
    known = {(n, nz): mean for n, nz, order, mean, *_ in rows if order == 1}
    values = convergence.cook_slab(sizes)
    assert values == pytest.approx([known[size] for size in sizes], rel=1e-6)
    assert_towards(values, convergence.COOK, within)


@pytest.mark.parametrize(
    ("sizes", "within"),
    [([(2, 4, 2), (4, 7, 2)], 0.27), pytest.param([(4, 7, 2), (8, 14, 4), (16, 28, 8)], 0.015, marks=SLOW)],
)
def test_nafems_le10(sizes, within):
    assert_towards(convergence.thick_plate(sizes), convergence.LE10, within)


@pytest.mark.parametrize("sphere", (0, 1))
@pytest.mark.parametrize(("sizes", "within"), [((2, 4), 0.11), pytest.param((2, 4, 8), 0.035, marks=SLOW)])
def test_thick_sphere_under_pressure(oracles, sphere, sizes, within):
    known = json.loads((oracles / "thick_sphere.json").read_text())["spheres"][sphere]
    values = convergence.thick_sphere(sizes, **{name: known[name] for name in ("E", "nu", "a", "b", "p")})
    assert_towards(values, known["rows"][0][1], within)


@pytest.mark.parametrize(("sizes", "within"), [((2, 4), 0.045), pytest.param((2, 4, 8, 16), 0.003, marks=SLOW)])
def test_thick_ring_in_plane_strain(sizes, within):
    E, nu, a, b, p = 1e5, 0.3, 0.5, 1.0, 1e3
    lame = (1 + nu) / E * p * a**2 / (b**2 - a**2) * ((1 - 2 * nu) * a + b**2 / a)
    assert_towards(convergence.thick_ring(sizes, E=E, nu=nu, a=a, b=b, p=p), lame, within)


@pytest.mark.parametrize(("sizes", "within"), [((1, 2), 0.37), pytest.param((1, 2, 4, 8), 0.055, marks=SLOW)])
def test_cantilever_approaches_timoshenko_from_below(oracles, sizes, within):
    beam = json.loads((oracles / "beams.json").read_text())["beams"][1]
    values = convergence.cantilever(
        sizes, E=beam["E"], nu=beam["nu"], L=beam["L"], h=beam["height_h"], force=beam["tip_force_F"]
    )
    assert_towards(values, beam["timoshenko_tip_force_kappa_cowper"], within)


@pytest.mark.slow
@pytest.mark.parametrize("row", (1, 3))
def test_elastica(oracles, row):
    """Bending through large angles; the extrapolated tip is that of the thin, inextensible rod but for 1%."""
    alpha, down, along, _ = json.loads((oracles / "elastica.json").read_text())["rows"][row]
    tips = convergence.elastica((2, 4, 8), alpha=alpha)
    assert_towards([-z for _, z in tips], down, 0.04)
    (x4, z4), (x8, z8) = tips[1:]
    assert x8 + (x8 - x4) / 3 == pytest.approx(along, rel=0.01)
    assert -z8 - (z8 - z4) / 3 == pytest.approx(down, rel=0.01)
