"""Random bodies that break, as far as to single elements: drops, pulls and blows.

    python tests/breaking_scenes.py --count 50

No NaN, no exception, and after every split a valid mesh of the same mass. The test suite runs a few of them.
"""

import sys
from dataclasses import replace

import numpy as np
import random_scenes
import violent_scenes

import taichifem as tf
from taichifem.mesh.connectivity import boundary_faces


def breaking_scene(seed: int) -> tf.Scene:
    """A body of the random or of the violent scenes, elastic or plastic, with a toughness that it may well exceed."""
    rng = np.random.default_rng([seed, 6])
    scene = violent_scenes.violent_scene(seed) if seed % 4 < 2 else random_scenes.random_scene(seed)
    bodies = []
    for body in scene.bodies:
        material = body.material
        toughness = material.youngs * 10 ** rng.uniform(-4, -1)
        # A handle on a splinter would throw it anywhere.
        bodies.append(replace(body, handles=(), material=replace(material, fracture=tf.Fracture(toughness=toughness))))
    return replace(scene, bodies=bodies, seed=seed, max_splits=int(rng.choice([20, 1000])))


def assert_sound(simulation: tf.Simulation, mass: float) -> None:
    n = len(simulation.positions)
    np.testing.assert_array_equal(np.unique(simulation.cells), np.arange(n))
    assert n <= simulation.cells.size
    faces, _ = boundary_faces(simulation.cells)
    directed = np.concatenate([faces[:, [a, (a + 1) % 3]] for a in range(3)])
    assert np.array_equal(np.sort(directed @ (n, 1)), np.sort(directed[:, ::-1] @ (n, 1)))
    assert abs(simulation.masses.sum() / mass - 1) < 1e-5


def run(seed: int) -> str:
    """Run one scene; a line about it."""
    simulation = tf.Simulation(breaking_scene(seed))
    mass, splits, fastest = simulation.masses.sum(), 0, 0.0
    for _ in range(random_scenes.FRAMES):
        simulation.step()
        splits += simulation.splits
        assert np.isfinite(simulation.positions).all(), f"seed {seed}: NaN"
        fastest = max(fastest, float(np.abs(simulation.velocities).max()))
        if simulation.splits:
            assert_sound(simulation, mass)
    models = {body.material.model for body in simulation.scene.bodies}
    line = f"seed {seed}: {', '.join(sorted(models))}: {splits} splits, {simulation.piece_count} pieces of "
    line += f"{len(simulation.cells)} elements, fastest {fastest:.0f} m/s"
    assert fastest < 300, line
    return line


if __name__ == "__main__":
    sys.exit(random_scenes.main(run, __doc__, count=50))
