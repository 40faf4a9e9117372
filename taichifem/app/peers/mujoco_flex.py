"""MuJoCo's flexible solid, stepped by the integrator that treats its elasticity implicitly."""

from __future__ import annotations

import importlib.metadata

import common
import mujoco
import numpy as np

SCENE = """<mujoco>
  <option timestep="{dt}" integrator="discrete" gravity="0 0 {down}"/>
  <size memory="{mib}M"/>
  <worldbody>
    <flexcomp name="bar" type="direct" dim="3" dof="full" mass="{mass}" radius="0.001"
              point="{points}" element="{tets}">
      <elasticity young="{young}" poisson="{poisson}"/>
      <contact selfcollide="none" contype="0" conaffinity="0"/>
      <pin id="{held}"/>
    </flexcomp>
  </worldbody>
</mujoco>"""


def listed(array: np.ndarray) -> str:
    return " ".join(map(str, array.ravel().tolist()))


def build(task: common.Task):
    scene = SCENE.format(
        dt=1 / common.FPS,
        down=-task.gravity,
        mib=512 + len(task.tets) // 25,
        mass=task.masses.sum(),
        points=listed(task.points),
        tets=listed(task.tets),
        young=task.youngs,
        poisson=task.poisson,
        held=listed(task.held),
    )
    model = mujoco.MjModel.from_xml_string(scene)
    _share_mass(model, task.masses)
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    mujoco.mj_forward(model, data)
    about = {
        "version": importlib.metadata.version("mujoco"),
        "law": "St. Venant-Kirchhoff",
        "method": "implicit (discrete)",
        "precision": "f64",
        "substeps": 1,
    }

    def heights() -> np.ndarray:
        mujoco.mj_kinematics(model, data)  # a step leaves the vertices where they were before it
        mujoco.mj_flex(model, data)
        return data.flexvert_xpos[task.tip, 2]

    return lambda: mujoco.mj_step(model, data), heights, about


def _share_mass(model, masses: np.ndarray) -> None:
    """Give each vertex the mass around it: by itself, MuJoCo gives all of them the same."""
    bodies = np.array(model.flex_vertbodyid)
    free = bodies > 0  # held ones belong to the world
    ratio = masses[free] / model.body_mass[bodies[free]]
    model.body_mass[bodies[free]] *= ratio
    model.body_inertia[bodies[free]] *= ratio[:, None]


common.main(build)
