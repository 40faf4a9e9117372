"""Options that commands share. Nothing heavy is imported, so that `--help` is quick."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

# The packages that own these lists take a second to import; a test compares.
ARCHES = ("cpu", "cuda", "vulkan", "metal")
PRECISIONS = ("f32", "f64")
MODELS = ("mass-spring", "linear", "corotational", "stvk", "neo-hookean", "invertible", "modal", "condensed", "bem")
BASES = ("fem", "quadratic")
PLASTICITIES = ("none", "creep", "von-mises", "tresca")
RENDERERS = ("auto", "taichi", "ggui", "pyvista")
COLORS = ("material", "piece", "von-mises", "plastic-strain", "displacement", "speed")
EXPORTS = ("vtu", "ply", "obj", "npz")

FILE = click.Path(dir_okay=False, path_type=Path)


class Size(click.ParamType):
    """Width and height in pixels, as in 1280x720."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"(\d{1,5})[xX](\d{1,5})", value.strip())
        if match is None or not all(16 <= int(side) <= 8192 for side in match.groups()):
            self.fail(f"{value!r}: write WIDTHxHEIGHT in pixels, each 16 to 8192, like 1280x720", param, ctx)
        return int(match[1]), int(match[2])


def together(*decorators: Callable) -> Callable:
    """One decorator from several, which then stand in the help in that order."""

    def decorate(function: Callable) -> Callable:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def machine_options(precision: str = "f32") -> Callable:
    """What to compute on, and in which precision unless told otherwise."""
    return together(
        click.option("--arch", type=click.Choice(ARCHES), help="What to compute on.  [default: cpu]"),
        click.option("--threads", type=click.IntRange(min=1), metavar="N", help="CPU threads.  [default: all cores]"),
        click.option(
            "--precision", type=click.Choice(PRECISIONS), default=precision, show_default=True, help="Of all numbers."
        ),
    )


set_option = click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Change the scene, as in body.0.material.youngs=2e5. May be given again.",
)
seconds_option = click.option(
    "--seconds", type=float, metavar="T", help="Run until this simulated time [s].  [default: the scene's]"
)
fps_option = click.option(
    "--fps", type=float, metavar="F", help="Frames a second; the time step follows.  [default: the scene's]"
)
size_option = click.option(
    "--size", type=Size(), metavar="WxH", default="1280x720", show_default=True, help="Of the picture [pixels]."
)
renderer_option = click.option(
    "--renderer", type=click.Choice(RENDERERS), default="auto", show_default=True, help="Who draws."
)
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")

run_options = together(
    set_option,
    seconds_option,
    click.option("--frames", type=click.IntRange(min=1), metavar="N", help="Run until this frame instead."),
    fps_option,
    click.option(
        "-o",
        "--output",
        type=click.Path(path_type=str),
        metavar="FILE",
        help="Video: .mp4, .gif, .webp, or numbered .png.  [default: out/NAME.mp4]",
    ),
    click.option("--no-video", is_flag=True, help="Draw nothing."),
    size_option,
    renderer_option,
    click.option("--color", type=click.Choice(COLORS), help="What colours show.  [default: the scene's]"),
    click.option("--wire/--no-wire", default=None, help="Draw the edges of elements, or do not."),
    click.option(
        "--export",
        type=click.Path(file_okay=False, path_type=Path),
        metavar="DIR",
        help="Write the mesh of each frame.",
    ),
    click.option("--format", "export_format", type=click.Choice(EXPORTS), help="Of --export.  [default: vtu]"),
    click.option("--stats", type=FILE, metavar="FILE", help="Write a line of JSON for each frame."),
    click.option("--checkpoint", type=FILE, metavar="FILE", help="Write the state at the end and on Ctrl-C."),
    click.option("--checkpoint-every", type=click.IntRange(min=1), metavar="N", help="... and every N frames."),
    click.option("--resume", type=FILE, metavar="FILE", help="Go on from a checkpoint of the same scene."),
    click.option("--replay", type=FILE, metavar="FILE", help="Do again what was done in `taichifem live`."),
    machine_options(),
    quiet_option,
)

live_options = together(
    set_option,
    click.option("--port", type=click.IntRange(0, 65535), metavar="N", help="0 takes any free one.  [default: 8642]"),
    click.option("--host", default="127.0.0.1", show_default=True, help="Address of this machine to listen on."),
    click.option("--browser/--no-browser", default=True, help="Open the page, or only say where it is."),
    click.option("--paused", is_flag=True, help="Wait for the play button."),
    click.option("--window", is_flag=True, help="In a window of Taichi's, which needs Vulkan and a display."),
    click.option(
        "--folder",
        type=click.Path(file_okay=False, path_type=Path),
        default="out",
        show_default=True,
        help="Where files are saved.",
    ),
    machine_options(),
)

compare_options = together(
    click.option(
        "--vary",
        required=True,
        metavar="KEY=A,B,C",
        help="What differs: a field of the material (of every body), a key of [simulation], or a key as in --set.",
    ),
    click.option(
        "--video",
        type=click.Path(path_type=str),
        metavar="FILE",
        help="All choices side by side: .mp4, .gif, .webp, or numbered .png.  [default: draw nothing]",
    ),
    set_option,
    seconds_option,
    fps_option,
    size_option,
    click.option("--json", "json_file", type=FILE, metavar="FILE", help="Write all figures to this file, too."),
    machine_options(),
)

static_options = together(
    set_option,
    click.option("--linear", is_flag=True, help="Small strains: every material follows Hooke's law."),
    click.option("--tolerance", type=float, default=1e-9, show_default=True, help="Imbalance relative to the forces."),
    click.option("-o", "--output", type=FILE, metavar="FILE", help="Results on the mesh.  [default: out/NAME.vtu]"),
    click.option("--picture", type=FILE, metavar="FILE", help="Picture of them.  [default: out/NAME.png]"),
    click.option("--no-picture", is_flag=True, help="Draw nothing."),
    click.option("--color", type=click.Choice(COLORS), help="What colours show.  [default: the scene's, or von-mises]"),
    size_option,
    renderer_option,
    click.option("--json", "json_file", type=FILE, metavar="FILE", help="Write all figures to this file, too."),
    machine_options("f64"),
    quiet_option,
)

modes_options = together(
    set_option,
    click.option(
        "--modes", "count", type=click.IntRange(min=1), metavar="N", help="Of each body.  [default: the scene's]"
    ),
    click.option("--basis", type=click.Choice(BASES), help="What they are made of.  [default: the scene's]"),
    click.option(
        "-o",
        "--output",
        type=click.Path(file_okay=False, path_type=Path),
        metavar="DIR",
        help="Pictures and videos.  [default: out/NAME-modes]",
    ),
    click.option("--no-picture", is_flag=True, help="Draw no pictures."),
    click.option("--no-video", is_flag=True, help="Make no videos."),
    click.option(
        "--size", type=Size(), metavar="WxH", default="640x480", show_default=True, help="Of the picture [pixels]."
    ),
    renderer_option,
    click.option("--json", "json_file", type=FILE, metavar="FILE", help="Write all figures to this file, too."),
    click.option("--arch", type=click.Choice(ARCHES), help="What to compute on.  [default: cpu]"),
    click.option("--threads", type=click.IntRange(min=1), metavar="N", help="CPU threads.  [default: all cores]"),
)
