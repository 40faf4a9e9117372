"""Taichi's own example `implicit_fem`, as it is installed: its kernels on our bar, without its window.

Only what it sets as constants is changed, and after each force and each product one kernel more zeroes the held
nodes, which the example does not know.
"""

import importlib.metadata
import sys
from pathlib import Path

import common
import numpy as np
import taichi as ti


def build(task: common.Task):
    example = _load(task)
    upright = task.points[:, [0, 2, 1]].astype(np.float32)  # its gravity is along -y
    example.F_vertices.from_numpy(task.tets[:, [0, 2, 1, 3]].astype(np.int32))
    example.F_ox.from_numpy(upright)
    example.init()
    held = ti.field(ti.i32, shape=len(task.held))
    held.from_numpy(task.held.astype(np.int32))

    @ti.kernel
    def hold(values: ti.template()):
        for i in held:
            values[held[i]] = ti.Vector([0.0, 0.0, 0.0])

    force, product = example.get_force, example.matmul_cell

    def get_force() -> None:
        force()
        hold(example.F_f)

    def matmul_cell(result, vector) -> None:
        product(result, vector)
        hold(result)

    example.get_force, example.matmul_cell = get_force, matmul_cell
    example.floor_bound = lambda: None  # there is no floor below this bar

    def frame() -> None:
        example.substep()
        ti.sync()

    about = {
        "version": importlib.metadata.version("taichi"),
        "law": "2 mu (F - R)",
        "method": "implicit, at most 50 CG iterations, stiffness of the shape at rest",
        "precision": "f32",
        "substeps": 1,
        "differs": "lambda = 0, that is Poisson's ratio 0",
    }
    return frame, lambda: example.F_x.to_numpy()[task.tip, 1], about


def _load(task: common.Task):
    """The example as a module, for a bar instead of its cube."""
    threads = f", cpu_max_num_threads={task.threads}" if task.threads else ""
    changes = {
        "ti.init(arch=ti.cuda)": f"ti.init(arch=ti.cpu, log_level=ti.ERROR, offline_cache=False{threads})",
        "E, nu = 5e4, 0.0": f"E, nu = {task.youngs!r}, 0.0",
        "dt = 1e-2": f"dt = {1 / common.FPS!r}",
        "9.8 * F_m": f"{task.gravity!r} * F_m",
        "n_verts = np.prod(n_cube)": f"n_verts = {len(task.points)}",
        "n_cells = 5 * np.prod(n_cube - 1)": f"n_cells = {len(task.tets)}",
        "n_cells = (n_cube - 1).prod() * 5": f"n_cells = {len(task.tets)}",
    }
    text = (Path(ti.__file__).parent / "examples/simulation/implicit_fem.py").read_text(encoding="utf-8")
    for old, new in changes.items():
        if old not in text:
            raise SystemExit(f"the example of Taichi {importlib.metadata.version('taichi')} has no line `{old}`")
        text = text.replace(old, new)
    Path("bar_example.py").write_text(text, encoding="utf-8")  # kernels are compiled from a file
    sys.path.insert(0, "")
    sys.argv = ["bar_example", "--exp", "implicit", "--gui", "cpu"]
    import bar_example

    return bar_example


common.main(build)
