"""What reduced bodies cannot be part of, and what to use instead."""

from __future__ import annotations

from taichifem.description import Scene
from taichifem.errors import InputError

ADJUSTABLE = {
    "modal": ("youngs", "mass_damping", "stiffness_damping"),
    "condensed": ("youngs", "mass_damping", "stiffness_damping"),
    "bem": ("youngs",),
}
"""What of a material each model can take anew without being made again."""


def adjustable(scene: Scene, body: int) -> tuple[str, ...]:
    """The parameters of a reduced body's material that can change while it runs."""
    said = scene.bodies[body]
    if said.materials:
        return ()
    still = scene.integrator == "quasi-static"
    return tuple(name for name in ADJUSTABLE[said.material.model] if name == "youngs" or not still)


def check_reduced(scene: Scene) -> None:
    """Raise InputError for what reduced bodies cannot be part of."""
    for b, body in enumerate(scene.bodies):
        label = f"body.{body.name or b}"
        materials = (body.material, *body.materials.values())
        models, full = {m.model for m in materials}, [m.model for m in materials if not m.reduced]
        if full:
            raise InputError(
                f"{label}: model {full[0]!r} cannot share a scene with reduced ones: "
                'use one kind, model = "linear" for example'
            )
        if len(models) > 1:
            raise InputError(f"{label}: models {', '.join(sorted(models))} in one body: give all its regions the same")
        if body.mesh.dimension == 2:
            raise InputError(f'{label}: reduced models are for solids of tetrahedra: use model = "linear" in the plane')
        damping = {(m.mass_damping, m.stiffness_damping) for m in materials}
        if len(damping) > 1:
            raise InputError(f"{label}: its regions are damped differently: give all the same damping")
        _check_integrator(label, body.material.model, scene.integrator)
        if body.material.model == "bem" and len({(m.youngs, m.poisson, m.density) for m in materials}) > 1:
            raise InputError(f'{label}: boundary elements are for one material: use model = "condensed" for several')


def _check_integrator(label: str, model: str, integrator: str) -> None:
    if model == "modal" and integrator == "quasi-static":
        raise InputError(
            f'{label}: model "modal" swings, and integrator "quasi-static" has no inertia: use model = "condensed"'
        )
    if model == "bem" and integrator != "quasi-static":
        raise InputError(
            f'{label}: model "bem" has no inertia, and integrator {integrator!r} has: use integrator = "quasi-static", '
            'or model = "condensed"'
        )
    if model == "condensed" and integrator not in ("backward-euler", "quasi-static"):
        raise InputError(
            f'{label}: model "condensed" knows integrators "backward-euler" and "quasi-static", not {integrator!r}: '
            "use one of them"
        )
