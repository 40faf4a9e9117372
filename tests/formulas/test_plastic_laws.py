"""The plastic laws at a material point: on the yield surface, along its normal, without change of volume."""

import json

import numpy as np
import pytest

from taichifem import runtime
from taichifem.formulas import plasticity
from taichifem.runtime import ti

LA, MU, Y, H = 3e5, 1e5, 1e3, 2e4
KINDS = {"von-mises": plasticity.VON_MISES, "tresca": plasticity.TRESCA}


@pytest.fixture(scope="module")
def point():
    """Stress (n,3), its tangent (n,3,3), flow and growth for principal strains (n,3)."""
    runtime.start()
    real = ti.f64
    vector = ti.types.ndarray(dtype=ti.types.vector(3, real), ndim=1)
    matrix = ti.types.ndarray(dtype=ti.types.matrix(3, 3, real), ndim=1)

    @ti.kernel
    def answer(kind: ti.i32, given: vector, e: vector, s: vector, A: matrix, f: vector, g: vector):
        alpha, slope, rate, dt = given[0][0], given[0][1], given[0][2], given[1][0]
        for n in e:
            s[n], A[n] = plasticity.response(kind, e[n], alpha, LA, MU, Y, slope, rate, dt)
            shape = plasticity.without_mean(e[n])
            share, growth = plasticity.von_mises_share(shape.norm(), alpha, MU, Y, slope, rate, dt)
            flow = share * shape
            if kind == plasticity.TRESCA:
                flow, growth = plasticity.tresca_flow(e[n], alpha, MU, Y, slope, rate, dt)
            f[n], g[n] = flow, ti.Vector([growth, 0.0, 0.0])

    def evaluate(law, e, *, alpha=0.0, hardening=0.0, viscosity=0.0, dt=1.0):
        e = np.ascontiguousarray(e, dtype=np.float64)
        s, f, g, A = np.zeros_like(e), np.zeros_like(e), np.zeros_like(e), np.zeros((len(e), 3, 3))
        with runtime.precision_of("f64"):
            answer(KINDS[law], np.array([[alpha, hardening, viscosity], [dt, 0, 0]]), e, s, A, f, g)
        return s, A, f, g[:, 0]

    return evaluate


def equivalent(law: str, s: np.ndarray) -> np.ndarray:
    """Equivalent stress (n,) by the textbook."""
    a, b, c = s.T
    if law == "tresca":
        return s.max(axis=1) - s.min(axis=1)
    return np.sqrt(0.5 * ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2))


def strains(n: int, scale: float = 0.02) -> np.ndarray:
    return np.random.default_rng(5).normal(size=(n, 3)) * scale


@pytest.mark.parametrize("law", KINDS)
@pytest.mark.parametrize("hardening", [0.0, H])
def test_what_yields_ends_on_the_yield_surface_and_moves_along_its_normal(point, law, hardening):
    e = strains(4000, 0.01)
    s, _, flow, growth = point(law, e, alpha=0.003, hardening=hardening)
    trial = 2 * MU * e + LA * e.sum(axis=1, keepdims=True)
    yields = equivalent(law, trial) > Y + 0.003 * hardening
    assert 0.2 < yields.mean() < 0.99
    np.testing.assert_array_equal(s[~yields], trial[~yields])
    assert not growth[~yields].any() and not flow[~yields].any()
    np.testing.assert_allclose(equivalent(law, s[yields]), Y + hardening * (0.003 + growth[yields]), rtol=1e-10)
    np.testing.assert_allclose(s, trial - 2 * MU * flow, atol=1e-9 * MU)
    assert abs(flow.sum(axis=1)).max() < 1e-15
    # Maximum dissipation: no other stress on the surface would have done more work on this flow.
    others = np.random.default_rng(6).normal(size=(500, 3))
    others *= (Y / equivalent(law, others))[:, None]
    if hardening == 0:
        done = (s * flow).sum(axis=1)[yields]
        assert (flow[yields] @ others.T <= done[:, None] * (1 + 1e-9)).all()
        np.testing.assert_allclose(done, Y * growth[yields], rtol=1e-9)


@pytest.mark.parametrize("law", KINDS)
def test_tresca_visits_faces_and_both_kinds_of_corners(point, law):
    s = np.sort(point(law, strains(4000, 0.01))[0], axis=1)
    tension, pressure = (s[:, 1] - s[:, 0] < 1e-6 * Y), (s[:, 2] - s[:, 1] < 1e-6 * Y)
    shares = [tension.mean(), pressure.mean(), (~tension & ~pressure).mean()]
    assert min(shares) > 0.1 if law == "tresca" else shares[2] > 0.999


@pytest.mark.parametrize("law", KINDS)
@pytest.mark.parametrize("rate", [{}, {"hardening": H}, {"hardening": H, "viscosity": 3e4, "dt": 0.5}])
def test_tangent_is_the_derivative(point, law, rate):
    e, h = strains(500), 1e-8
    A = point(law, e, alpha=0.002, **rate)[1]
    columns = []
    for k in range(3):
        up, down = (point(law, e + sign * h * np.eye(3)[k], alpha=0.002, **rate)[0] for sign in (1, -1))
        columns.append((up - down) / (2 * h))
    error = abs(np.stack(columns, axis=2) - A).max(axis=(1, 2)) / MU
    assert np.quantile(error, 0.98) < 1e-5  # a few lie within h of a kink


