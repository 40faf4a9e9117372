"""PyBullet's deformable body: neo-Hookean, its elastic forces explicit."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import common
import numpy as np
import pybullet


def build(task: common.Task):
    pybullet.connect(pybullet.DIRECT)
    pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD)
    pybullet.setGravity(0, 0, -task.gravity)
    file = Path("bar.vtk").absolute()
    file.write_text(_vtk(task.points, task.tets), encoding="ascii")
    mu, lam = task.smith_constants
    body = pybullet.loadSoftBody(
        str(file),
        simFileName=str(file),
        mass=task.masses.sum(),
        useNeoHookean=1,
        NeoHookeanMu=mu,
        NeoHookeanLambda=lam,
        NeoHookeanDamping=0,
        collisionMargin=1e-4,
        useSelfCollision=0,
        useMassSpring=0,
        useBendingSprings=0,
    )
    for node in task.held:
        pybullet.createSoftBodyAnchor(body, int(node), -1, -1)
    substeps = task.explicit_substeps
    pybullet.setTimeStep(1 / (common.FPS * substeps))

    def frame() -> None:
        for _ in range(substeps):
            pybullet.stepSimulation()

    def heights() -> np.ndarray:
        _, points = pybullet.getMeshData(body, -1, flags=pybullet.MESH_DATA_SIMULATION_MESH)
        return np.array(points)[task.tip, 2]

    about = {
        "version": importlib.metadata.version("pybullet"),
        "law": "neo-Hookean",
        "method": "explicit",
        "precision": "f64",
        "substeps": substeps,
        "differs": "all nodes weigh the same, which makes the tip heavier",
    }
    return frame, heights, about


def _vtk(points: np.ndarray, tets: np.ndarray) -> str:
    """The mesh in the old text format, the one that PyBullet reads."""
    lines = ["# vtk DataFile Version 2.0", "bar", "ASCII", "DATASET UNSTRUCTURED_GRID", f"POINTS {len(points)} double"]
    lines += [" ".join(f"{x:.9g}" for x in point) for point in points]
    lines += [f"CELLS {len(tets)} {5 * len(tets)}", *("4 " + " ".join(map(str, tet)) for tet in tets.tolist())]
    lines += [f"CELL_TYPES {len(tets)}", *["10"] * len(tets), ""]
    return "\n".join(lines)


common.main(build)
