"""Each oscillator follows its exact motion, however long the step."""

import numpy as np
import pytest
import scipy.linalg

from taichifem.reduced.oscillators import Oscillators, transition

KINDS = {"undamped": 0.0, "under": 0.3, "critical": 2.0, "over": 7.0}


def exact(w, d, q, v, f, dt):
    system = np.array([[0, 1, 0], [-w * w, -d, 1], [0, 0, 0]])
    return (scipy.linalg.expm(system * dt) @ [q, v, f])[:2]


@pytest.mark.parametrize("w", [0.0, 1e-3, 1.0, 30.0])
@pytest.mark.parametrize("kind", KINDS)
def test_a_step_is_the_matrix_exponential(w, kind):
    d = KINDS[kind] * max(w, 1.0)
    for dt in (1e-4, 0.1, 1.0):
        t = transition(np.array([w]), np.array([d]), dt)
        got = [t.qq * 0.3 + t.qv * 0.7 - 2 * t.qf, t.vq * 0.3 + t.vv * 0.7 - 2 * t.vf]
        np.testing.assert_allclose(np.ravel(got), exact(w, d, 0.3, 0.7, -2.0, dt), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("dt", [1e-4, 1 / 60, 0.37, 2.0])
def test_ten_thousand_steps_of_a_damped_cosine(dt):
    """Error below 1e-10 of the amplitude, at any step."""
    w, damping = np.array([0.5, 11.0]), 2e-4
    mode = Oscillators(w, mass_damping=damping)
    mode.q[:] = 1.0
    a, t = damping / 2, dt * np.arange(1, 10_001)[:, None]
    rate = np.sqrt(w * w - a * a)
    expected = np.exp(-a * t) * (np.cos(rate * t) + a / rate * np.sin(rate * t))
    for target in expected:
        mode.advance(dt)
        assert np.abs(mode.q - target).max() < 1e-10


def test_steps_of_any_size_reach_the_same_place():
    w = np.geomspace(0.1, 1e4, 40)
    for damping in (
        {},
        {"mass_damping": 3.0},
        {"stiffness_damping": 0.01},
        {"mass_damping": 1.0, "stiffness_damping": 1.0},
    ):
        once, often = Oscillators(w, **damping), Oscillators(w, **damping)
        once.q[:], often.q[:] = 0.2, 0.2
        once.v[:], often.v[:] = -1.0, -1.0
        once.advance(0.5, 3.0)
        for _ in range(64):
            often.advance(0.5 / 64, 3.0)
        np.testing.assert_allclose(often.q, once.q, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(often.v, once.v, rtol=1e-9, atol=1e-8)


def test_undamped_energy_stays():
    mode = Oscillators(np.array([3.0, 500.0, 0.0]))
    mode.q[:], mode.v[:] = [0.1, 0.01, 0.0], [1.0, 2.0, 3.0]
    energy = mode.elastic_energy + mode.kinetic_energy
    for _ in range(1000):
        mode.advance(1 / 60)
    assert mode.elastic_energy + mode.kinetic_energy == pytest.approx(energy, rel=1e-12)
