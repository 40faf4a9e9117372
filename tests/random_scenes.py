"""Random scenes: meshes, materials over six orders of magnitude, drops and pulls. None may give NaN or a traceback.

    python tests/random_scenes.py --count 100

The test suite runs a few of them.
"""

import argparse
import sys
from collections.abc import Callable

import numpy as np

import taichifem as tf

FRAMES = 120


def random_mesh(rng: np.random.Generator) -> tf.TetMesh:
    kind = rng.integers(5)
    if kind == 0:
        return tf.TetMesh.bar(size=tuple(rng.uniform(0.1, 1.0, 3)), cells=tuple(int(n) for n in rng.integers(1, 7, 3)))
    if kind == 1:
        return tf.TetMesh.sphere(radius=rng.uniform(0.1, 0.4), resolution=int(rng.integers(1, 4)))
    if kind == 2:
        return tf.TetMesh.torus(major_radius=rng.uniform(0.25, 0.4), minor_radius=rng.uniform(0.05, 0.2), resolution=1)
    if kind == 3:
        return tf.TetMesh.cylinder(radius=rng.uniform(0.05, 0.3), height=rng.uniform(0.1, 0.6), resolution=1)
    return tf.TetMesh.hollow_cylinder(
        inner_radius=rng.uniform(0.1, 0.2), outer_radius=rng.uniform(0.22, 0.4), height=0.3, resolution=1
    )


def random_body(rng: np.random.Generator, x: float) -> tf.Body:
    mesh = random_mesh(rng)
    material = tf.Material(
        model=str(rng.choice(["corotational", "corotational", "linear"])),
        youngs=10 ** rng.uniform(3, 9),
        poisson=rng.uniform(0, 0.49),
        density=10 ** rng.uniform(2, 4),
        mass_damping=rng.choice([0, 1.0]),
        stiffness_damping=rng.choice([0, 0.01]),
    )
    position = (x, 0.0, float(rng.uniform(0.5, 2.0)))
    placed = dict(mesh=mesh, material=material, position=position, axis=tuple(rng.normal(size=3)), angle=90.0)
    points = tf.Body(**placed).placed_points()
    far, near = points[np.argmax(points[:, 0])], points[np.argmin(points[:, 0])]
    pins, handles = [], []
    how = rng.integers(4)
    if how in (1, 2):
        pins.append(tf.NearestRegion(point=tuple(near), count=4))
    if how in (2, 3):
        motion = tf.Motion(times=(0, 1), translation=((0, 0, 0), tuple(rng.normal(size=3))))
        region = tf.NearestRegion(point=tuple(far), count=3)
        if rng.random() < 0.5:
            handles.append(tf.Handle(region=region, stiffness=10 ** rng.uniform(1, 6), motion=motion))
        else:
            pins.append(tf.Pin(region=region, motion=motion, until=1.2))
    velocity, spin = tuple(rng.normal(size=3)), tuple(3 * rng.normal(size=3))
    return tf.Body(**placed, velocity=velocity, spin=spin, pins=pins, handles=handles)


def random_scene(seed: int) -> tf.Scene:
    """One to three bodies over the ground, a ball and a box, one of which moves."""
    rng = np.random.default_rng(seed)
    lift = tf.Motion(times=(0, 1, 2), translation=((0, 0, 0), (0.2, 0, 0.5), (0, 0, 0)), angle=(0, 60, 0), smooth=True)
    colliders = [
        tf.PlaneCollider(friction=rng.uniform(0, 1)),
        tf.SphereCollider(center=(0, 0, 0), radius=0.3, friction=rng.uniform(0, 1)),
        tf.BoxCollider(center=(1.2, 0, 0.1), size=(1, 1, 0.2), axis=(0, 1, 0), angle=15, motion=lift),
    ]
    bodies = [random_body(rng, 1.2 * k) for k in range(rng.integers(1, 4))]
    return tf.Scene(bodies=bodies, colliders=colliders)


def run(seed: int, precision: str = "f32") -> str:
    """Run one scene; a line about it. Raises AssertionError on NaN or an absurd speed."""
    simulation = tf.Simulation(random_scene(seed), precision=precision)
    fastest = 0.0
    capped = 0
    for _ in range(FRAMES):
        simulation.step()
        v = simulation.velocities
        assert np.isfinite(simulation.positions).all() and np.isfinite(v).all(), f"seed {seed}: NaN"
        fastest = max(fastest, float(np.abs(v).max()))
        capped += not simulation.stats.converged
    assert fastest < 300, f"seed {seed}: a node reached {fastest:.0f} m/s"
    return f"seed {seed}: fastest {fastest:.1f} m/s, {capped} steps at the cap, {simulation.stats}"


def main(run: Callable[[int], str], description: str, *, count: int) -> int:
    """The command of a script: run some seeds, tell of each, and go on where one fails. The exit code."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    failed = 0
    for seed in range(options.first, options.first + options.count):
        try:
            print(run(seed), flush=True)
        except Exception as error:
            failed += 1
            print(f"FAILED seed {seed}: {type(error).__name__}: {error}", flush=True)
    print(f"{options.count - failed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(run, __doc__, count=100))
