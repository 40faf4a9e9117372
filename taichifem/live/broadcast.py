"""What a session has to tell, kept so that whoever comes later learns it too."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from typing import Any


class Broadcast:
    """The last message of each kind, and the last notices. Written by the session, read by the server's tasks.

    topology, update: the bytes of `messages`, with the version of the surface that each belongs to.
    on_news: called after each change, from the session's thread.
    """

    def __init__(self) -> None:
        self.texts: dict[str, tuple[int, str]] = {}
        self.notices: list[tuple[int, str]] = []
        self.topology: tuple[int, bytes] = (0, b"")
        self.update: tuple[int, int, bytes] = (0, 0, b"")
        self.viewers = 0
        self.on_news: Callable[[], None] = lambda: None
        self._count = 0
        self._lock = threading.Lock()

    def tell(self, kind: str, **content: Any) -> None:
        """Send a text message; it takes the place of the last one of its kind."""
        with self._lock:
            self._count += 1
            self.texts = {**self.texts, kind: (self._count, json.dumps({"type": kind, **content}))}
        self.on_news()

    def notice(self, text: str, *, level: str = "info") -> None:
        """Tell a person something; the last few are kept."""
        with self._lock:
            self._count += 1
            entry = self._count, json.dumps({"type": "notice", "text": text, "level": level})
            self.notices = [*self.notices[-9:], entry]
        self.on_news()

    def show(self, version: int, number: int, update: bytes, topology: bytes | None = None) -> None:
        """Send where things are; with `topology`, if the surface is another one."""
        if topology is not None:
            self.topology = version, topology
        self.update = version, number, update
        self.on_news()

    def news(self, after: int) -> tuple[int, list[str]]:
        """All texts since the message with the number `after`, in order, and the number of the last one."""
        with self._lock:
            found = sorted(entry for entry in (*self.texts.values(), *self.notices) if entry[0] > after)
            return self._count, [text for _, text in found]
