"""The live view in a window of Taichi's (GGUI): the same session and the same list of parameters as in a browser."""

from __future__ import annotations

import json
import math
import os
import sys
from dataclasses import replace
from typing import Any

import numpy as np

from taichifem.description import Camera
from taichifem.errors import InputError
from taichifem.live.keeping import Keeper
from taichifem.live.parameters import panel
from taichifem.live.picking import Hit, pick, ray_through
from taichifem.live.session import Session
from taichifem.live.stage import Stage
from taichifem.output import ggui
from taichifem.output.camera import Viewpoint
from taichifem.output.frame import Frame, build_frame
from taichifem.runtime import ti

SIZE = (1280, 720)
BROWSER = "leave --window out to use the browser"
BUTTONS = ("play", "pause", "step", "reset", "keep", "back", "save-scene", "save-interactions", "record")
DECADES = 6
"""Of a logarithmic slider that has 0 at its end."""


def need_window() -> None:
    """Raise InputError in one line where no window can open."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError(f"--window needs a display, and there is none here: {BROWSER}")
    ok, why = ggui.probe()
    if not ok:
        raise InputError(f"--window is not available: {why}; or {BROWSER}")


def run_window(stage: Stage, keeper: Keeper, *, paused: bool = False, frames: int | None = None) -> None:
    """Show the stage until the window is closed, or for so many frames."""
    session = Session(stage, keeper=keeper, paused=paused)
    window = _Window(session)
    try:
        while window.open and (frames is None or window.frames < frames):
            session.turn()
            window.show()
    finally:
        session.end()
        window.close()


class _Window:
    """Draws a session, and turns mouse and widgets into messages for it."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._camera = session.camera
        self._renderer = ggui.GguiRenderer(SIZE, self._camera, visible=True)
        self._held: tuple[str, Hit] | None = None
        self._before: tuple[float, float] | None = None
        self._last: Frame | None = None
        self.frames = 0
        self.open = True

    def show(self) -> None:
        """One picture."""
        if not self._session.diverged or self._last is None:
            self._last = build_frame(self._session.stage.simulation)
        viewpoint = self._renderer.place(self._last)
        window = self._renderer.window
        gui = window.get_gui()
        on_widgets = self._widgets(gui)
        if not on_widgets:
            self._mouse(window, viewpoint)
        window.show()
        self.frames += 1
        self.open = window.running

    def close(self) -> None:
        """Close the window."""
        self._renderer.close()

    # Widgets

    def _widgets(self, gui: Any) -> bool:
        """Draw the controls. Is the mouse over them?"""
        session, stage = self._session, self._session.stage
        with gui.sub_window("taichifem", 0.0, 0.0, 0.2, 0.42):
            simulation = stage.simulation
            gui.text(f"{stage.scene.name}, t = {simulation.time:.2f} s")
            gui.text(f"{simulation.piece_count} piece(s), {sum(simulation.phases.values()):.1f} ms a step")
            for name in BUTTONS:
                if gui.button(name):
                    session.inbox.put({"ask": name})
            for _, text in session.out.notices[-2:]:
                gui.text(json.loads(text)["text"][:60])
        with gui.sub_window("parameters", 0.75, 0.0, 0.25, 1.0):
            for group in panel(stage.scene, stage.tools):
                gui.text(group["title"])
                for row in group["rows"]:
                    value = self._row(gui, group["title"], row)
                    if value != row["value"]:
                        session.inbox.put({"do": "set", "path": row["path"], "value": value})
        x, y = self._renderer.window.get_cursor_pos()
        return x > 0.75 or (x < 0.2 and y > 0.58)

    def _row(self, gui: Any, title: str, row: dict[str, Any]) -> Any:
        """A widget for a parameter; its value after it."""
        value, label = row["value"], f"{row['label']} ({title})"
        if row["kind"] == "switch":
            return gui.checkbox(label, value)
        if row["kind"] == "choice":
            at = row["choices"].index(value)
            return row["choices"][(at + 1) % len(row["choices"])] if gui.button(f"{label}: {value}") else value
        if value is None:
            return _from_slider(row, 0.5) if gui.button(f"{label}: {row['none']}") else None
        gui.text(f"{row['label']} = {value:.4g} {row['unit']}")
        before = _to_slider(row, value)
        after = gui.slider_float(label, before, 0.0, 1.0)
        return value if abs(after - before) < 1e-4 else _from_slider(row, after)

    # Mouse

    def _mouse(self, window: Any, viewpoint: Viewpoint) -> None:
        """Left: take hold, or turn where nothing is met. Right: shift. Keys w and s: nearer and farther."""
        x, y = window.get_cursor_pos()
        pressed = window.is_pressed(ti.ui.LMB), window.is_pressed(ti.ui.RMB)
        along = ray_through(viewpoint, 2 * x - 1, 2 * y - 1, SIZE[0] / SIZE[1])
        if pressed[0] and self._before is None:
            self._take_hold(pick(self._last, viewpoint, along))
        elif self._held is not None and pressed[0]:
            hand, hit = self._held
            here = viewpoint.eye + hit.depth / (along @ viewpoint.forward) * along
            self._session.inbox.put({"do": "drag", "hand": hand, "offset": (here - hit.point).tolist()})
        elif self._held is not None:
            self._session.inbox.put({"do": "release", "hand": self._held[0]})
            self._held = None
        elif self._before is not None and any(pressed):
            self._turn(viewpoint, x - self._before[0], y - self._before[1], shift=pressed[1])
        for key, factor in (("w", 0.97), ("s", 1.03)):
            if window.is_pressed(key):
                self._look(viewpoint.target - factor * viewpoint.reach * viewpoint.forward, viewpoint.target)
        self._before = (x, y) if any(pressed) else None

    def _take_hold(self, hit: Hit | None) -> None:
        if hit is not None:
            tools, name = self._session.stage.tools, f"window-{self.frames}"
            grab = {"do": "grab", "hand": name, "node": hit.node, "stiffness": tools.strength, "radius": tools.radius}
            self._session.inbox.put(grab)
            self._held = name, hit

    def _turn(self, viewpoint: Viewpoint, dx: float, dy: float, *, shift: bool) -> None:
        if shift:
            step = -2 * viewpoint.reach * math.tan(math.radians(viewpoint.fov) / 2)
            move = step * (dx * SIZE[0] / SIZE[1] * viewpoint.right + dy * viewpoint.up)
            self._look(viewpoint.eye + move, viewpoint.target + move)
            return
        arm = viewpoint.eye - viewpoint.target
        azimuth = math.atan2(arm[1], arm[0]) - 6 * dx
        height = np.clip(math.asin(arm[2] / viewpoint.reach) - 4 * dy, -1.5, 1.5)
        flat = math.cos(height)
        arm = viewpoint.reach * np.array([flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(height)])
        self._look(viewpoint.target + arm, viewpoint.target)

    def _look(self, eye: np.ndarray, target: np.ndarray) -> None:
        self._camera: Camera = replace(self._camera, eye=tuple(eye.tolist()), target=tuple(target.tolist()))
        self._session.camera = self._camera
        self._renderer.move(self._camera)


def _to_slider(row: dict[str, Any], value: float) -> float:
    """Where on a slider from 0 to 1 a value is: by its size where that is logarithmic."""
    low, high = row["low"], row["high"]
    if not row["log"]:
        return (value - low) / (high - low)
    if low > 0:
        return math.log(max(value, low) / low) / math.log(high / low)
    return max(0.0, 1 + math.log10(value / high) / DECADES) if value > 0 else 0.0


def _from_slider(row: dict[str, Any], at: float) -> float:
    """The value at a place on the slider, to three digits."""
    low, high = row["low"], row["high"]
    value = low + (high - low) * at
    if row["log"] and low > 0:
        value = low * (high / low) ** at
    elif row["log"]:
        value = high * 10 ** (DECADES * (at - 1)) if at > 0 else 0.0
    return round(value) if row["whole"] else float(f"{value:.3g}")
