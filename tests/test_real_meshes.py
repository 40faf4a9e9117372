"""Every real tetrahedral mesh runs for 60 frames: hung by its top over the ground."""

import numpy as np
import pytest

import taichifem as tf
from taichifem import InputError

FILES = [
    "beam3_tet.veg",
    "beam3_tet.msh",
    "beam3_tet.vtk",
    "polyfem_bar-186.msh",
    "polyfem_bar-651.msh",
    "polyfem_bar-14114.msh",
    "polyfem_sphere1K.msh",
    "polyfem_sphere_coarse.msh",
    "polyfem_mat20x20.msh",
    "polyfem_cube-denser.msh",
    "bullet_torus.vtk",
    "bullet_bread.vtk",
    "bullet_tube.vtk",
    "sfepy_elbow.mesh",
    "sfepy_cube_medium_tetra.mesh",
    "sfepy_cylinder_in_box.mesh",
    "sfepy_wheelset.vtk",
    "uipc_ball.msh",
    "uipc_cube.msh",
    "femfx_duck.node",
    "femfx_car-body.ele",
    "femfx_materialblock.node",
    "mujoco_cube_22_ascii.msh",
    "mujoco_cube_22_binary.msh",
    "mujoco_cube_41_ascii.msh",
]
QUICK = {"uipc_cube.msh", "femfx_duck.node", "beam3_tet.veg", "polyfem_sphere_coarse.msh", "bullet_bread.vtk"}


def run(mesh: tf.TetMesh) -> None:
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    size = high - low
    top = tf.BoxRegion(lower=tuple(low - size), upper=tuple(low + size * (0.05, 2, 2)))
    body = tf.Body(mesh=mesh, material=tf.Material(youngs=1e6), pins=[top])
    ground = tf.PlaneCollider(point=(0, 0, float(low[2] - 0.3 * size.max())))
    simulation = tf.Simulation(tf.Scene(bodies=[body], colliders=[ground]))
    for _ in range(60):
        simulation.step()
    assert np.isfinite(simulation.positions).all()
    assert np.abs(simulation.positions - mesh.points).max() < 10 * size.max()


@pytest.mark.parametrize("name", [pytest.param(f, marks=() if f in QUICK else pytest.mark.slow) for f in FILES])
def test_real_mesh_runs(meshes, name):
    run(tf.TetMesh.from_file(meshes / name))


@pytest.mark.slow
def test_a_surface_is_tetrahedralised_and_runs(meshes, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    pytest.importorskip("pytetwild", reason="the extra taichifem[tetrahedralize] is not installed")
    run(tf.TetMesh.from_file(meshes / "spot.obj", tets=4000))


def test_hexahedra_are_refused_by_name(meshes):
    with pytest.raises(InputError, match=r"beam3_cubic\.veg.*hexahedr"):
        tf.TetMesh.from_file(meshes / "beam3_cubic.veg")
