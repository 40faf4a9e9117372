"""How straight cracks run with each criterion: `python tests/crack_paths.py` prints the table.

Notched strips and bars on irregular meshes are pulled apart. The ideal crack is the plane from the notch on, so that
the area of the crack over that of the plane tells how rough it is, and what else came open.
"""

import numpy as np
import scipy.spatial
from convergence import box

import taichifem as tf
from taichifem.mesh.connectivity import boundary_faces

STRIP, BAR = (1.0, 0.5), (1.0, 0.25, 0.25)
NOTCH = 0.25
"""Part of the height that is cut beforehand."""


def strip(seed: int, *, cells: int = 24) -> tf.TriMesh:
    """A strip of irregular triangles with a notch from above."""
    rng, h, size = np.random.default_rng(seed), 1 / cells, np.array(STRIP)
    across, up = np.linspace(0, STRIP[0], cells + 1), np.linspace(0, STRIP[1], cells // 2 + 1)
    points = [(x, z) for x in across for z in (0, STRIP[1])] + [(x, z) for x in (0, STRIP[0]) for z in up[1:-1]]
    for point in rng.uniform(0.6 * h, size - 0.6 * h, size=(4000, 2)):
        if np.linalg.norm(np.array(points) - point, axis=1).min() > 0.75 * h:
            points.append(tuple(point))
    points = np.array(points)
    cells = scipy.spatial.Delaunay(points).simplices
    corners = np.pad(points[cells], ((0, 0), (0, 0), (0, 1)), constant_values=1)
    double_area = np.linalg.det(corners)
    cells[double_area < 0] = cells[double_area < 0][:, [0, 2, 1]]
    return _notched(tf.TriMesh, points, cells[abs(double_area) > 1e-6], STRIP, 0.6 * h)


def bar(seed: int, *, cells=(16, 4, 4)) -> tf.TetMesh:
    """A bar of cubes cut in tetrahedra, whose vertices are pushed about, with a notch from above."""
    mesh, size = tf.TetMesh.bar(size=BAR, cells=cells, split=6), np.array(BAR)
    inside = (mesh.points > 1e-9) & (mesh.points < size - 1e-9)
    pushed = np.random.default_rng(seed).uniform(-0.25, 0.25, mesh.points.shape) * size / cells
    return _notched(tf.TetMesh, mesh.points + inside * pushed, mesh.cells, BAR, 0.6 * size[0] / cells[0])


def _notched(kind, points, cells, size, half_width: float):
    middle = points[cells].mean(axis=1)
    keep = (abs(middle[:, 0] - size[0] / 2) > half_width) | (middle[:, -1] < (1 - NOTCH) * size[-1])
    used, cells = np.unique(cells[keep], return_inverse=True)
    return kind(points[used], cells.reshape(-1, points.shape[1] + 1))


def pulled(mesh, *, seed: int = 0, **fracture) -> tf.Simulation:
    """Its ends are drawn apart along x, and slide across freely."""
    draw = tf.Motion(times=(0, 10), translation=((0, 0, 0), (0.5, 0, 0)))
    pins = [
        tf.Pin(region=box(upper=(1e-6, 1e3, 1e3)), axes="x"),
        tf.Pin(region=box(lower=(1 - 1e-6, -1e3, -1e3)), axes="x", motion=draw),
        tf.Pin(region=tf.NearestRegion(point=(0, 0, 0)), axes="yz"[3 - mesh.dimension :]),
    ]
    if mesh.dimension == 3:
        pins += [tf.Pin(region=tf.NearestRegion(point=(0, BAR[1], 0)), axes="z")]
    breaks = tf.Fracture(toughness=1e5, **fracture)
    material = tf.Material(youngs=1e6, poisson=0.3, mass_damping=20.0, stiffness_damping=0.01, fracture=breaks)
    body = tf.Body(mesh=mesh, material=material, pins=pins)
    return tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0), seed=seed))


def broken(simulation: tf.Simulation) -> float:
    """Run until half a second after the first split; mean pull on the ends at that split [Pa]."""
    load = begin = None
    while simulation.time < (begin + 0.5 if begin else 8.0):
        pull = simulation.cauchy_stress()[:, 0, 0].mean() if begin is None else None
        simulation.step()
        if simulation.splits and begin is None:
            load, begin = pull, simulation.time
    return load


def roughness(simulation: tf.Simulation) -> tuple[float, float]:
    """Area of the crack over that of the plane, and the mean |n . x| of its normals."""
    faces, _ = boundary_faces(simulation.cells)
    whole, _ = boundary_faces(simulation.scene.bodies[0].mesh.cells)
    before = {tuple(sorted(face)) for face in whole.tolist()}
    new = [tuple(sorted(face)) not in before for face in simulation.origins[faces].tolist()]
    corners = simulation.rest_positions[faces[new]]
    normal = corners[:, 1] - corners[:, 0]
    if simulation.dimension == 2:
        normal = np.cross(normal, (0, 1, 0))
    else:
        normal = np.cross(normal, corners[:, 2] - corners[:, 0]) / 2
    area = np.linalg.norm(normal, axis=1)
    ideal = (1 - NOTCH) * (STRIP[1] if simulation.dimension == 2 else BAR[1] * BAR[2])
    return area.sum() / 2 / ideal, abs(normal[:, 0]).sum() / area.sum()


def main(seeds: int = 8) -> None:
    print(f"{'':32}  crack area  |n . x|  pieces  load [kPa]   (means of {seeds})")
    for name, make in (("strip", strip), ("bar", bar)):
        for fracture in (
            dict(),
            dict(smoothing=1),
            dict(smoothing=2),
            dict(criterion="separation-tensor"),
        ):
            rows = []
            for seed in range(seeds):
                simulation = pulled(make(seed), seed=seed, **fracture)
                load = broken(simulation)
                rows.append((*roughness(simulation), simulation.piece_count, load / 1e3))
            label = f"{name}, {fracture.get('criterion', 'principal-stress')}, {fracture.get('smoothing', 0)}"
            area, along, pieces, load = np.mean(rows, axis=0)
            print(f"{label:32}  {area:10.2f}  {along:7.2f}  {pieces:6.1f}  {load:10.1f}", flush=True)


if __name__ == "__main__":
    main()
