"""The isotropic laws as functions of the stretches: derivatives, plane strain, closed forms, continuation."""

import json

import numpy as np
import pytest

from taichifem import runtime
from taichifem.formulas.models import MODELS, invertible

ti = runtime.ti
LAWS = {**MODELS, **{f"invertible {name}": invertible.wrap(model) for name, model in MODELS.items()}}
TABLES = {"corotational": "corotated", "stvk": "stvk", "neo-hookean": "stable_neohookean"}
LA, MU = 3e5, 1e5


@ti.kernel
def run(
    model: ti.template(),
    d: ti.template(),
    la: ti.f64,
    mu: ti.f64,
    stretches: ti.types.ndarray(dtype=ti.f64, ndim=2),
    directions: ti.types.ndarray(dtype=ti.f64, ndim=2),
    energy: ti.types.ndarray(dtype=ti.f64, ndim=1),
    slope: ti.types.ndarray(dtype=ti.f64, ndim=2),
    curvature: ti.types.ndarray(dtype=ti.f64, ndim=3),
    along: ti.types.ndarray(dtype=ti.f64, ndim=3),
):
    for n in energy:
        s = ti.Vector([stretches[n, k] for k in ti.static(range(d))])
        energy[n] = model.energy(s, la, mu)
        first, second = model.slope(s, la, mu), model.curvature(s, la, mu)
        for i in ti.static(range(d)):
            slope[n, i] = first[i]
        for i, j in ti.static(ti.ndrange(d, d)):
            curvature[n, i, j] = second[i, j]
        if ti.static(hasattr(model, "curvature_along")):
            direction = ti.Vector([directions[n, k] for k in ti.static(range(d))])
            third = model.curvature_along(s, direction, la, mu)
            for i, j in ti.static(ti.ndrange(d, d)):
                along[n, i, j] = third[i, j]


def evaluate(law: str, s: np.ndarray, directions: np.ndarray | None = None, la: float = LA, mu: float = MU):
    """Energy (n,), slope (n,d), curvature (n,d,d) and its change along `directions`, at the stretches s (n,d)."""
    runtime.start()
    n, d = s.shape
    s, directions = np.ascontiguousarray(s), np.zeros((n, d)) if directions is None else directions
    results = np.zeros(n), np.zeros((n, d)), np.zeros((n, d, d)), np.zeros((n, d, d))
    with runtime.precision_of("f64"):
        run(LAWS[law], d, la, mu, s, directions, *results)
    return results


def lame(youngs: float, poisson: float) -> tuple[float, float]:
    return youngs * poisson / ((1 + poisson) * (1 - 2 * poisson)), youngs / (2 * (1 + poisson))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("d", [2, 3])
