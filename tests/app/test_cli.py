"""Help, listings, meshes and info."""

import subprocess
import sys

import pytest
from calling import call, environment

from taichifem import __version__
from taichifem.app import demos, info, options


@pytest.mark.parametrize("command", [[], ["run"], ["demo"], ["mesh"], ["info"], ["bench"]])
def test_every_command_has_help(command):
    result = call(*command, "--help")
    assert result.exit_code == 0
    assert result.output.startswith("Usage: taichifem")


def test_without_a_command_there_is_help():
    assert call().output == call("--help").output


def test_version():
    assert call("-V").output == call("--version").output == f"taichifem {__version__}\n"


def test_light_commands_do_not_import_taichi(tiny):
    script = (
        "import sys\nfrom taichifem.app.cli import cli\n"
        "for arguments in (['--help'], ['run', '--help'], ['demo'], ['mesh', 'asset:bear']):\n"
        "    try:\n        cli.main(arguments, prog_name='taichifem')\n"
        "    except SystemExit as end:\n        assert not end.code, arguments\n"
        "    assert 'taichi' not in sys.modules, arguments\n"
        "    assert arguments[0] == 'mesh' or 'meshio' not in sys.modules, arguments\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment())
    assert done.returncode == 0, done.stderr


def test_the_lists_of_choices_are_those_of_the_packages():
    from taichifem import runtime
    from taichifem.description import material, view
    from taichifem.output import export

    assert options.ARCHES == runtime.ARCHES
    assert set(options.PRECISIONS) == set(runtime.PRECISIONS)
    assert options.MODELS == material.MODELS
    assert options.PLASTICITIES == material.PLASTICITIES
    assert options.RENDERERS == view.RENDERERS
    assert options.COLORS == view.COLORS
    assert set(options.EXPORTS) == set(export.FORMATS)


def test_the_demos_are_listed_even_if_one_is_damaged(tiny, monkeypatch):
    (tiny.parent / "broken.toml").write_text("name = ")
    monkeypatch.setattr(demos, "FOLDERS", (tiny.parent,))
    result = call("demo")
    assert result.exit_code == 0
    assert "tiny" in result.output and "A bar of two cubes bends." in result.output
    assert "cannot be read" in result.output


def test_no_demos_at_all(monkeypatch):
    monkeypatch.setattr(demos, "FOLDERS", ())
    assert "no demos" in call("demo").output


def test_mesh_reports_and_converts(tmp_path):
    from taichifem import TetMesh

    source, target = tmp_path / "bar.vtu", tmp_path / "bar.msh"
    TetMesh.bar(size=(1, 1, 1), cells=(2, 2, 2)).write(source)
    result = call("mesh", source, "-o", target)
    assert result.exit_code == 0
    assert "volume" in result.output and f"wrote {target}" in result.output
    assert TetMesh.from_file(target).volume == pytest.approx(1)
    assert "wrote" not in call("mesh", source).output


def test_info_names_arches_and_extras(monkeypatch):
    monkeypatch.setattr(info, "renderers", lambda: [("taichi", "works")])  # its probes take seconds
    result = call("info")
    assert result.exit_code == 0, result.output
    for word in ("taichifem", __version__, "cpu", "cuda", "tetrahedralize", "compiled kernels", "GiB"):
        assert word in result.output


def test_info_names_every_renderer(monkeypatch):
    monkeypatch.setattr(
        "taichifem.output.renderer.available_renderers", lambda: [("taichi", True, "a"), ("ggui", False, "no Vulkan")]
    )
    rows = dict(info.renderers())
    assert rows["taichi"] == "works: a" and rows["ggui"] == "not here: no Vulkan"
