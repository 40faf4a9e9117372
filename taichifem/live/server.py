"""The web server behind the live view: the page, and a socket for each browser. It runs in a thread of its own.

A browser that is slow gets fewer updates, and one that is gone costs nothing: each has a task that sends it the
newest of everything once it has said that it has drawn what came before.
"""

from __future__ import annotations

import asyncio
import hmac
import http
import json
import secrets
import threading
from contextlib import suppress
from importlib import resources
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server as SocketServer
from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from taichifem.errors import InputError
from taichifem.live.broadcast import Broadcast
from taichifem.live.inbox import Inbox

PORT = 8642
LARGEST = 8192
"""Bytes of a message from a browser at most."""

AHEAD = 2
"""Updates that may be on their way to a browser."""

MOST_VIEWERS = 16
MOST_NONSENSE = 50
"""Messages that are none, after which a browser is sent away."""

LOCAL = ("127.0.0.1", "localhost", "[::1]")
TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; img-src 'self' data:"
)


class Server:
    """Serves the page on host:port from `start` on, until `close`.

    url: what to open in a browser; it holds the token, without which nobody gets a socket.
    """

    def __init__(self, out: Broadcast, inbox: Inbox, *, host: str = "127.0.0.1", port: int = PORT) -> None:
        self.token = secrets.token_urlsafe(16)
        self._out, self._inbox, self._host, self._port = out, inbox, host, port
        self._loop = asyncio.new_event_loop()
        self._server: SocketServer | None = None
        self._thread = threading.Thread(target=self._loop.run_forever, name="live server", daemon=True)
        self._news: set[asyncio.Event] = set()
        self._viewers = 0
        self._pages = _pages()

    @property
    def url(self) -> str:
        """Where the page is."""
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{host}:{self._port}/?token={self.token}"

    def start(self) -> None:
        """Listen. Raises InputError if the port is taken, or the address is none of this machine."""
        self._thread.start()
        try:
            asyncio.run_coroutine_threadsafe(self._listen(), self._loop).result()
        except OSError as error:
            self._end()
            taken = "is taken" if error.errno in (48, 98, 10048) else f"cannot be used ({error.strerror or error})"
            raise InputError(f"port {self._port} of {self._host} {taken}: choose another with --port") from None
        self._out.on_news = self._wake

    def close(self) -> None:
        """Send everybody away and stop."""
        self._out.on_news = lambda: None
        asyncio.run_coroutine_threadsafe(self._stop(), self._loop).result(timeout=5)
        self._end()

    async def _listen(self) -> None:
        self._server = await serve(
            self._welcome,
            self._host,
            self._port,
            process_request=self._request,
            max_size=LARGEST,
            compression=None,
            ping_interval=10,
            ping_timeout=20,
            close_timeout=2,
        )
        self._port = self._server.sockets[0].getsockname()[1]

    async def _stop(self) -> None:
        self._server.close(close_connections=True)
        with suppress(TimeoutError):
            await asyncio.wait_for(self._server.wait_closed(), 3)

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=5)

    def _wake(self) -> None:
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(lambda: [event.set() for event in self._news])

    # Requests

    def _request(self, connection: ServerConnection, request: Request) -> Response | None:
        """A file of the page, or None to go on with a socket that may be opened."""
        parts, host = urlsplit(request.path), request.headers.get("Host", "")
        if not self._known(host):
            return _answer(http.HTTPStatus.FORBIDDEN, "this page is not served under that name")
        if parts.path == "/socket":
            token = parse_qs(parts.query).get("token", [""])[0]
            if request.headers.get("Origin", "") != f"http://{host}":
                return _answer(http.HTTPStatus.FORBIDDEN, "sockets are for the page that comes from here")
            if not hmac.compare_digest(token.encode(), self.token.encode()):
                return _answer(http.HTTPStatus.FORBIDDEN, "wrong token: use the address that was printed")
            if self._viewers >= MOST_VIEWERS:
                return _answer(http.HTTPStatus.SERVICE_UNAVAILABLE, "too many are watching")
            return None
        page = self._pages.get(parts.path)
        if page is None:
            return _answer(http.HTTPStatus.NOT_FOUND, "there is no such page")
        return _answer(http.HTTPStatus.OK, *page)

    def _known(self, host: str) -> bool:
        """Is `host` a name of this server? A name that a foreign page made lead here is none."""
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdecimal() else host
        if self._host in ("0.0.0.0", "::"):
            return bool(name)  # under whatever name the machine has; the token decides
        return name in (*LOCAL, self._host, f"[{self._host}]")

    # Sockets

    async def _welcome(self, socket: ServerConnection) -> None:
        viewer = _Viewer(socket, self._out, self._inbox)
        self._news.add(viewer.news)
        self._viewers += 1
        self._out.viewers = self._viewers
        try:
            sending = asyncio.create_task(viewer.send())
            try:
                await viewer.receive()
            finally:
                sending.cancel()
                with suppress(asyncio.CancelledError, ConnectionClosed):
                    await sending
        finally:
            self._news.discard(viewer.news)
            self._viewers -= 1
            self._out.viewers = self._viewers


