"""The live view in a window of Taichi's (GGUI): the same session and the same list of parameters as in a browser."""

from __future__ import annotations

import json
import math
import os
import sys
import textwrap
from dataclasses import replace
from typing import Any

import numpy as np

from taichifem.errors import InputError
from taichifem.live.controls import ASKS, KEYS, TOOLS, asking
from taichifem.live.keeping import Keeper
from taichifem.live.panel import panel, tools_offered
from taichifem.live.picking import ray_through
from taichifem.live.pointer import Pointer
from taichifem.live.session import Session
from taichifem.live.stage import Stage
from taichifem.output import ggui
from taichifem.output.camera import Viewpoint
from taichifem.output.frame import Frame, Shape, build_frame
from taichifem.runtime import ti

SIZE = (1280, 720)
BROWSER = "leave --window out to use the browser"
WIDTH = 34
"""Letters in a line of the panel."""

KNOB = 0.012
"""Size of the spheres that show what is held, of the distance to what is looked at."""

DIGITS = {str(k + 1): tool for k, tool in enumerate(TOOLS)}
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
    window = Window(session, ggui.GguiRenderer(SIZE, session.camera, visible=True))
    try:
        while window.open and (frames is None or window.frames < frames):
            session.turn()
            window.show()
    finally:
        session.end()
        window.close()


class Window:
    """Draws a session with `renderer`, and turns mouse, keys and widgets into messages for it."""

    def __init__(self, session: Session, renderer: ggui.GguiRenderer) -> None:
        self._session, self._renderer = session, renderer
        self._camera = session.camera
        self._send = session.inbox.put
        self._pointer = Pointer(self._send, extent=session.extent)
        self._before: tuple[float, float] | None = None
        self._left = self._acts = self._busy = False
        self._down = session.stage.scene.gravity[2] or -9.81
        self._last: Frame | None = None
        self.frames = 0
        self.open = True

    def show(self) -> None:
        """One picture."""
        stage = self._session.stage
        if not self._session.diverged or self._last is None:
            self._last = build_frame(stage.simulation)
        viewpoint = self._renderer.place(replace(self._last, colliders=(*self._last.colliders, *self._knobs())))
        window = self._renderer.window
        on_widgets = self._widgets(window.get_gui(), *window.get_cursor_pos())
        self._keys(window, viewpoint)
        self._mouse(window, viewpoint, on_widgets)
        window.show()
        self.frames += 1
        self.open = window.running

    def close(self) -> None:
        """Close the window."""
        self._renderer.close()

    def _knobs(self) -> list[Shape]:
        """Where hands hold, and where they want that."""
        arm = np.subtract(self._camera.eye, self._camera.target)
        radius = KNOB * float(np.linalg.norm(arm))
        found = []
        for hand in self._session.stage.hands.values():
            here, there = self._last.points[hand.nodes].mean(axis=0), hand.targets.mean(axis=0)
            ends = [here] if hand.stiffness is None else [here, there]
            found += [Shape(kind="sphere", rotation=np.eye(3), center=end, radius=radius) for end in ends]
        return found

    # Widgets

    def _widgets(self, gui: Any, x: float, y: float) -> bool:
        """Draw the controls. Is the mouse, at x and y of the window, over them?"""
        with gui.sub_window("taichifem", 0.0, 0.0, 0.2, 0.75):
            self._figures(gui)
            for tool in tools_offered(self._session.stage.scene):
                if gui.button(f"[{tool}]" if tool == self._pointer.tool else tool):
                    self._pointer.tool = tool
            if gui.button("gravity"):
                self._cut_gravity()
            for name in ASKS:
                if gui.button(name):
                    self._send(asking(name))
            out = self._session.out
            told = sorted((*out.notices, *(entry for kind, entry in out.texts.items() if kind == "command")))
            for _, text in told[-2:]:
                gui.text(textwrap.fill(json.loads(text)["text"], WIDTH))
        with gui.sub_window("parameters", 0.75, 0.0, 0.25, 1.0):
            stage = self._session.stage
            for group in panel(stage.scene, stage.tools):
                gui.text(group["title"])
                for row in group["rows"]:
                    value = self._row(gui, group["title"], row)
                    if value != row["value"]:
                        self._set(row["path"], value)
        return x > 0.75 or (x < 0.2 and y > 0.25)

    def _figures(self, gui: Any) -> None:
        stage = self._session.stage
        simulation, report = stage.simulation, stage.simulation.report
        gui.text(f"{stage.scene.name}, t = {simulation.time:.2f} s{', paused' if self._session.paused else ''}")
        gui.text(f"{simulation.piece_count} piece(s), {sum(simulation.phases.values()):.1f} ms a step")
        gui.text(f"{report.iterations} iterations{'' if report.converged else ' (cap hit)'}")
        pulls = [hand.force(self._last.points) for hand in stage.hands.values() if hand.stiffness is not None]
        gui.text("".join(f"pulls with {np.linalg.norm(force):.3g} N " for force in pulls))

    def _set(self, path: str, value: Any) -> None:
        self._send({"do": "set", "path": path, "value": value})
        if path == "tools.strength":
            self._pointer.set_strength(value)

    def _cut_gravity(self) -> None:
        """Away with it, or back to what it was."""
        now = self._session.stage.scene.gravity[2]
        self._down = now or self._down
        self._set("simulation.gravity.z", 0.0 if now else self._down)

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
        if row["optional"] and gui.button(f"{label}: take away"):
            return None
        gui.text(f"{row['label']} = {value:.4g} {row['unit']}")
        before = _to_slider(row, value)
        after = gui.slider_float(label, before, 0.0, 1.0)
        return value if abs(after - before) < 1e-4 else _from_slider(row, after)

    # Keys and mouse

    def _keys(self, window: Any, viewpoint: Viewpoint) -> None:
        """As in the browser; up and down go nearer and farther."""
        for event in window.get_events(ti.ui.PRESS):
            if event.key == ti.ui.SPACE:
                self._send(asking("play" if self._session.paused else "pause"))
            elif event.key == "g":
                self._cut_gravity()
            elif event.key in KEYS:
                self._send(asking(KEYS[event.key]))
            elif event.key in DIGITS:
                self._pointer.tool = DIGITS[event.key]
        for key, factor in ((ti.ui.UP, 0.97), (ti.ui.DOWN, 1.03)):
            if window.is_pressed(key):
                self._look(viewpoint.target - factor * viewpoint.reach * viewpoint.forward, viewpoint.target)

    def _mouse(self, window: Any, viewpoint: Viewpoint, on_widgets: bool) -> None:
        """Left: the tool, or turn where nothing is met. Right: shift."""
        x, y = window.get_cursor_pos()
        left, right = window.is_pressed(ti.ui.LMB), window.is_pressed(ti.ui.RMB)
        along = ray_through(viewpoint, 2 * x - 1, 2 * y - 1, SIZE[0] / SIZE[1])
        # A button that went down on a widget moves that until it comes up.
        self._busy = (left or right) and (self._busy or (on_widgets and self._before is None))
        if self._busy:
            return
        if left and not self._left:
            self._acts = self._pointer.press(self._session.stage, self._last, viewpoint, along)
        elif left and self._acts:
            self._pointer.drag(viewpoint, along)
        elif self._left and not left:
            self._pointer.release()
        if self._before is not None and (right or (left and not self._acts)):
            self._turn(viewpoint, x - self._before[0], y - self._before[1], shift=right)
        self._left, self._before = left, (x, y) if left or right else None

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
        self._camera = replace(self._camera, eye=tuple(eye.tolist()), target=tuple(target.tolist()))
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
