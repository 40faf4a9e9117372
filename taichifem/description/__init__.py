"""What a person says: dataclasses with units and checks, no Taichi."""

from taichifem.description.colliders import BoxCollider, Collider, PlaneCollider, SphereCollider
from taichifem.description.fracture import Fracture
from taichifem.description.loads import Force, Load, Pressure, Traction
from taichifem.description.material import Material
from taichifem.description.motion import Motion
from taichifem.description.regions import BoxRegion, IndexRegion, NearestRegion, Region, SphereRegion
from taichifem.description.scene import Body, Handle, Pin, Scene
from taichifem.description.view import Camera, View

__all__ = [
    "Body",
    "BoxCollider",
    "BoxRegion",
    "Camera",
    "Collider",
    "Force",
    "Fracture",
    "Handle",
    "IndexRegion",
    "Load",
    "Material",
    "Motion",
    "NearestRegion",
    "Pin",
    "PlaneCollider",
    "Pressure",
    "Region",
    "Scene",
    "SphereCollider",
    "SphereRegion",
    "Traction",
    "View",
]
