"""`taichifem live`: a scene in the browser, or in a window, that one can lay hands on."""

from __future__ import annotations

import signal
import threading
import webbrowser
from dataclasses import dataclass
from pathlib import Path

import click

from taichifem.app.demos import find_demo
from taichifem.app.starting import start_taichi
from taichifem.scene import read_scene


@dataclass(frozen=True, kw_only=True)
class LiveOptions:
    """What the command line says. host, port: where the page is served.  window: in a window instead."""

    overrides: tuple[str, ...] = ()
    host: str = "127.0.0.1"
    port: int | None = None
    browser: bool = True
    paused: bool = False
    window: bool = False
    folder: Path = Path("out")
    arch: str | None = None
    threads: int | None = None
    precision: str = "f32"


def run_live(source: str, options: LiveOptions) -> None:
    """Show the scene file or demo `source` until Ctrl-C. Raises InputError for what is wrong."""
    from taichifem.live.keeping import Keeper
    from taichifem.live.server import PORT, Server

    path = Path(source) if Path(source).suffix == ".toml" or Path(source).is_file() else find_demo(source).path
    scene = read_scene(path, overrides=options.overrides)
    if options.window:
        from taichifem.live.window import need_window

        need_window()
    start_taichi(options.arch, options.threads)
    from taichifem.live.session import Session
    from taichifem.live.stage import Stage

    stage = Stage(scene, precision=options.precision, arch=options.arch, threads=options.threads)
    said = ("run", source) if Path(source) == path else ("demo", source)
    said += tuple(word for override in options.overrides for word in ("--set", override))
    keeper = Keeper(command_line=said, name=path.stem, folder=options.folder)
    if options.window:
        from taichifem.live.window import run_window

        run_window(stage, keeper, paused=options.paused)
        return
    session = Session(stage, keeper=keeper, paused=options.paused)
    server = Server(session.out, session.inbox, host=options.host, port=PORT if options.port is None else options.port)
    server.start()
    stop = threading.Event()
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        click.echo(f"{scene.name}: {server.url}")
        click.echo("Ctrl-C ends it. From another machine: ssh -L, with the same port at both ends.")
        if options.browser and not webbrowser.open(server.url):
            click.echo("no browser opens here: open the address above in yours")
        session.run(stop)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        server.close()
