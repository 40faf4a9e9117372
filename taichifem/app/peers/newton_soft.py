"""Newton's soft body on the CPU: implicit steps by vertex block descent (vbd), or explicit ones (semi-implicit)."""

from __future__ import annotations

import importlib.metadata

import common
import newton
import numpy as np
import warp as wp

SUBSTEPS, ITERATIONS = 10, 10  # of vertex block descent, as in Newton's own examples


def build(task: common.Task):
    wp.config.quiet = True
    explicit = task.mode == "semi-implicit"
    mu, lam = task.smith_constants if explicit else task.lame
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, -task.gravity))
    builder.add_soft_mesh(
        pos=wp.vec3(0.0, 0.0, 0.0),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0, 0.0, 0.0),
        vertices=[wp.vec3(*point) for point in task.points],
        indices=task.tets.ravel().tolist(),
        density=task.density,
        k_mu=mu,
        k_lambda=lam,
        k_damp=0.0,
        particle_radius=1e-5,
        add_surface_mesh_edges=False,
    )
    for node in task.held.tolist():
        builder.particle_mass[node] = 0.0
        builder.particle_flags[node] &= ~int(newton.ParticleFlags.ACTIVE)
    if not explicit:
        builder.color()
    with wp.ScopedDevice("cpu"):
        model = builder.finalize(device="cpu")
        model.particle_grid = None  # no contact between particles
        if explicit:
            solver = newton.solvers.SolverSemiImplicit(model=model, enable_tri_contact=False)
        else:
            solver = newton.solvers.SolverVBD(
                model=model,
                iterations=ITERATIONS,
                particle_enable_self_contact=False,
                particle_enable_tile_solve=False,
            )
        states, control = [model.state(), model.state()], model.control()
    substeps = task.explicit_substeps if explicit else SUBSTEPS

    def frame() -> None:
        for _ in range(substeps):
            states[0].clear_forces()
            solver.step(*states, control, None, 1 / (common.FPS * substeps))
            states.reverse()

    def heights() -> np.ndarray:
        return states[0].particle_q.numpy()[task.tip, 2]

    about = {
        "version": importlib.metadata.version("newton"),
        "law": "neo-Hookean",
        "method": "explicit" if explicit else f"vertex block descent, {ITERATIONS} sweeps",
        "precision": "f32",
        "substeps": substeps,
    }
    return frame, heights, about


common.main(build)
