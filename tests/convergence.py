"""Classical benchmarks under refinement: `python tests/convergence.py` prints the tables.

All refinements of a benchmark are bodies of one scene: they are solved at once, and kernels compile once. Every
function takes the refinements and gives one value for each.
"""

import time

import numpy as np

import taichifem as tf
from taichifem.statics import solve_static, static_scene

COOK, LE10 = 23.97, -5.38e6
"""Published values: deflection of Cook's membrane, and stress [Pa] at point D of NAFEMS LE10."""


def box(lower=(-1e3, -1e3, -1e3), upper=(1e3, 1e3, 1e3)) -> tf.BoxRegion:
    """What lies between the corners, from end to end of the world where they are left out."""
    return tf.BoxRegion(lower=lower, upper=upper)


def solve(bodies: list[tf.Body], *, tolerance: float = 1e-9, **scene) -> tf.Simulation:
    """The balance of the bodies, each on its own."""
    simulation = tf.Simulation(static_scene(tf.Scene(bodies=bodies, gravity=(0, 0, 0), **scene)), precision="f64")
    assert solve_static(simulation, tolerance=tolerance).converged
    return simulation


def displacements(simulation: tf.Simulation) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rest positions and displacements of each body."""
    rest, moved = simulation.rest_positions, simulation.positions - simulation.rest_positions
    which = [simulation.node_bodies == b for b in range(len(simulation.scene.bodies))]
    return [(rest[k], moved[k]) for k in which]


def cook_membrane(sizes) -> list[float]:
    """Cook's membrane in the plane, n x n cells of two triangles: uz at (48, 52). Plane stress with E = 1, nu = 1/3,
    by the moduli that give it in plane strain."""
    E, nu = 1.0, 1 / 3
    material = tf.Material(model="linear", youngs=E * (1 + 2 * nu) / (1 + nu) ** 2, poisson=nu / (1 + nu))
    edge = tf.Traction(region=box((48 - 1e-6, -1e3, -1e3)), traction=(0, 0, 1 / 16))
    held = box(upper=(1e-6, 1e3, 1e3))
    panel = [(0, 0), (48, 44), (48, 60), (0, 44)]
    bodies = [
        tf.Body(mesh=tf.TriMesh.quadrilateral(panel, cells=(n, n)), material=material, pins=[held], tractions=[edge])
        for n in sizes
    ]
    results = displacements(solve(bodies))
    return [float(u[np.linalg.norm(x - (48, 0, 52), axis=1) < 1e-6, 2].item()) for x, u in results]


def cook_slab(sizes) -> list[float]:
    """The same panel as a slab of thickness 1, n x n x nz cells of six tetrahedra: mean uy at x = 48, y = 52."""
    material = tf.Material(model="linear", youngs=1.0, poisson=1 / 3)
    edge = tf.Traction(region=box((48 - 1e-6, -1e3, -1e3)), traction=(0, 1 / 16, 0))
    held = box(upper=(1e-6, 1e3, 1e3))
    bodies = []
    for n, nz in sizes:
        grid = tf.TetMesh.bar(size=(1, 1, 1), cells=(n, n, nz), split=6)
        x, y, z = grid.points.T
        mesh = tf.TetMesh(np.column_stack([48 * x, 44 * x + y * (44 - 28 * x), z]), grid.cells)
        bodies.append(tf.Body(mesh=mesh, material=material, pins=[held], tractions=[edge]))
    results = displacements(solve(bodies))
    return [float(u[np.linalg.norm(x[:, :2] - (48, 52), axis=1) < 1e-6, 1].mean()) for x, u in results]


def thick_plate(sizes) -> list[float]:
    """NAFEMS LE10: sigma_yy [Pa] at D of the elliptic plate under pressure, grids of radial, angular and through cells.

    A plane is fitted to the stresses of the elements around the nodes of D's elements, and read at D: their mean
    would be the stress half an element away.
    """
    material = tf.Material(model="linear", youngs=2.1e11, poisson=0.3, density=7850)
    bodies = []
    for radial, angular, through in sizes:
        grid = tf.TetMesh.bar(size=(1, 1, 1), cells=(radial, angular, through), split=6)
        r, t, z = grid.points.T
        r, t = r**1.5, t**1.5
        a, c, turn = 2 + 1.25 * r, 1 + 1.75 * r, t * np.pi / 2
        mesh = tf.TetMesh(np.column_stack([a * np.cos(turn), c * np.sin(turn), 0.6 * z]), grid.cells)

        def where(chosen):
            return tf.IndexRegion(indices=np.flatnonzero(chosen).tolist())

        pins = [
            tf.Pin(region=where(t == 0), axes="y"),
            tf.Pin(region=where(t == 1), axes="x"),
            tf.Pin(region=where(r == 1), axes="xy"),
            tf.Pin(region=where((r == 1) & (abs(z - 0.5) < 1e-9)), axes="z"),
        ]
        top = tf.Pressure(region=where(z == 1), pressure=1e6)
        bodies.append(tf.Body(mesh=mesh, material=material, pins=pins, pressures=[top]))
    simulation = solve(bodies)
    stress = simulation.cauchy_stress()[:, 1, 1]
    return [_stress_at_d(simulation, b, stress) for b in range(len(bodies))]


def _stress_at_d(simulation: tf.Simulation, body: int, stress: np.ndarray) -> float:
    mine = np.flatnonzero(simulation.cell_bodies == body)
    cells, rest = simulation.cells[mine], simulation.rest_positions
    corner = np.unique(cells)[np.linalg.norm(rest[np.unique(cells)] - (2, 0, 0.6), axis=1) < 1e-9]
    first = np.unique(cells[np.isin(cells, corner).any(axis=1)])
    near = np.isin(cells, first).any(axis=1)
    arms = rest[cells[near]].mean(axis=1) - (2, 0, 0.6)
    terms = np.column_stack([np.ones(len(arms)), arms])
    return float(np.linalg.lstsq(terms, stress[mine[near]], rcond=None)[0][0])


def thick_sphere(sizes, *, E: float, nu: float, a: float, b: float, p: float) -> list[float]:
    """An eighth of a hollow sphere under internal pressure, n cells along each edge: mean radial displacement at a."""
    material = tf.Material(model="linear", youngs=E, poisson=nu)
    pins = [tf.Pin(region=box(upper=(1e-9, 1e3, 1e3)), axes="x")]
    pins += [tf.Pin(region=box(upper=(1e3, 1e-9, 1e3)), axes="y"), tf.Pin(region=box(upper=(1e3, 1e3, 1e-9)), axes="z")]
    inside = tf.Pressure(region=tf.SphereRegion(center=(0, 0, 0), radius=1.0001 * a), pressure=p)
    bodies = []
    for n in sizes:
        # Half of a cut cube: a triangle in x and y, which is blown up to the octant, times the way out.
        grid = tf.TetMesh.bar(size=(1, 1, 1), cells=(n, n, n), split=6)
        centre = grid.points[grid.cells].mean(axis=1)
        x, y, z = grid.points.T
        out = np.column_stack([1 - x, np.maximum(x - y, 0), y])
        out /= np.linalg.norm(out, axis=1)[:, None]
        points = out * (a + (b - a) * z)[:, None]
        mesh = tf.TetMesh(points, grid.cells[centre[:, 0] > centre[:, 1]])
        bodies.append(tf.Body(mesh=mesh, material=material, pins=pins, pressures=[inside]))
    results = displacements(solve(bodies))
    return [float((u * x).sum(axis=1)[np.linalg.norm(x, axis=1) < 1.0001 * a].mean() / a) for x, u in results]


def thick_ring(sizes, *, E: float, nu: float, a: float, b: float, p: float) -> list[float]:
    """A ring in plane strain under internal pressure, n layers: mean radial displacement at a."""
    material = tf.Material(model="linear", youngs=E, poisson=nu)
    pins = [tf.Pin(region=tf.NearestRegion(point=(s * a, 0, 0)), axes="z") for s in (-1, 1)]
    pins += [tf.Pin(region=tf.NearestRegion(point=(0, 0, s * a)), axes="x") for s in (-1, 1)]
    inside = tf.Pressure(region=tf.SphereRegion(center=(0, 0, 0), radius=1.0001 * a), pressure=p)
    bodies = [
        tf.Body(mesh=tf.TriMesh.ring(a, b, n), material=material, pins=pins, pressures=[inside], thickness=0.1)
        for n in sizes
    ]
    results = displacements(solve(bodies))
    return [float((u * x).sum(axis=1)[np.linalg.norm(x, axis=1) < 1.0001 * a].mean() / a) for x, u in results]


def cantilever(sizes, *, E: float, nu: float, L: float, h: float, force: float) -> list[float]:
    """A slender beam of n x n cubes across under a tip force, 10 n along: mean deflection of its end."""
    material = tf.Material(model="linear", youngs=E, poisson=nu)
    end = box(lower=(L - 1e-9, -1e3, -1e3))
    tip = tf.Traction(region=end, traction=(0, 0, -force / h**2))
    held = box(upper=(1e-9, 1e3, 1e3))
    bodies = [
        tf.Body(mesh=tf.TetMesh.bar((L, h, h), (10 * n, n, n)), material=material, pins=[held], tractions=[tip])
        for n in sizes
    ]
    return [float(-u[x[:, 0] > L - 1e-9, 2].mean()) for x, u in displacements(solve(bodies))]


def elastica(sizes, *, alpha: float) -> list[tuple[float, float]]:
    """A strip 20 times as long as thick under a dead tip force alpha E I / L^2, n triangles' layers: its tip."""
    E, L, h = 1e6, 1.0, 0.05
    material = tf.Material(model="stvk", youngs=E, poisson=0.0)
    force = alpha * E * h**3 / 12 / L**2
    tip = tf.Traction(region=box(lower=(L - 1e-9, -1e3, -1e3)), traction=(0, 0, -force / h))
    held = box(upper=(1e-9, 1e3, 1e3))
    bodies = [
        tf.Body(mesh=tf.TriMesh.rectangle((L, h), (20 * n, n)), material=material, pins=[held], tractions=[tip])
        for n in sizes
    ]
    results = displacements(solve(bodies))
    return [tuple((x + u)[x[:, 0] > L - 1e-9].mean(axis=0)[[0, 2]] - (0, h / 2)) for x, u in results]


def print_table(title: str, sizes, values, published: float) -> None:
    """One line for each refinement."""
    print(f"\n{title}\n{'refinement':>14} {'value':>12} {'published':>12} {'error':>8}")
    for size, value in zip(sizes, values, strict=True):
        name = " x ".join(map(str, np.atleast_1d(size)))
        print(f"{name:>14} {value:12.5g} {published:12.5g} {100 * (value / published - 1):7.2f}%")


BENCHMARKS = (
    ("Cook's membrane, triangles: deflection", cook_membrane, COOK, (4, 8, 16, 32, 64)),
    ("Cook's membrane, slab of tetrahedra: deflection", cook_slab, COOK, ((4, 1), (8, 1), (16, 1), (32, 1), (64, 2))),
    ("NAFEMS LE10: sigma_yy at D [Pa]", thick_plate, LE10, ((4, 7, 2), (8, 14, 4), (16, 28, 8), (24, 42, 12))),
)


def main() -> None:
    """Print all tables."""
    for title, benchmark, published, sizes in BENCHMARKS:
        start = time.perf_counter()
        print_table(title, sizes, benchmark(sizes), published)
        print(f"{time.perf_counter() - start:.1f} s")


if __name__ == "__main__":
    main()
