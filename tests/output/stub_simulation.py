"""Stands in for a Simulation: a bar that flies off at constant velocity, without Taichi."""

from types import SimpleNamespace

import numpy as np

from taichifem.description import Body, Scene
from taichifem.errors import Diverged
from taichifem.mesh import TetMesh

VELOCITY = np.array([1.0, 0.0, 2.0])


class StubSimulation:
    """Has what the output room asks of a simulation. `diverges_at`: the frame that fails."""

    def __init__(self, *, diverges_at: int | None = None, interrupted_at: int | None = None) -> None:
        mesh = TetMesh.bar(size=(1.0, 0.5, 0.5), cells=(4, 2, 2))
        self.scene = Scene(bodies=[Body(mesh=mesh)], fps=30, name="a/b <bar>")
        self.rest_positions, self.cells = mesh.points, mesh.cells
        self.surface = mesh.surface()
        self.crack_faces = np.zeros(len(self.surface), dtype=bool)
        self.surface_bodies = np.zeros(len(self.surface), dtype=int)
        self.cell_bodies = np.zeros(len(self.cells), int)
        self.cell_regions = np.arange(len(self.cells)) % 2
        self.frame, self.diverges_at, self.interrupted_at = 0, diverges_at, interrupted_at
        self.saved: list[int] = []

    @property
    def time(self) -> float:
        return self.frame / self.scene.fps

    @property
    def positions(self) -> np.ndarray:
        return self.rest_positions + self.time * VELOCITY

    @property
    def velocities(self) -> np.ndarray:
        return np.tile(VELOCITY, (len(self.rest_positions), 1))

    def cauchy_stress(self) -> np.ndarray:
        return np.arange(9.0 * len(self.cells)).reshape(-1, 3, 3)

    def von_mises(self) -> np.ndarray:
        return np.arange(len(self.cells)) + 10.0 * self.frame

    def plastic_strain(self) -> np.ndarray:
        return 1e-3 * self.cauchy_stress()

    def equivalent_plastic_strain(self) -> np.ndarray:
        return 1e-3 * self.von_mises()

    @property
    def stats(self) -> SimpleNamespace:
        figures = {"frame": self.frame, "energy": {"total": np.float32(1.5)}, "residual": float("nan")}
        return SimpleNamespace(as_dict=lambda: figures)

    def advance_frame(self) -> None:
        if self.frame + 1 == self.diverges_at:
            raise Diverged("the simulation diverged at t = 0.1 s")
        if self.frame + 1 == self.interrupted_at:
            raise KeyboardInterrupt
        self.frame += 1

    def save(self, path) -> None:
        self.saved.append(self.frame)
        path.write_text(str(self.frame))