def test_each_function_is_the_derivative_of_the_one_before(law, d):
    rng = np.random.default_rng(1)
    s, direction, h = rng.uniform(-1.5, 2.5, size=(300, d)), rng.normal(size=(300, d)), 1e-5
    s = s[(np.abs(s - 0.3) > 1e-3).all(axis=1)]  # the curvature of a continued law jumps at its threshold
    direction = direction[: len(s)]
    _, slope, curvature, along = evaluate(law, s, direction)
    plus, minus = evaluate(law, s + h * direction), evaluate(law, s - h * direction)
    energy_change, slope_change, curvature_change = [
        (a - b) / (2 * h) for a, b in zip(plus[:3], minus[:3], strict=True)
    ]
    np.testing.assert_allclose(energy_change, np.einsum("ni,ni->n", slope, direction), rtol=1e-6, atol=1e-3 * MU * h)
    expected = np.einsum("nij,nj->ni", curvature, direction)
    np.testing.assert_allclose(slope_change, expected, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(curvature, curvature.transpose(0, 2, 1), atol=1e-14 * np.abs(curvature).max())
    if not law.startswith("invertible"):
        np.testing.assert_allclose(curvature_change, along, atol=1e-8 * np.abs(curvature).max())


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("d", [2, 3])
def test_rest_is_free_of_stress_and_small_strains_obey_hooke(law, d):
    energy, slope, curvature, _ = evaluate(law, np.ones((1, d)))
    np.testing.assert_allclose(energy, 0, atol=1e-10 * MU)
    np.testing.assert_allclose(slope, 0, atol=1e-10 * MU)
    np.testing.assert_allclose(curvature[0], LA + 2 * MU * np.eye(d), rtol=1e-12)


@pytest.mark.parametrize("law", MODELS)
def test_two_dimensions_are_plane_strain(law):
    plane = np.random.default_rng(3).uniform(-1, 2, size=(50, 2))
    flat, solid = evaluate(law, plane), evaluate(law, np.column_stack([plane, np.ones(50)]))
    np.testing.assert_allclose(flat[0], solid[0], rtol=1e-12, atol=1e-9 * MU)
    np.testing.assert_allclose(flat[1], solid[1][:, :2], rtol=1e-12, atol=1e-9 * MU)
    np.testing.assert_allclose(flat[2], solid[2][:, :2, :2], rtol=1e-12, atol=1e-9 * MU)


@pytest.mark.parametrize("law", MODELS)
def test_even_laws_do_not_see_two_signs_change(law):
    s = np.random.default_rng(4).uniform(0.2, 2, size=(20, 3))
    same = np.allclose(evaluate(law, s)[0], evaluate(law, s * [-1, 1, -1])[0], rtol=1e-12)
    assert same == LAWS[law].EVEN


@pytest.mark.parametrize("law", MODELS)
def test_uniaxial_stress(oracles, law):
    tables = json.loads((oracles / "uniaxial_stress.json").read_text())["tables"]
    tables = [table for table in tables if table["law"] == TABLES[law]]
    assert len(tables) == 2
    for table in tables:
        stretch, lateral, nominal, cauchy, energy = np.array(table["rows"]).T
        s = np.column_stack([stretch, lateral, lateral])
        got_energy, slope, curvature, _ = evaluate(law, s, None, *lame(table["E"], table["nu"]))
        size = table["E"]
        # One step of Newton's method for the lateral stretch: it must already be right.
        step = slope[:, 1] / (curvature[:, 1, 1] + curvature[:, 1, 2])
        np.testing.assert_allclose(step, 0, atol=1e-11)
        np.testing.assert_allclose(slope[:, 0], nominal, rtol=1e-10, atol=1e-11 * size)
        np.testing.assert_allclose(slope[:, 0] / lateral**2, cauchy, rtol=1e-10, atol=1e-11 * size)
        np.testing.assert_allclose(got_energy, energy, rtol=1e-10, atol=1e-11 * size)


def test_stvk_is_weakest_at_one_over_root_three(oracles):
    known = json.loads((oracles / "stvk_softening.json").read_text())
    la, mu = lame(known["E"], known["nu"])

    def at(stretch):
        """Nominal stress and its derivative by the stretch, lateral faces free."""
        lateral = np.sqrt(1 - known["nu"] * (stretch**2 - 1))
        _, slope, curvature, _ = evaluate("stvk", np.array([[stretch, lateral, lateral]]), None, la, mu)
        C = curvature[0]
        return slope[0, 0], C[0, 0] - 2 * C[0, 1] * C[1, 0] / (C[1, 1] + C[1, 2])

    low, high = 0.4, 0.8
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if at(middle)[1] < 0 else (low, middle)
    assert low == pytest.approx(1 / np.sqrt(3), rel=1e-10)
    assert low == pytest.approx(known["stretch_at_minimum"], rel=1e-10)
    assert at(low)[0] == pytest.approx(-known["E"] / (3 * np.sqrt(3)), rel=1e-12)
    assert at(low)[0] == pytest.approx(known["uniaxial_stress_P_min"], rel=1e-12)


@pytest.mark.parametrize("law", MODELS)
def test_continuation_leaves_the_law_alone_above_the_threshold(law):
    s = np.random.default_rng(5).uniform(0.3001, 3, size=(50, 3))
    for own, continued in zip(evaluate(law, s)[:3], evaluate(f"invertible {law}", s)[:3], strict=True):
        np.testing.assert_allclose(continued, own, rtol=1e-13, atol=1e-9 * MU)


@pytest.mark.parametrize("law", MODELS)
def test_continuation_is_smooth_at_the_threshold_and_linear_below(law):
    law = f"invertible {law}"
    across = np.array([[0.3 - 1e-9, 0.8, 1.1], [0.3 + 1e-9, 0.8, 1.1]])
    energy, slope, _, _ = evaluate(law, across)
    np.testing.assert_allclose(np.diff(energy), 0, atol=1e-8 * MU)
    np.testing.assert_allclose(np.diff(slope, axis=0), 0, atol=2e-8 * MU)
    ramp = np.column_stack([np.linspace(0.29, -2, 20), np.full(20, 0.8), np.full(20, 1.1)])
    slope = evaluate(law, ramp)[1]
    np.testing.assert_allclose(np.diff(slope[:, 0]), (LA + 2 * MU) * np.diff(ramp[:, 0]), rtol=1e-9)
    np.testing.assert_allclose(np.diff(slope, n=2, axis=0), 0, atol=1e-8 * MU)