class _Viewer:
    """One browser."""

    def __init__(self, socket: ServerConnection, out: Broadcast, inbox: Inbox) -> None:
        self._socket, self._out, self._inbox = socket, out, inbox
        self.news = asyncio.Event()
        self.news.set()
        self._last_text = self._version = self._number = self._drawn = 0
        self._sent: list[int] = []

    async def send(self) -> None:
        """Send what is new, whenever something is."""
        with suppress(ConnectionClosed):
            while True:
                await self.news.wait()
                self.news.clear()
                self._last_text, texts = self._out.news(self._last_text)
                for text in texts:
                    await self._socket.send(text)
                await self._send_update()

    async def _send_update(self) -> None:
        version, number, update = self._out.update
        if number == self._number or len(self._sent) >= AHEAD:
            return
        surface, topology = self._out.topology
        if surface != version:
            return  # one of the two is newer: more news is coming
        if surface != self._version:
            await self._socket.send(topology)
            self._version = surface
        self._sent.append(number)
        self._number = number
        await self._socket.send(update)

    async def receive(self) -> None:
        """Take messages until the browser goes."""
        nonsense = 0
        with suppress(ConnectionClosed):
            async for message in self._socket:
                try:
                    content = json.loads(message) if isinstance(message, str) else None
                except (ValueError, RecursionError):
                    content = None
                if isinstance(content, dict) and isinstance(content.get("drawn"), int):
                    self._sent = [number for number in self._sent if number > content["drawn"]]
                    self.news.set()
                elif not isinstance(content, dict):
                    nonsense += 1
                    if nonsense > MOST_NONSENSE:
                        await self._socket.close(1008, "nonsense")
                elif not self._inbox.put(content):
                    self._out.notice("too much at once: some of it was left out", level="error")


def _pages() -> dict[str, tuple[bytes, str]]:
    """The files of the page: their content and type by the path they are asked for."""
    found = {}
    for file in resources.files("taichifem.live").joinpath("page").iterdir():
        kind = TYPES.get(file.name[file.name.rfind(".") :])
        if kind is not None:
            found["/" if file.name == "index.html" else f"/{file.name}"] = file.read_bytes(), kind
    return found


def _answer(status: http.HTTPStatus, body: str | bytes, kind: str = "text/plain") -> Response:
    content = body.encode() if isinstance(body, str) else body
    headers = Headers(
        {
            "Content-Type": f"{kind}; charset=utf-8",
            "Content-Length": str(len(content)),
            "Content-Security-Policy": POLICY,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cache-Control": "no-store",
            "Connection": "close",
        }
    )
    return Response(status.value, status.phrase, headers, content)
