"""Newton's method in dynamics: energy never rises, convergence is quadratic."""

import itertools

import pytest

import taichifem as tf

BLOCK = tf.TetMesh.bar(size=(0.4, 0.2, 0.2), cells=(3, 2, 2))
LAWS = {
    "linear": {"model": "linear"},
    "corotational": {"model": "corotational"},
    "stvk": {"model": "stvk"},
    "neo-hookean": {"model": "neo-hookean"},
    "invertible": {"model": "invertible", "wraps": "neo-hookean"},
    "mass-spring": {"model": "mass-spring"},
}


QUICK_FIRST = [
    law if law in ("corotational", "neo-hookean") else pytest.param(law, marks=pytest.mark.slow) for law in LAWS
]


def simulate(law: str, *, youngs=1e5, damping=0.0, **scene) -> tf.Simulation:
    material = tf.Material(**LAWS[law], youngs=youngs, poisson=0.3, stiffness_damping=damping)
    body = tf.Body(mesh=BLOCK, material=material, velocity=(1, 0, 2), spin=(0, 6, 3))
    chosen = {"gravity": (0, 0, 0), "integrator": "backward-euler-newton", "tolerance": 1e-6} | scene
    return tf.Simulation(tf.Scene(bodies=[body], **chosen), precision="f64")


@pytest.mark.parametrize("damping", [0.0, 0.01])
@pytest.mark.parametrize("law", QUICK_FIRST)
def test_energy_never_rises(law, damping):
    """A block thrown, turning and deformed, at 20 steps a second: stretched at first, then crushed."""
    simulation = simulate(law, damping=damping, fps=20)
    for stretch in ((1.4, 0.8, 0.9), (0.5, 0.6, 0.7)):
        simulation.set_positions(BLOCK.points * stretch)
        energy = first = simulation.stats.energy["total"]
        for _ in range(15):
            simulation.step()
            now = simulation.stats.energy["total"]
            assert now <= energy + 1e-6 * first
            energy = now
        assert energy < first


@pytest.mark.parametrize("law", QUICK_FIRST)
def test_convergence_is_quadratic(law):
    """Once the imbalance is small, every linearisation squares it, up to a factor; and few are needed."""
    simulation = simulate(law, fps=60, tolerance=1e-12, newton_tolerance=1e-11)
    simulation.set_positions(BLOCK.points * [1.2, 0.9, 0.95])
    simulation.step()
    assert simulation.report.balanced
    history = [it.imbalance for it in simulation.report.history]
    assert len(history) <= 9
    small = [(a, b) for a, b in itertools.pairwise(history) if 1e-5 < a < 1e-2]
    assert all(b < max(30 * a * a, 1e-10) for a, b in small)
    assert history[-1] < 1e-10
