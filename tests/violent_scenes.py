"""Plastic bodies that hit the ground at the speed of a fall from 10 m, or are crushed to a fifth of their height.

    python tests/violent_scenes.py --count 50

No NaN, no absurd speed, and no element that is blown up. The test suite runs a few of them.
"""

import sys

import numpy as np
import random_scenes

import taichifem as tf

FALL = float(np.sqrt(2 * 9.81 * 10))
"""Speed after a fall of 10 m [m/s]."""

MODELS = ("linear", "corotational", "stvk", "neo-hookean", "invertible", "mass-spring")


def random_material(rng: np.random.Generator) -> tf.Material:
    """Any model with any law; it yields at strains from 0.1 % to 10 %."""
    youngs, strain = 10 ** rng.uniform(4, 8), 10 ** rng.uniform(-3, -1)
    law = str(rng.choice(["creep", "von-mises", "tresca"]))
    if law == "creep":
        flow = dict(yield_strain=strain, creep_rate=10 ** rng.uniform(0, 3))
        flow |= dict(max_plastic_strain=rng.uniform(0.1, 1.0)) if rng.random() < 0.5 else {}
    else:
        flow = dict(yield_stress=youngs * strain, hardening=youngs * rng.choice([0.0, 0.05]))
        flow |= dict(viscosity=youngs * 1e-3) if rng.random() < 0.3 else {}
    return tf.Material(
        model=str(rng.choice(MODELS)),
        youngs=youngs,
        poisson=rng.uniform(0, 0.45),
        density=10 ** rng.uniform(2, 4),
        mass_damping=rng.choice([0, 1.0]),
        stiffness_damping=rng.choice([0, 0.002]),
        plasticity=law,
        **flow,
    )


def violent_scene(seed: int) -> tf.Scene:
    """Even seeds fall, odd ones are crushed and released."""
    rng = np.random.default_rng([seed, 5])
    placed = dict(mesh=random_scenes.random_mesh(rng), material=random_material(rng))
    placed |= dict(axis=tuple(rng.normal(size=3)), angle=float(rng.uniform(0, 360)))
    points = tf.Body(**placed).placed_points()
    low, high = points[:, 2].min(), points[:, 2].max()
    ground = tf.PlaneCollider(friction=rng.uniform(0, 1))
    if seed % 2 == 0:
        lift = (0.0, 0.0, 0.02 - low)
        velocity = (*rng.uniform(-3, 3, 2), -FALL)
        body = tf.Body(**placed, position=lift, velocity=velocity, spin=tuple(5 * rng.normal(size=3)))
        return tf.Scene(bodies=[body], colliders=[ground])
    height, duration = high - low, rng.uniform(0.1, 1.0)
    way = ((0, 0, 0), (0, 0, -0.8 * height), (0, 0, 0.5 * height))
    motion = tf.Motion(times=(0.0, duration, 2 * duration), translation=way)
    plate = tf.BoxCollider(center=(0, 0, height + 0.51), size=(6, 6, 1), motion=motion, friction=rng.uniform(0, 1))
    return tf.Scene(bodies=[tf.Body(**placed, position=(0.0, 0.0, 0.005 - low))], colliders=[ground, plate])


def volumes(simulation: tf.Simulation) -> np.ndarray:
    """det F of each element, which is det F_e where F_p keeps the volume."""
    now, rest = (
        np.linalg.det(x[:, 1:] - x[:, :1])
        for x in (simulation.positions[simulation.cells], simulation.rest_positions[simulation.cells])
    )
    return now / rest


def run(seed: int) -> str:
    """Run one scene; a line about it. Raises AssertionError on NaN, an absurd speed or an absurd volume."""
    scene = violent_scene(seed)
    material = scene.bodies[0].material
    simulation = tf.Simulation(scene)
    fastest, least, most, capped = 0.0, 1.0, 1.0, 0
    for _ in range(random_scenes.FRAMES):
        simulation.step()
        assert np.isfinite(simulation.positions).all(), f"seed {seed}: NaN"
        fastest = max(fastest, float(np.abs(simulation.velocities).max()))
        found = volumes(simulation)
        least, most = min(least, float(found.min())), max(most, float(found.max()))
        capped += not simulation.stats.converged
    accumulated = simulation.equivalent_plastic_strain().max()
    assert np.isfinite(accumulated) and np.isfinite(simulation.cauchy_stress()).all(), f"seed {seed}: NaN"
    line = f"seed {seed}: {material.model} {material.plasticity}: det F {least:.2f} to {most:.2f}, in the end "
    line += (
        f"{found.min():.2f} to {found.max():.2f}, fastest {fastest:.0f} m/s, alpha {accumulated:.2f}, {capped} capped"
    )
    assert fastest < 100 and least > -3 and most < 3, line
    return line


if __name__ == "__main__":
    sys.exit(random_scenes.main(run, __doc__, count=50))
