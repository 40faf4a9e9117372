"""The loop behind the live view: steps in real time, does what browsers ask for, and tells them what it looks like."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import Any

import numpy as np

from taichifem.description import Camera, check
from taichifem.errors import Diverged, InputError
from taichifem.live import messages
from taichifem.live.broadcast import Broadcast
from taichifem.live.filming import Film
from taichifem.live.inbox import Inbox
from taichifem.live.interactions import checked
from taichifem.live.keeping import Keeper
from taichifem.live.measuring import Meter
from taichifem.live.panel import panel
from taichifem.live.stage import Kept, Stage
from taichifem.output.camera import frame_points
from taichifem.output.colors import VIRIDIS
from taichifem.output.frame import Frame, build_frame
from taichifem.output.solids import Solids

UPDATES, UPDATES_WHEN_LATE = 60.0, 32.0
"""A second, at most; and while the simulation is behind real time."""

FIGURES = 0.2
"""Seconds between messages with figures and values."""

LAG = 0.1
"""Seconds behind real time after which what was missed is given up."""

WAIT = 0.05


class Session:
    """Runs a stage. All of it happens in the thread that calls `run`; what others want waits in `inbox`.

    keeper: where files go, and what the scene is called.  paused: wait for "play" at the start.
    """

    def __init__(self, stage: Stage, *, keeper: Keeper, paused: bool = False) -> None:
        self.stage = stage
        self.inbox = Inbox()
        self.out = Broadcast()
        self.paused, self.diverged = paused, False
        self._keeper, self._film = keeper, Film()
        self._meter = Meter()
        self._kept: Kept | None = None
        self._surface: messages.Surface | None = None
        self._colors = np.zeros((0, 3))
        self._version = self._number = 0
        self._bar: tuple[str, str] | None = None
        self._due = self._shown = self._told = 0.0
        self._stale = self._panel = True
        stage.on_rebuild = lambda: self.out.notice("the laws change: making the simulation anew, this takes a moment")
        self._greet()

    def _greet(self) -> None:
        """What stays the same all the time: name, viewpoint, colours."""
        scene = self.stage.scene
        solids = Solids(self._frame())
        seen = frame_points(solids.subject(), scene.camera, (1280, 720))
        self.camera = Camera(eye=tuple(seen.eye.tolist()), target=tuple(seen.target.tolist()), fov=scene.camera.fov)
        self.extent = float(np.linalg.norm(solids.high - solids.low))
        self.out.tell(
            "hello",
            name=scene.name,
            description=scene.description,
            camera={"eye": self.camera.eye, "target": self.camera.target, "fov": self.camera.fov},
            extent=self.extent,
            map=list(VIRIDIS),
            elements="triangles" if self.stage.simulation.dimension == 2 else "tetrahedra",
        )

    def run(self, stop: threading.Event) -> None:
        """Go on until `stop` is set."""
        try:
            self._show()
            self.out.notice("the first step compiles, which takes a moment")
            while not stop.is_set():
                self.turn(WAIT if self.paused else min(max(self._due - time.perf_counter(), 0.0), WAIT))
        finally:
            self.end()

    def turn(self, wait: float = 0.0) -> None:
        """Do what is asked for, waiting at most `wait` seconds for it; a step, if it is time; tell what is new."""
        for message in self.inbox.take(wait):
            self._obey(message)
        if not self.paused and time.perf_counter() >= self._due:
            self._step()
        self._keep_informed()

    def end(self) -> None:
        """Finish what is being written."""
        self._film.end()

    def _step(self) -> None:
        now, stage = time.perf_counter(), self.stage
        frame = stage.simulation.frame
        try:
            stage.step()
        except InputError as error:
            self._halt(str(error), diverged=isinstance(error, Diverged))
            return
        self._stale = True
        self._due = max(self._due + stage.simulation.dt / stage.tools.pace, now - LAG)
        self._meter.note(stage.simulation, time.perf_counter() - now)
        if stage.simulation.frame != frame:
            self._shoot()

    def _shoot(self) -> None:
        try:
            self._film.add(self.stage.simulation)
        except InputError as error:
            self._film.end()
            self.out.notice(str(error), level="error")

    def _halt(self, reason: str, *, diverged: bool) -> None:
        """Stop time because of something that went wrong."""
        self.paused, self.diverged = True, diverged
        remedy = ": reset leads out of it; softer, slower or in more steps it may hold" if diverged else ""
        self.out.notice(reason + remedy, level="error")
        self._told = 0.0

    # What browsers see

    def _keep_informed(self) -> None:
        now = time.perf_counter()
        late = not self.paused and now > self._due
        if self._stale and now - self._shown >= 0.9 / (UPDATES_WHEN_LATE if late else UPDATES):
            self._shown = now
            if self.out.viewers or self.paused:
                self._show()
        if now - self._told >= FIGURES and (self.out.viewers or self._panel):
            self._told = now
            self._tell()

    def _show(self) -> None:
        """Tell where everything is, unless it is nowhere."""
        self._stale = False
        if self.diverged:
            return
        frame = self._frame()
        try:
            self.stage.check(frame.points)
        except Diverged as error:
            self._halt(str(error), diverged=True)
            return
        topology = self._topology(frame)
        self._number += 1
        update = messages.update(
            frame,
            self._surface,
            version=self._version,
            number=self._number,
            time=self.stage.simulation.time,
            hands=self._hands(frame),
        )
        self.out.show(self._version, self._number, update, topology)
        bar = (frame.value_label, frame.value_unit) if frame.values is not None else ("", "")
        if bar != self._bar:
            self._bar = bar
            self.out.tell("bar", label=bar[0], unit=bar[1])

    def _frame(self) -> Frame:
        """Where everything is; what a picture would say in words costs time, and the page says it itself."""
        simulation = self.stage.simulation
        if simulation.scene.view.hud:
            simulation.adjust(view=replace(simulation.scene.view, hud=False))
        return build_frame(simulation)

    def _topology(self, frame: Frame) -> bytes | None:
        """The surface as bytes, if it or its colours are not those that were sent last."""
        same = self._surface is not None and self._surface.shows(frame)
        if same and (frame.colors is self._colors or np.array_equal(frame.colors, self._colors)):
            return None
        if not same:
            self._surface = messages.Surface(frame)
        self._colors, self._version = frame.colors, self._version + 1
        return messages.topology(self._surface, frame.colors, self._version)

    def _hands(self, frame: Frame) -> np.ndarray:
        rows = []
        for hand in self.stage.hands.values():
            here = frame.points[hand.nodes].mean(axis=0)
            force = float(np.linalg.norm(hand.force(frame.points)))
            rows.append([*here, *hand.targets.mean(axis=0), force, hand.stiffness is None])
        return np.array(rows, dtype=float).reshape(-1, 8)

    def _tell(self) -> None:
        stage = self.stage
        if self._panel:
            self._panel = False
            self.out.tell("panel", groups=panel(stage.scene, stage.tools))
        self.out.tell("hands", names=list(stage.hands))
        self.out.tell(
            "state",
            paused=self.paused,
            diverged=self.diverged,
            kept=self._kept is not None,
            film=str(self._film.path or ""),
            done=len(stage.done.entries),
        )
        if not self.diverged:
            self.out.tell("figures", **self._meter.figures(stage.simulation, paused=self.paused))

    # What browsers ask for

    def _obey(self, message: dict[str, Any]) -> None:
        try:
            if "ask" in message:
                self._answer(message)
            else:
                self.stage.do(checked(message))
                self._panel = self._panel or message["do"] == "set"
            self._stale = True
        except Diverged as error:
            self._halt(str(error), diverged=True)
        except InputError as error:
            self.out.notice(str(error), level="error")
            self._panel = True  # a slider that was refused goes back

    def _answer(self, message: dict[str, Any]) -> None:
        name = str(message["ask"]).replace("-", "_")
        answer = getattr(self, f"_ask_{name}", None)
        if answer is None:
            raise InputError(f"nobody knows what {str(message['ask'])[:40]!r} is")
        answer(message)
        self._told = 0.0

    def _ask_pause(self, _: dict) -> None:
        self.paused = True

    def _ask_play(self, _: dict) -> None:
        if self.diverged:
            raise InputError("the simulation has diverged: reset it, or go back to the snapshot")
        self.paused, self._due = False, time.perf_counter()
        self._meter.begin()

    def _ask_step(self, _: dict) -> None:
        self.paused = True
        if not self.diverged:
            self._step()

    def _ask_reset(self, message: dict) -> None:
        self.stage.reset(parameters_too=message.get("all") is True)
        self._again()

    def _ask_keep(self, _: dict) -> None:
        if self.diverged:
            raise InputError("the simulation has diverged: this is no state to keep")
        self._kept = self.stage.keep()
        self.out.notice(f"kept the state at t = {self.stage.simulation.time:.2f} s")

    def _ask_back(self, _: dict) -> None:
        if self._kept is None:
            raise InputError("there is no snapshot to go back to: take one first")
        self.stage.back(self._kept)
        self._again()

    def _again(self) -> None:
        self.diverged, self._panel, self._due = False, True, time.perf_counter()
        self._meter.begin()

    def _ask_mark(self, message: dict) -> None:
        """Say that all that was asked for before is done, and which update is the first to show it."""
        self.out.tell("mark", name=str(message.get("name"))[:100], update=self._number + 1)

    def _ask_camera(self, message: dict) -> None:
        eye, target = (check.vector(name, message.get(name)) for name in ("eye", "target"))
        self.camera = Camera(eye=eye, target=target, fov=check.number("fov", message.get("fov")))
        self._film.look(self.camera)

    def _ask_save_scene(self, _: dict) -> None:
        if self.diverged:
            raise InputError("the simulation has diverged: reset it first")
        for line in self._keeper.save(self.stage, self.camera):
            self.out.notice(line)

    def _ask_save_interactions(self, _: dict) -> None:
        self.out.notice(self._keeper.save_interactions(self.stage))

    def _ask_command(self, _: dict) -> None:
        self.out.tell("command", text=self._keeper.command(self.stage), at=time.time())

    def _ask_record(self, _: dict) -> None:
        if self._film.path:
            self.out.notice(f"wrote {self._film.end()}")
        else:
            path = self._film.begin(self._keeper.place(".mp4"), self.stage.simulation, self.camera)
            self.out.notice(f"recording {path}: every frame is drawn, so time may go slower")