@pytest.mark.parametrize("law", KINDS)
def test_pressure_changes_nothing(point, law):
    e = strains(200)
    _, _, flow, growth = point(law, e)
    _, _, pressed, more = point(law, e - 0.5)
    np.testing.assert_allclose(pressed, flow, atol=1e-14)
    np.testing.assert_allclose(more, growth, atol=1e-14)
    assert not point(law, np.full((1, 3), 100 * Y / (3 * LA + 2 * MU)))[3].any()


@pytest.mark.parametrize("law", KINDS)
def test_first_yield_loads(point, oracles, law):
    """The table's states, just below and just above the load at which they yield."""
    table = json.loads((oracles / "yield_loads.json").read_text())
    states = {
        "uniaxial s=(s,0,0)": (1, 0, 0),
        "pure shear tau": (1, -1, 0),
        "equibiaxial s=(s,s,0)": (1, 1, 0),
        "biaxial s=(s,s/2,0)": (1, 0.5, 0),
        "biaxial s=(s,-s/2,0)": (1, -0.5, 0),
    }
    compliance = np.linalg.inv(2 * MU * np.eye(3) + LA)
    found = {row["state"]: row[law.replace("-", "_")] for row in table["states"]}
    for name, state in states.items():
        e = np.outer([1 - 1e-9, 1 + 1e-9], compliance @ np.array(state)) * Y * found[name]
        growth = point(law, e)[3]
        assert growth[0] == 0 and growth[1] > 0, name


def test_viscosity_delays_flow(point):
    """Perzyna: the overstress decays by the factor 1 / (1 + dt (3 mu) / viscosity) each step, under held strain."""
    viscosity, dt, e = 2e6, 0.1, np.array([[0.02, 0.0, -0.01]])
    over = equivalent("von-mises", 2 * MU * e)[0] - Y
    for _ in range(20):
        s, _, flow, _ = point("von-mises", e, viscosity=viscosity, dt=dt)
        e = e - flow
        over /= 1 + 3 * MU * dt / viscosity
        assert equivalent("von-mises", s)[0] - Y == pytest.approx(over, rel=1e-9)


def test_creep_is_the_sequence_of_the_slides(oracles):
    real = ti.f64
    array = ti.types.ndarray(dtype=real, ndim=1)

    @ti.kernel
    def creep(total: array, limit: real, rate: real, most: real, after: array):
        plastic = ti.Matrix.zero(real, 3, 3)
        ti.loop_config(serialize=True)
        for n in range(after.shape[0]):
            e = -plastic
            e[0, 1] += total[n] / ti.sqrt(2.0)
            e[1, 0] += total[n] / ti.sqrt(2.0)
            plastic = plasticity.creep_bound(plastic + plasticity.creep_flow(e, limit, rate, 0.5)[0], most)
            after[n] = plastic[0, 1] * ti.sqrt(2.0)

    runtime.start()
    for row in json.loads((oracles / "mueller_creep_1d.json").read_text())["sequences"]:
        expected = np.array(row["eps_plastic_after_step"])
        after = np.zeros_like(expected)
        with runtime.precision_of("f64"):
            creep(
                np.broadcast_to(row["eps_total"], expected.shape).astype(float),
                row["yield_"],
                2 * row["creep_per_step"],
                row["max_"],
                after,
            )
        np.testing.assert_allclose(after, expected, rtol=1e-13, atol=1e-15)


def test_springs_follow_their_tables(oracles):
    """Yield forces that differ in tension and pressure; and a rest length that follows beyond a dead zone."""
    real = ti.f64
    array = ti.types.ndarray(dtype=real, ndim=1)

    @ti.kernel
    def follow(
        kind: ti.i32, lengths: array, youngs: real, limit: real, pressed: real, rate: real, dt: real, rests: array
    ):
        rest, alpha = ti.cast(1.0, real), ti.cast(0.0, real)
        ti.loop_config(serialize=True)
        for n in range(lengths.shape[0]):
            slope = 1e30 if kind == plasticity.CREEP else 0.0
            stress = youngs, limit, pressed, slope, rate, dt
            moved, growth = plasticity.spring_flow(kind, lengths[n], rest, 1.0, alpha, *stress)
            rest += moved
            alpha += growth
            rests[n] = rest

    runtime.start()
    table = json.loads((oracles / "spring_plasticity_1d.json").read_text())
    a, b = table["A"], table["B"]
    rows = np.array(a["rows"])
    rests = np.zeros(len(rows))
    lengths = [np.ascontiguousarray(np.array(t["rows"])[:, 0]) for t in (a, b)]
    with runtime.precision_of("f64"):
        # A spring of length 1 with k = 100 N/m: its Young's modulus over the cross-section of 1 m^2 is 100 Pa.
        follow(plasticity.VON_MISES, lengths[0], a["k"], a["yield_tension"], a["yield_compression"], 0.0, 1.0, rests)
    np.testing.assert_allclose(rests, rows[:, 2], rtol=1e-12)
    np.testing.assert_allclose(a["k"] * (rows[:, 0] - rests), rows[:, 1], atol=1e-12)
    rests = np.zeros(len(lengths[1]))
    zone = b["dead_zone_tension"], b["dead_zone_compression"]
    with runtime.precision_of("f64"):
        follow(plasticity.CREEP, lengths[1], 1.0, *zone, b["rate_alpha"], b["dt"], rests)
    np.testing.assert_allclose(rests, np.array(b["rows"])[:, 1], rtol=1e-12)
