"""Genesis' FEM entity on the CPU, stepped by its implicit solver."""

from __future__ import annotations

import importlib.metadata
import os

import common
import genesis as gs
import genesis.utils.element as elements
import numpy as np
import torch

HEIGHT = 5.0  # [m] the bar hangs there, clear of the domain's floor


def build(task: common.Task):
    if task.threads:
        os.environ["QD_NUM_THREADS"] = str(task.threads)  # its kernels
        torch.set_num_threads(task.threads)
    gs.init(backend=gs.cpu, precision="32", logging_level="error")
    # Genesis meshes its own shapes with TetGen and then splits tetrahedra at the surface: it gets our mesh instead.
    points = np.add(task.points, (0, 0, HEIGHT), dtype=gs.np_float)
    elements.mesh_to_elements = lambda *_, **__: (points, task.tets.astype("int32"))
    elements.split_all_surface_tets = lambda points, tets: (points, tets)
    scene = gs.Scene(
        sim_options=gs.options.SimOptions(dt=1 / common.FPS, substeps=1, gravity=(0, 0, -task.gravity)),
        fem_options=gs.options.FEMOptions(
            use_implicit_solver=True,
            enable_vertex_constraints=True,
            n_newton_iterations=1,
            n_pcg_iterations=500,
            pcg_threshold=1e-6,
            damping=0.0,
            damping_alpha=0.0,
            damping_beta=0.0,
        ),
        show_viewer=False,
    )
    bar = scene.add_entity(
        morph=gs.morphs.Box(size=(1.0, 0.25, 0.25), pos=(0.5, 0.125, HEIGHT + 0.125)),
        material=gs.materials.FEM.Elastic(E=task.youngs, nu=task.poisson, rho=task.density, model="linear_corotated"),
    )
    scene.build(n_envs=0)
    bar.set_vertex_constraints(task.held.astype("int32"))
    about = {
        "version": importlib.metadata.version("genesis-world"),
        "law": "corotational",
        "method": "implicit, one Newton step, PCG to 1e-6",
        "precision": "f32",
        "substeps": 1,
    }
    return scene.step, lambda: bar.get_state().pos.reshape(-1, 3)[task.tip, 2].cpu().numpy(), about


common.main(build)
