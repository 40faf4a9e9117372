"""Large-strain plasticity at a material point."""

import numpy as np
import pytest

from taichifem import runtime
from taichifem.formulas import finite_plasticity, plasticity
from taichifem.formulas.models import invertible, neo_hookean
from taichifem.runtime import ti

LA, MU, Y, H = 3e5, 1e5, 5e3, 2e4
LAWS = {"neo-hookean": neo_hookean, "invertible": invertible.wrap(neo_hookean)}
KINDS = {"von-mises": plasticity.VON_MISES, "tresca": plasticity.TRESCA}


@pytest.fixture(scope="module", params=LAWS)
def point(request):
    """What is left of logarithms (n,3), growth (n,), stress (n,3) and its derivative (n,3,3) by them."""
    runtime.start()
    real = ti.f64
    vector = ti.types.ndarray(dtype=ti.types.vector(3, real), ndim=1)
    matrix = ti.types.ndarray(dtype=ti.types.matrix(3, 3, real), ndim=1)

    @ti.kernel
    def answer(
        law: ti.template(), kind: ti.i32, given: vector, e: vector, left: vector, g: vector, s: vector, D: matrix
    ):
        alpha, slope, rate, dt = given[0][0], given[0][1], given[0][2], given[1][0]
        for n in e:
            limits = Y, slope, rate, dt
            eps, growth, T = finite_plasticity.returned(law, kind, e[n], alpha, LA, MU, *limits)
            left[n], g[n], D[n] = eps, ti.Vector([growth, 0.0, 0.0]), T
            s[n] = finite_plasticity.kirchhoff(law, ti.exp(eps), LA, MU)[0]

    def evaluate(kind, e, *, alpha=0.0, hardening=0.0, viscosity=0.0, dt=1.0):
        e = np.ascontiguousarray(e, dtype=np.float64)
        left, g, s, D = np.zeros_like(e), np.zeros_like(e), np.zeros_like(e), np.zeros((len(e), 3, 3))
        with runtime.precision_of("f64"):
            given = np.array([[alpha, hardening, viscosity], [dt, 0, 0]])
            answer(LAWS[request.param], KINDS[kind], given, e, left, g, s, D)
        return left, g[:, 0], s, D

    return evaluate


def equivalent(kind: str, s: np.ndarray) -> np.ndarray:
    a, b, c = s.T
    if kind == "tresca":
        return s.max(axis=1) - s.min(axis=1)
    return np.sqrt(0.5 * ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2))


def logarithms(n: int, scale: float) -> np.ndarray:
    found = np.random.default_rng(8).normal(size=(2 * n, 3)) * scale
    return found[np.exp(found).min(axis=1) > finite_plasticity.CRUSHED][:n]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("hardening", [0.0, H])
@pytest.mark.parametrize("scale", [0.05, 0.5])
def test_what_flows_keeps_its_volume_and_meets_the_yield_surface(point, kind, hardening, scale):
    e = logarithms(2000, scale)
    left, growth, s, _ = point(kind, e, alpha=0.01, hardening=hardening)
    flows = growth > 0
    assert flows.mean() > 0.3
    np.testing.assert_array_less(equivalent(kind, s[~flows]), (Y + 0.01 * hardening) * (1 + 1e-9))
    np.testing.assert_allclose(equivalent(kind, s[flows]), Y + hardening * (0.01 + growth[flows]), rtol=1e-8)
    flow = e - left
    assert abs(flow.sum(axis=1)).max() < 1e-14
    assert not flow[~flows].any()
    # It goes along the normal of the surface at the stress that is reached, and so dissipates.
    np.testing.assert_allclose((s * flow).sum(axis=1)[flows], (equivalent(kind, s) * growth)[flows], rtol=1e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_the_derivative_is_that_of_the_return(point, kind):
    e, h = logarithms(300, 0.2), 1e-6
    options = dict(alpha=0.02, hardening=H, viscosity=1e3, dt=0.1)
    D = point(kind, e, **options)[3]
    columns = []
    for k in range(3):
        up, down = (point(kind, e + sign * h * np.eye(3)[k], **options)[2] for sign in (1, -1))
        columns.append((up - down) / (2 * h))
    error = abs(np.stack(columns, axis=2) - D).max(axis=(1, 2)) / abs(D).max(axis=(1, 2))
    assert np.quantile(error, 0.97) < 1e-5  # a few lie within h of a kink
