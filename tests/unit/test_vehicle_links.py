"""Links of a simulated vehicle: who calls is answered, and no fault of a network ends them."""

import errno
import socket

import pytest

from wideberth.errors import InputError
from wideberth.live import vehicle_links
from wideberth.live.vehicle_links import VehicleLinks

HOST = "127.0.0.1"


def port_of_nobody(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    with socket.socket(socket.AF_INET, kind) as one:
        one.bind((HOST, 0))
        return int(one.getsockname()[1])


def caller() -> socket.socket:
    ours = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    ours.bind((HOST, 0))
    ours.settimeout(10.0)
    return ours


class Faulty:
    """A socket whose calls fail as told, and work otherwise."""

    def __init__(self, whole: socket.socket, **faults: int) -> None:
        self.whole, self.faults = whole, faults

    def __getattr__(self, name: str):
        if name in self.faults:

            def fail(*_: object) -> None:
                raise OSError(self.faults[name], "")

            return fail
        return getattr(self.whole, name)


def test_who_calls_is_answered_until_it_is_silent(monkeypatch) -> None:
    port = port_of_nobody()
    with VehicleLinks([], answer=(HOST, port)) as links, caller() as one, caller() as other:
        links.send(b"nobody is there")
        for each in (one, other):
            each.sendto(b"hello", (HOST, port))
        links.wait(10.0)
        assert links.receive() == [b"hello", b"hello"]
        links.send(b"frame")
        assert one.recv(100) == other.recv(100) == b"frame"
        monkeypatch.setattr(vehicle_links, "HEARD_FOR", -1.0)
        links.send(b"late")
        one.setblocking(False)
        with pytest.raises(BlockingIOError):
            one.recv(100)


def test_of_a_crowd_the_last_callers_are_answered() -> None:
    port = port_of_nobody()
    with VehicleLinks([], answer=(HOST, port)) as links:
        crowd = [caller() for _ in range(vehicle_links.CALLERS_MAX + 1)]
        for each in crowd:
            each.sendto(b"hello", (HOST, port))
            links.wait(10.0)
            links.receive()
        links.send(b"frame")
        assert crowd[-1].recv(100) == b"frame"
        crowd[0].setblocking(False)
        with pytest.raises(BlockingIOError):
            crowd[0].recv(100)
        for each in crowd:
            each.close()


@pytest.mark.parametrize("cause", [errno.EHOSTUNREACH, errno.ENETUNREACH, errno.EPERM, errno.EACCES, errno.EIO])
def test_datagrams_that_cannot_be_sent_are_told_once_and_tried_again(cause) -> None:
    told: list[str] = []
    with caller() as one, VehicleLinks([one.getsockname()], tell=told.append) as links:
        whole, name = links._udp, f"udp {HOST}:{one.getsockname()[1]}"
        links._udp = Faulty(whole, sendto=cause, recvfrom=cause)  # type: ignore[assignment]
        for _ in range(3):
            links.send(b"frame")
        assert links.receive() == []
        assert [text.split(":")[0] for text in told] == ["udp " + HOST, "udp"]
        assert links.faults[next(key for key in links.faults if key.startswith(name))] == 3
        links._udp = whole
        links.send(b"frame")
        assert one.recv(100) == b"frame"
        assert told[-1] == f"{name}: works again"


@pytest.mark.parametrize("call", ["recv", "send"])
def test_a_client_whose_line_breaks_is_told_and_left_and_may_come_back(call) -> None:
    told: list[str] = []
    port = port_of_nobody(socket.SOCK_STREAM)
    with VehicleLinks([], listen=(HOST, port), tell=told.append) as links:
        for broken in (True, False):
            with socket.create_connection((HOST, port)) as ours:
                ours.sendall(b"hello")
                ours.settimeout(10.0)
                received: list[bytes] = []
                while not received:
                    links.wait(10.0)
                    received = links.receive()
                if broken:
                    client, name = links._clients.popitem()
                    links._clients[Faulty(client, **{call: errno.EHOSTUNREACH})] = name  # type: ignore[index]
                    links.send(b"frame")
                    links.receive()
                    assert not links._clients
                    assert told == [f"{name}: no route to host; going on"]
                else:
                    links.send(b"frame")
                    assert ours.recv(100) == b"frame"


def test_a_server_and_a_wait_that_fail_do_not_end_it() -> None:
    told: list[str] = []
    with VehicleLinks([], listen=(HOST, port_of_nobody(socket.SOCK_STREAM)), tell=told.append) as links:
        whole = links._server
        assert whole is not None
        links._server = Faulty(whole, accept=errno.EMFILE, fileno=errno.EBADF)  # type: ignore[assignment]
        for _ in range(3):
            assert links.receive() == []
        links.wait(0.01)
        assert told == ["tcp: too many open files; going on", "waiting: bad file descriptor; going on"]
        links._server = whole


@pytest.mark.parametrize("kind", ["listen", "answer"])
def test_a_port_in_use_is_said(kind) -> None:
    type_ = socket.SOCK_STREAM if kind == "listen" else socket.SOCK_DGRAM
    with socket.socket(socket.AF_INET, type_) as taken:
        taken.bind((HOST, 0))
        if kind == "listen":
            taken.listen()
        where = taken.getsockname()
        with pytest.raises(InputError, match=f"cannot listen on {HOST}:{where[1]}: address already in use"):
            VehicleLinks([], **{kind: where})
