"""The server alone: who gets in, what it does with nonsense, and that nobody holds up anybody."""

import http.client
import socket
import time
from urllib.parse import urlsplit

import numpy as np
import pytest
from serving import Client
from websockets.exceptions import ConnectionClosed, InvalidStatus

from taichifem import InputError
from taichifem.live.broadcast import Broadcast
from taichifem.live.inbox import Inbox
from taichifem.live.server import LARGEST, MOST_NONSENSE, MOST_VIEWERS, Server


@pytest.fixture
def server():
    made = Server(Broadcast(), Inbox(), port=0)
    made.start()
    yield made
    made.close()


def update(number, version=1, bytes_=48):
    head = np.array([2, version, number, 0, 0, 0, 0, 0], "<u4").tobytes()
    return version, number, head + bytes(bytes_ - 32)


def show(server, number, version=1, bytes_=48):
    topology = np.array([1, version, 0, 0, 0, 0], "<u4").tobytes() if number == 1 else None
    server._out.show(*update(number, version, bytes_), topology)


def get(server, path, host=None):
    place = urlsplit(server.url).netloc
    connection = http.client.HTTPConnection(place, timeout=10)
    connection.request("GET", path, headers={"Host": host or place})
    answer = connection.getresponse()
    return answer.status, answer.getheader("Content-Type"), answer.read().decode()


def test_the_page_and_its_modules_are_served_and_nothing_else(server):
    status, kind, text = get(server, "/?token=x")
    assert (status, kind) == (200, "text/html; charset=utf-8") and "main.js" in text
    status, kind, text = get(server, "/main.js")
    assert status == 200 and kind.startswith("text/javascript") and "WebSocket" in text
    for line in text.splitlines():
        if line.startswith("import"):
            assert get(server, line.split("'")[1][1:])[0] == 200, line
    for path in ("/nothing", "/../server.py", "/%2e%2e/server.py", "/page/main.js", "//etc/passwd"):
        assert get(server, path)[0] == 404
    assert server.url.startswith("http://127.0.0.1:") and server.token not in text


@pytest.mark.parametrize(
    "changes", [{"origin": "http://evil.example"}, {"origin": ""}, {"token": "wrong"}, {"token": ""}]
)
def test_foreign_or_missing_origin_and_a_wrong_token_are_refused(server, changes):
    with pytest.raises(InvalidStatus) as refusal:
        Client(server.url, **changes)
    assert refusal.value.response.status_code == 403


def test_foreign_names_are_refused_and_other_ports_of_this_machine_are_not(server):
    assert get(server, "/", host="evil.example")[0] == 403
    assert get(server, "/", host="evil.example:80")[0] == 403
    assert get(server, "/", host="localhost:9999")[0] == 200  # what ssh -L makes of it


def test_a_taken_port_and_a_foreign_address_are_one_line_each(server):
    port = urlsplit(server.url).port
    with pytest.raises(InputError, match=f"port {port} of 127.0.0.1 is taken: choose another with --port"):
        Server(Broadcast(), Inbox(), port=port).start()
    with pytest.raises(InputError, match="cannot be used"):
        Server(Broadcast(), Inbox(), host="203.0.113.7", port=0).start()


def test_whoever_comes_later_learns_what_was_told_before(server):
    server._out.tell("hello", name="a")
    server._out.tell("state", paused=False)
    server._out.tell("state", paused=True)
    server._out.notice("look")
    show(server, 1)
    with Client(server.url) as client:
        client.until(lambda: client.updates == 1)
        assert client.last["hello"]["name"] == "a" and client.last["state"]["paused"] is True
        assert client.notices == ["look"]
        assert server._out.viewers == 1


def test_a_browser_that_draws_slowly_gets_the_newest_and_does_not_hold_up_the_others(server):
    show(server, 1)
    with Client(server.url) as slow, Client(server.url) as quick:
        seen = []
        while len(seen) < 2 or seen[-1] < 50:
            if seen:
                show(server, seen[-1] + 1, bytes_=100_000)
            while quick.read()[0] != "update":
                pass
            seen.append(seen[-1] + 1 if seen else 1)
        numbers = []
        with pytest.raises(TimeoutError):
            while True:
                kind, number = slow.read(draw=False, timeout=0.5)
                numbers += [number] if kind == "update" else []
        assert len(numbers) == 2  # as many as may be on their way
        slow.send(drawn=numbers[-1])
        while slow.read()[0] != "update":
            pass
        assert slow.updates == 3


def test_garbage_is_borne_for_a_while_and_oversize_not_at_all(server):
    with Client(server.url) as client, Client(server.url) as other:
        for text in ("", "{", "null", "[1, 2]", '"x"', "NaN", "[" * 5000):
            client.socket.send(text)
        client.socket.send(b"\x00\xff")
        client.send(do="set", path="a", value=1)
        for _ in range(100):
            if waiting := server._inbox.take(0.1):
                break
        assert waiting == [{"do": "set", "path": "a", "value": 1}]
        with pytest.raises(ConnectionClosed):
            for _ in range(MOST_NONSENSE + 1):
                client.socket.send("nonsense")
            client.socket.recv(timeout=10)
            client.socket.recv(timeout=10)
        other.socket.send("x" * (LARGEST + 1))
        with pytest.raises(ConnectionClosed) as closed:
            other.socket.recv(timeout=10)
        assert closed.value.rcvd.code == 1009
    with Client(server.url) as again:
        again.send(ask="pause")
        assert server._inbox.take(5) == [{"ask": "pause"}]


def test_a_flood_is_bounded_and_viewers_too(server):
    with Client(server.url) as client:
        for k in range(3000):
            client.send(ask=str(k))
        client.until(lambda: any("too much at once" in text for text in client.notices))
        assert len(server._inbox.take()) <= 500
    clients = []
    try:
        with pytest.raises(InvalidStatus) as refusal:
            for _ in range(MOST_VIEWERS + 5):
                clients.append(Client(server.url))
        assert refusal.value.response.status_code == 503
    finally:
        for client in clients:
            client.close()


def test_a_browser_that_vanishes_is_forgotten(server):
    client = Client(server.url)
    client.socket.socket.shutdown(socket.SHUT_RDWR)
    for _ in range(100):
        if server._out.viewers == 0:
            break
        time.sleep(0.05)
    assert server._out.viewers == 0
    assert get(server, "/")[0] == 200
