"""Scene files: TOML read into the dataclasses of `taichifem.description`, and written back."""

from taichifem.scene import presets
from taichifem.scene.presets import preset
from taichifem.scene.reading import read_scene
from taichifem.scene.writing import write_scene

__all__ = ["preset", "presets", "read_scene", "write_scene"]
