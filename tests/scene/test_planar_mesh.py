"""Mesh tables of scene files that mean plane meshes."""

from dataclasses import dataclass

import numpy as np
import pytest

from taichifem.mesh import Mesh, TetMesh, TriMesh
from taichifem.scene.building import _Builder
from taichifem.scene.errors import KeyProblem


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A body of either kind."""

    mesh: Mesh


@dataclass(frozen=True, kw_only=True)
class Solid:
    """A body of tetrahedra, as far as its hint goes."""

    mesh: TetMesh


@pytest.fixture
def build(tmp_path):
    """Build the mesh of a table, by the hint of one of the classes."""
    return lambda raw, cls=Sheet: _Builder(tmp_path).table(cls, {"mesh": raw}, "body.0").mesh


@pytest.mark.parametrize("cls", [Sheet, Solid])
def test_a_shape_of_the_plane_makes_a_plane_mesh(build, cls):
    sheet = build({"shape": "rectangle", "size": [1.0, 0.5], "cells": [40, 30]}, cls)
    assert isinstance(sheet, TriMesh) and len(sheet.points) == 41 * 31 and sheet.area == pytest.approx(0.5)
    assert isinstance(build({"shape": "bar", "cells": [1, 1, 1]}, cls), TetMesh)


def test_a_list_of_corners(build):
    assert build({"shape": "quadrilateral", "corners": [[0, 0], [48, 44], [48, 60], [0, 44]]}).area == pytest.approx(
        1440
    )


def test_a_planar_file_is_looked_for_beside_the_scene(build, tmp_path):
    ring = TriMesh.ring()
    ring.write(tmp_path / "ring.vtu")
    read = build({"file": "ring.vtu", "planar": True})
    assert isinstance(read, TriMesh) and np.array_equal(read.points, ring.points)
    assert isinstance(build({"file": "asset:vase", "planar": False}), TetMesh)


@pytest.mark.parametrize("planar", [{}, {"planar": False}])
def test_without_planar_a_surface_is_to_be_filled(build, tmp_path, planar):
    TriMesh.disk().write(tmp_path / "disk.obj")
    with pytest.raises(KeyProblem, match=r"body\.0\.mesh: .*disk\.obj: the surface is not closed"):
        build({"file": "disk.obj", **planar})


@pytest.mark.parametrize(
    ("raw", "path", "message"),
    [
        ({"shape": "rectangle", "size": [1.0, 0]}, "body.0.mesh.size", r"body\.0\.mesh\.size\[1\] must be a positive"),
        ({"shape": "rectangle", "pattern": 3}, "body.0.mesh.pattern", r"body\.0\.mesh\.pattern must be one of"),
        ({"shape": "rectangle", "planar": True}, "body.0.mesh.planar", "unknown key 'planar'"),
        ({"shape": "disc"}, "body.0.mesh.shape", "'disk'"),
        ({"shape": "quadrilateral"}, "body.0.mesh", r"body\.0\.mesh: corners is missing"),
        ({"file": "a.msh", "planar": 1}, "body.0.mesh.planar", r"body\.0\.mesh\.planar must be true or false"),
        (
            {"file": "a.obj", "planar": True, "tets": 9},
            "body.0.mesh.tets",
            "unknown key 'tets': known are file, planar",
        ),
        ({"file": "a.obj", "planer": True}, "body.0.mesh.planer", "did you mean 'planar'?"),
        ({"file": "none.msh", "planar": True}, "body.0.mesh", r"body\.0\.mesh: .*none\.msh: there is no such file"),
        ({"file": "asset:bear", "planar": True}, "body.0.mesh", "asset:bear: holds tetrahedra"),
    ],
)
def test_wrong_tables_are_refused_at_their_key(build, raw, path, message):
    with pytest.raises(KeyProblem, match=message) as caught:
        build(raw)
    assert caught.value.path == path and "\n" not in str(caught.value)
