"""The buttons, tools and keys of a live view: one list for the browser and for a window."""

from __future__ import annotations

from typing import Any

ASKS = (
    "play",
    "pause",
    "step",
    "reset",
    "reset-all",
    "keep",
    "back",
    "save-scene",
    "command",
    "save-interactions",
    "record",
)
"""What a session is asked for by a button."""

TOOLS = ("pull", "pin", "poke", "throw", "look")
"""What the mouse does; the keys 1 to 5 choose."""

KEYS = {"s": "step", "r": "reset", "k": "keep", "b": "back"}
"""Beside space, which stops and goes on, and g, which cuts gravity."""


def asking(button: str) -> dict[str, Any]:
    """The message of a button in ASKS."""
    return {"ask": "reset", "all": True} if button == "reset-all" else {"ask": button}
