"""`taichifem live` on the command line: what it refuses."""

import socket

from calling import assert_refused, call

from taichifem.live import window
from taichifem.output import ggui


def test_a_busy_port_is_one_line(tiny):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        result = call("live", tiny, "--no-browser", "--port", port)
    assert_refused(result, f"port {port}", "is taken", "--port")


def test_without_a_display_or_vulkan_a_window_points_to_the_browser(tiny, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(window.sys, "platform", "linux")
    assert_refused(call("live", tiny, "--window"), "--window needs a display", "browser")
    monkeypatch.setenv("DISPLAY", ":7")
    monkeypatch.setattr(ggui, "probe", lambda: (False, "Vulkan does not work here: install a driver"))
    assert_refused(call("live", tiny, "--window"), "Vulkan does not work here", "browser")


def test_unknown_scenes_and_static_ones_are_refused(tiny):
    assert_refused(call("live", "hallo"), "there is no demo 'hallo'", "hello")
    assert_refused(call("live", "none.toml", "--no-browser"), "none.toml")
    quasi = call("live", tiny, "--no-browser", "--port", 0, "--set", "simulation.integrator=quasi-static")
    assert_refused(quasi, "quasi-static", "choose another")


def test_interactions_and_a_checkpoint_exclude_each_other(tiny):
    assert_refused(call("run", tiny, "--replay", "a.json", "--resume", "b.npz"), "--resume and --replay")
    assert_refused(call("run", tiny, "--replay", "a.json"), "a.json: cannot be read")


def test_reduced_bodies_are_refused_what_their_model_cannot(tiny):
    changes = "body.0.material.model=modal", "simulation.integrator=quasi-static"
    modal = call("live", tiny, "--no-browser", "--port", 0, "--set", changes[0], "--set", changes[1])
    assert_refused(modal, "has no inertia", 'use model = "condensed"')
