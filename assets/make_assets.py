"""Make the solids in this folder: `python assets/make_assets.py` writes bear.vtu, octopus.vtu, vase.vtu and pig.ply
beside it.

Each solid is a formula, negative inside, blended from round parts; lengths are in metres, z points up, and the
creatures look towards -y.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
import trimesh
from scipy.interpolate import PchipInterpolator
from scipy.spatial import cKDTree

from taichifem.mesh import TetMesh, report


def ball(p: np.ndarray, centre, radius: float) -> np.ndarray:
    """Distance (n,) of points (n, 3) to a ball."""
    return np.linalg.norm(p - centre, axis=1) - radius


def egg(p: np.ndarray, centre, radii) -> np.ndarray:
    """About the distance (n,) of points to an ellipsoid with half axes along x, y and z."""
    return (np.linalg.norm((p - centre) / radii, axis=1) - 1) * min(radii)


def limb(p: np.ndarray, start, end, start_radius: float, end_radius: float) -> np.ndarray:
    """Distance (n,) of points to a rounded stick whose radius changes along it."""
    start, axis = np.asarray(start), np.subtract(end, start)
    share = np.clip((p - start) @ axis / (axis @ axis), 0, 1)
    return np.linalg.norm(p - start - share[:, None] * axis, axis=1) - (
        start_radius + share * (end_radius - start_radius)
    )


def blend(parts: list[np.ndarray], softness: float) -> np.ndarray:
    """Union of parts whose seams are rounded over a width of about `softness` [m]."""
    parts = np.array(parts)
    nearest = parts.min(axis=0)
    return nearest - softness * np.log(np.exp((nearest - parts) / softness).sum(axis=0))


def on_floor(p: np.ndarray, solid: np.ndarray) -> np.ndarray:
    """Cut a solid flat at z = 0, so that it stands."""
    return np.maximum(solid, -p[:, 2])


def bear(p: np.ndarray) -> np.ndarray:
    """A teddy bear that sits and holds out its arms."""
    parts = [
        egg(p, (0, 0.02, 0.23), (0.19, 0.165, 0.235)),  # belly
        egg(p, (0, -0.02, 0.585), (0.205, 0.17, 0.175)),  # head
        egg(p, (0, -0.185, 0.535), (0.095, 0.095, 0.075)),  # snout
        ball(p, (0, 0.19, 0.09), 0.065),  # tail
    ]
    for side in (-1, 1):
        parts += [
            egg(p, (side * 0.185, 0.0, 0.745), (0.095, 0.062, 0.095)),  # ear
            limb(p, (side * 0.15, -0.02, 0.37), (side * 0.33, -0.15, 0.29), 0.07, 0.075),  # arm
            limb(p, (side * 0.13, -0.06, 0.09), (side * 0.20, -0.30, 0.08), 0.09, 0.08),  # leg
            egg(p, (side * 0.21, -0.34, 0.115), (0.095, 0.07, 0.125)),  # foot
        ]
    return on_floor(p, blend(parts, 0.010))


def octopus(p: np.ndarray) -> np.ndarray:
    """An octopus on eight arms whose tips curl up."""
    parts = [
        egg(p, (0, 0.02, 0.50), (0.21, 0.21, 0.25)),  # mantle
        ball(p, (-0.10, -0.155, 0.42), 0.078),  # eyes
        ball(p, (0.10, -0.155, 0.42), 0.078),
    ]
    reach = np.array([0.06, 0.18, 0.29, 0.40, 0.49, 0.53, 0.50])
    height = np.array([0.31, 0.20, 0.09, 0.055, 0.08, 0.17, 0.25])
    radius = np.array([0.080, 0.072, 0.066, 0.062, 0.058, 0.054, 0.050])
    turn = np.array([0, 0, 0.02, 0.06, 0.12, 0.18, 0.24])
    for arm in range(8):
        angle = (arm + 0.5) * np.pi / 4 + turn
        joints = np.column_stack([reach * np.cos(angle), reach * np.sin(angle), height])
        parts += [limb(p, *joints[i : i + 2], *radius[i : i + 2]) for i in range(len(joints) - 1)]
    return on_floor(p, blend(parts, 0.010))


def vase(p: np.ndarray) -> np.ndarray:
    """A hollow vase with two handles: a curve turned about the z axis, and thickened."""
    radii = [0.0, 0.05, 0.095, 0.12, 0.16, 0.175, 0.145, 0.10, 0.088, 0.11, 0.137]
    heights = [0.028, 0.028, 0.03, 0.07, 0.155, 0.23, 0.325, 0.395, 0.445, 0.50, 0.53]
    from_axis = np.hypot(p[:, 0], p[:, 1])
    from_curve, _ = cKDTree(_smooth(radii, heights)).query(np.column_stack([from_axis, p[:, 2]]))
    parts = [from_curve - 0.028]
    grip = _smooth([0.09, 0.15, 0.215, 0.25, 0.24, 0.20, 0.15], [0.45, 0.478, 0.475, 0.42, 0.355, 0.305, 0.28])
    for side in (-1, 1):
        curve = np.column_stack([side * grip[:, 0], np.zeros(len(grip)), grip[:, 1]])
        parts.append(cKDTree(curve).query(p)[0] - 0.034)
    return on_floor(p, blend(parts, 0.004))


def pig(p: np.ndarray) -> np.ndarray:
    """A pig on four short legs, with a curled tail."""
    parts = [egg(p, (0, 0, 0.30), (0.19, 0.27, 0.185)), *_of_pig(p).values()]
    parts += [ball(p, (0, -0.25, 0.36), 0.145)]  # head
    for x in (-0.105, 0.105):
        for y in (-0.15, 0.15):
            parts.append(limb(p, (x, y, 0.22), (1.1 * x, 1.1 * y, 0.04), 0.075, 0.058))
    curl = np.linspace(0, 1.6 * np.pi, 12)
    joints = np.column_stack([0.045 * np.sin(curl), 0.25 + 0.03 * curl / np.pi, 0.375 + 0.045 * (1 - np.cos(curl))])
    parts += [limb(p, a, b, 0.02, 0.02) for a, b in pairwise(joints)]
    return on_floor(p, blend(parts, 0.012))


def _of_pig(p: np.ndarray) -> dict[str, np.ndarray]:
    """Parts of a pig that have a colour of their own."""
    ears = [limb(p, (0.085 * s, -0.235, 0.45), (0.135 * s, -0.285, 0.545), 0.052, 0.02) for s in (-1, 1)]
    return {"snout": egg(p, (0, -0.385, 0.335), (0.07, 0.05, 0.06)), "ears": np.minimum(*ears)}


def paint_pig(p: np.ndarray) -> np.ndarray:
    """sRGB (n, 3) in [0, 255] of points on its skin."""
    colors = np.tile([238, 150, 165], (len(p), 1))
    eyes = [ball(p, (0.062 * s, -0.372, 0.415), 0.024) for s in (-1, 1)]
    nostrils = [ball(p, (0.026 * s, -0.435, 0.338), 0.015) for s in (-1, 1)]
    for part, color in ((_of_pig(p)["snout"] - 0.006, (216, 106, 130)), (_of_pig(p)["ears"], (216, 106, 130))):
        colors[part < 0.006] = color
    colors[p[:, 2] < 0.035] = (110, 70, 65)  # hooves
    colors[np.minimum.reduce(eyes) < 0] = (25, 20, 25)
    colors[np.minimum.reduce(nostrils) < 0] = (110, 40, 60)
    return colors


def make_skin(formula, paint, spacing: float) -> trimesh.Trimesh:
    """The painted surface of a formula, as fine as `spacing` [m]."""
    mesh = TetMesh.from_implicit(formula, (-0.7, -0.7, -0.1), (0.7, 0.7, 0.95), spacing)
    nodes, triangles = np.unique(mesh.boundary(), return_inverse=True)
    points = mesh.points[nodes]
    return trimesh.Trimesh(points, triangles.reshape(-1, 3), vertex_colors=paint(points), process=False)


def _smooth(x: list[float], y: list[float]) -> np.ndarray:
    """A smooth curve (600, 2) through points of a plane."""
    knots = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return PchipInterpolator(knots, np.column_stack([x, y]))(np.linspace(0, knots[-1], 600))


SOLIDS = {bear: 0.056, octopus: 0.062, vase: 0.041}  # lattice spacing [m]


def make(formula) -> TetMesh:
    """Mesh a formula, its bounding box centred in x and y and its lowest point at z = 0."""
    mesh = TetMesh.from_implicit(formula, (-0.7, -0.7, -0.1), (0.7, 0.7, 0.95), SOLIDS[formula])
    low, high = mesh.bounds
    middle = (low + high) / 2
    return mesh.transformed(translation=(-middle[0], -middle[1], -low[2]))


if __name__ == "__main__":
    for formula in SOLIDS:
        mesh = make(formula)
        mesh.write(Path(__file__).parent / f"{formula.__name__}.vtu")
        print(f"{formula.__name__}\n{report(mesh)}\n")
    skin = make_skin(pig, paint_pig, 0.0265)
    skin.export(Path(__file__).parent / "pig.ply")
    print(f"pig: {len(skin.faces)} triangles")
