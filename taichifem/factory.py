"""The one place that knows which simulation a scene asks for."""

from __future__ import annotations

from taichifem.description import Scene
from taichifem.reduced.reduced_simulation import ReducedSimulation
from taichifem.simulation import Simulation


def simulate(
    scene: Scene, *, precision: str = "f32", arch: str | None = None, threads: int | None = None
) -> Simulation | ReducedSimulation:
    """`Simulation`, or what has the same face for a scene whose materials have a reduced model.

    precision, arch, threads: as for `Simulation`. Raises InputError for what cannot be simulated.
    """
    kind = ReducedSimulation if is_reduced(scene) else Simulation
    return kind(scene, precision=precision, arch=arch, threads=threads)


def is_reduced(scene: Scene) -> bool:
    """Has it bodies of reduced models?"""
    return any(m.reduced for body in scene.bodies for m in (body.material, *body.materials.values()))
