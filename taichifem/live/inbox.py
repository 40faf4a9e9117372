"""What browsers ask for, waiting for the next step: bounded, and of what is repeated only the last."""

from __future__ import annotations

import threading
from typing import Any

MOST = 500


class Inbox:
    """Messages for the session. Sliders and drags that come faster than steps take the place of one another."""

    def __init__(self) -> None:
        self._waiting: dict[Any, dict] = {}
        self._came = threading.Condition()
        self._count = 0

    def put(self, message: dict) -> bool:
        """Add a message; False if too many wait."""
        with self._came:
            self._count += 1
            key: Any = self._count
            if message.get("do") in ("set", "drag", "strength"):
                key = message["do"], str(message.get("path", message.get("hand")))
            if len(self._waiting) >= MOST and key not in self._waiting:
                return False
            self._waiting[key] = message
            self._came.notify()
            return True

    def take(self, wait: float = 0.0) -> list[dict]:
        """All that waits, after at most `wait` seconds if there is nothing yet."""
        with self._came:
            if not self._waiting and wait > 0:
                self._came.wait(wait)
            found, self._waiting = list(self._waiting.values()), {}
            return found
