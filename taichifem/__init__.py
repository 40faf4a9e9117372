"""taichifem: elasto-plastic, breaking solids in real time, with finite elements in Taichi.

Names load when they are first used, so that `import taichifem` and `taichifem --help` stay quick.
"""

from __future__ import annotations

import importlib

__version__ = "0.1.0"

_HOME = {
    "taichifem.description": (
        "Body BoxCollider BoxRegion Camera Force Fracture Handle IndexRegion Material Motion NearestRegion Pin "
        "PlaneCollider Pressure Scene SphereCollider SphereRegion Traction View"
    ),
    "taichifem.errors": "Diverged InputError",
    "taichifem.mesh": "EmbeddedSurface TetMesh TriMesh",
    "taichifem.scene": "preset",
    "taichifem.factory": "simulate",
    "taichifem.simulation": "Simulation",
}
_MODULE = {name: module for module, names in _HOME.items() for name in names.split()}
__all__ = sorted(_MODULE)


def __getattr__(name: str) -> object:
    if name not in _MODULE:
        raise AttributeError(f"module 'taichifem' has no attribute {name!r}")
    return getattr(importlib.import_module(_MODULE[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
