"""The measures of a mesh as text, for people."""

import numpy as np

from taichifem.mesh.kinds import Mesh
from taichifem.mesh.quality import Quality, quality
from taichifem.mesh.tri_quality import TriQuality


def report(mesh: Mesh) -> str:
    """The measures of a mesh as text of several lines."""
    q = quality(mesh)
    angle = "angle" if isinstance(q, TriQuality) else "dihedral angle"
    lines = [
        *(_triangle_counts(q) if isinstance(q, TriQuality) else _tetrahedron_counts(q)),
        (f"smallest {angle}", f"{q.smallest_angle:.1f} deg worst, {q.mean_smallest_angle:.1f} mean"),
        (f"largest {angle}", f"{q.largest_angle:.1f} deg worst, {q.mean_largest_angle:.1f} mean"),
        ("radius ratio", f"{q.worst_radius_ratio:.3f} worst, {q.mean_radius_ratio:.3f} mean (1 is regular)"),
    ]
    labels, counts = np.unique(mesh.regions, return_counts=True)
    if len(labels) > 1:
        shown = [f"{label} ({count:,})" for label, count in zip(labels[:8], counts, strict=False)]
        lines.append(("regions", ", ".join(shown) + (", ..." if len(labels) > 8 else "")))
    repairs = {
        "elements flipped": q.repairs.flipped,
        "unused points dropped": q.repairs.orphans,
        "coincident points left": q.repairs.duplicates,
    }
    noticed = ", ".join(f"{count:,} {what}" for what, count in repairs.items() if count)
    lines.append(("put right", noticed or "nothing"))
    width = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:<{width}}  {value}" for name, value in lines)


def _tetrahedron_counts(q: Quality) -> list[tuple[str, str]]:
    return [
        ("points", f"{q.points:,}"),
        ("tetrahedra", f"{q.tets:,}"),
        ("surface triangles", f"{q.triangles:,}"),
        ("pieces", f"{q.pieces}"),
        ("size", " x ".join(f"{length:.4g}" for length in q.size) + " m"),
        ("volume", f"{q.volume:.6g} m^3"),
    ]


def _triangle_counts(q: TriQuality) -> list[tuple[str, str]]:
    return [
        ("points", f"{q.points:,}"),
        ("triangles", f"{q.triangles:,}"),
        ("boundary", f"{q.boundary_edges:,} edges in {q.loops} closed line{'s' if q.loops != 1 else ''}"),
        ("pieces", f"{q.pieces}"),
        ("size", " x ".join(f"{length:.4g}" for length in q.size) + " m"),
        ("area", f"{q.area:.6g} m^2"),
    ]
