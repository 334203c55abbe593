"""Addresses, queues and the ends of links, on loopback."""

import asyncio
import os
import pty
import socket

import pytest

from wideberth.errors import InputError
from wideberth.live.addresses import Address, parse_address
from wideberth.live.autopilot import DATAGRAM_MAX, datagrams
from wideberth.live.packet_queue import Arrivals, PacketQueue
from wideberth.live.serial_port import SerialEndpoint
from wideberth.live.transports import Backoff, TcpEndpoint, TcpServerEndpoint, UdpEndpoint, make_endpoint


@pytest.mark.parametrize(
    ("text", "kind", "address"),
    [
        ("udp:127.0.0.1:14550", "tcp", Address("udp", "127.0.0.1", 14550)),
        ("udpin:0.0.0.0:14550", "tcp", Address("udp", "0.0.0.0", 14550)),
        ("udpout:drone.local:14550", "udp", Address("udpout", "drone.local", 14550)),
        ("tcp:[::1]:5760", "udp", Address("tcp", "::1", 5760)),
        ("serial:/dev/ttyUSB0:57600", "udp", Address("serial", "/dev/ttyUSB0", 57600)),
        ("30100", "udp", Address("udp", "127.0.0.1", 30100)),
        (":30100", "tcpin", Address("tcpin", "127.0.0.1", 30100)),
        ("receiver:30005", "tcp", Address("tcp", "receiver", 30005)),
        ("tcp://receiver:30005", "udp", Address("tcp", "receiver", 30005)),
    ],
)
def test_addresses(text, kind, address):
    assert parse_address(text, kind) == address


@pytest.mark.parametrize("text", ["", "udp", "udp:host", "udp:host:port", "tcp:5760", "host:70000", "serial:/dev/tty"])
def test_what_is_no_address_is_refused_with_what_to_write(text):
    with pytest.raises(ValueError, match="write"):
        parse_address(text, "tcp")


def test_nothing_listens_beyond_loopback_unless_told():
    assert parse_address("30100").host == "127.0.0.1"


def test_a_full_queue_drops_the_oldest_and_counts_it():
    queue = PacketQueue(packets_max=3, bytes_max=100)
    for k in range(5):
        queue.put(float(k), bytes([k]))
    assert queue.dropped == 2 and len(queue) == 3
    assert [queue.take() for _ in range(4)] == [(2.0, b"\2"), (3.0, b"\3"), (4.0, b"\4"), None]
    queue.put(1.0, b"a" * 60)
    queue.put(2.0, b"b" * 60)
    assert queue.dropped == 3 and queue.take() == (2.0, b"b" * 60)
    queue.put(3.0, b"c" * 1000)  # larger than the queue: the newest is kept all the same
    assert queue.take() == (3.0, b"c" * 1000)


def test_age_and_rate_of_arrivals():
    arrivals = Arrivals()
    assert arrivals.age(5.0) == float("inf") and arrivals.rate(5.0) == 0.0
    for k in range(1000):
        arrivals.note(100.0 + k * 0.01)
    assert arrivals.count == 1000
    assert arrivals.age(110.0) == pytest.approx(0.01)
    assert arrivals.rate(109.99) == pytest.approx(100.0, rel=0.02)
    assert arrivals.rate(125.0) == 0.0


def test_waits_grow_and_start_again_after_a_success():
    backoff = Backoff(0.5, 3.0)
    assert [backoff.next(False) for _ in range(4)] == [0.5, 1.0, 2.0, 3.0]
    assert backoff.next(True) == 0.5
    assert backoff.next(False) == 1.0


def test_many_messages_go_into_datagrams_that_are_whole():
    two = b"\xfd" + bytes([50]) + bytes(8 + 50 + 2)
    signed = b"\xfd" + bytes([50, 1]) + bytes(7 + 50 + 2 + 13)
    one = b"\xfe" + bytes([20]) + bytes(4 + 20 + 2)
    data = (two + signed + one) * 40
    pieces = datagrams(data)
    assert b"".join(pieces) == data and all(len(piece) <= DATAGRAM_MAX for piece in pieces)
    assert all(piece[0] in (0xFD, 0xFE) for piece in pieces)
    assert datagrams(b"") == [] and datagrams(b"abc") == [b"abc"]
    assert datagrams(b"z" * 5000) == [b"z" * 5000]


async def until(condition, timeout=10.0):
    async with asyncio.timeout(timeout):
        while not condition():
            await asyncio.sleep(0.01)


def now():
    return asyncio.get_running_loop().time()


def test_udp_hears_everyone_and_answers_its_peer():
    async def scene():
        queue = PacketQueue()
        end = UdpEndpoint(Address("udp", "127.0.0.1", 0), queue, now)
        await end.open()
        assert not end.send(b"early") and end.counters["not sent: no peer yet"] == 1
        other_queue = PacketQueue()
        other = UdpEndpoint(Address("udpout", "127.0.0.1", end.port), other_queue, now)
        await other.open()
        assert other.send(b"hello")
        await until(lambda: len(queue) == 1)
        assert queue.take()[1] == b"hello"
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.sendto(b"me too", ("127.0.0.1", end.port))
            await until(lambda: len(queue) == 1)
        assert end.send(b"answer")
        await until(lambda: len(other_queue) == 1)
        assert other_queue.take()[1] == b"answer"
        assert end.counters["datagrams of another peer"] == 1
        other.close()
        end.close()
        assert end.trouble() == "closed" and not end.send(b"late")

    asyncio.run(scene())


def test_a_port_in_use_is_an_error_that_names_it():
    async def scene():
        first = UdpEndpoint(Address("udp", "127.0.0.1", 0), PacketQueue(), now)
        await first.open()
        second = make_endpoint(Address("udp", "127.0.0.1", first.port), PacketQueue(), now)
        with pytest.raises(InputError, match=f"127.0.0.1:{first.port}: cannot listen there: address already in use"):
            await second.open()
        first.close()

    asyncio.run(scene())


def test_a_tcp_client_connects_again_and_marks_the_break():
    async def scene():
        server_queue, queue = PacketQueue(), PacketQueue()
        server = TcpServerEndpoint(Address("tcpin", "127.0.0.1", 0), server_queue, now)
        await server.open()
        port = server.port
        client = TcpEndpoint(Address("tcp", "127.0.0.1", port), queue, now, waits=(0.05, 0.1))
        assert not client.send(b"too early") and client.counters["not sent: not connected"] == 1
        await client.open()
        await until(lambda: not server.trouble() and not client.trouble())
        assert server.send(b"one")
        await until(lambda: len(queue) == 1)
        server.close()
        await until(lambda: client.trouble().startswith("reconnecting") and len(queue) == 2)
        assert [queue.take()[1], queue.take()[1]] == [b"one", b""]
        await until(lambda: "refused" in client.trouble())
        again = TcpServerEndpoint(Address("tcpin", "127.0.0.1", port), server_queue, now)
        await again.open()
        await until(lambda: not client.trouble())
        assert client.send(b"back") and client.counters["connections"] == 2
        await until(lambda: any(data == b"back" for data in drained(server_queue)))
        client.close()
        again.close()

    def drained(queue):
        while (packet := queue.take()) is not None:
            yield packet[1]

    asyncio.run(scene())


def test_a_server_hears_who_connects_last():
    async def scene():
        queue = PacketQueue()
        server = TcpServerEndpoint(Address("tcpin", "127.0.0.1", 0), queue, now)
        await server.open()
        assert server.trouble() == "no client is connected" and not server.send(b"x")
        first = await asyncio.open_connection("127.0.0.1", server.port)
        await until(lambda: not server.trouble())
        second = await asyncio.open_connection("127.0.0.1", server.port)
        with pytest.raises((asyncio.IncompleteReadError, ConnectionError)):
            await first[0].readexactly(1)
        second[1].write(b"hi")
        await until(lambda: any(data == b"hi" for _, data in queue._packets))
        second[1].close()
        first[1].close()
        server.close()

    asyncio.run(scene())


def test_a_serial_port_carries_raw_bytes_and_is_opened_again(tmp_path):
    async def scene():
        ours, theirs = pty.openpty()
        link = tmp_path / "ttyTEST"
        link.symlink_to(os.ttyname(theirs))
        queue = PacketQueue()
        end = SerialEndpoint(Address("serial", str(link), 57600), queue, now, waits=(0.05, 0.1))
        await end.open()
        os.close(theirs)
        assert end.trouble() == ""
        everything = bytes(range(256))
        os.write(ours, everything)
        await until(lambda: sum(len(data) for _, data in queue._packets) == 256)
        assert b"".join(data for _, data in queue._packets) == everything
        assert end.send(everything)
        assert os.read(ours, 1000) == everything
        os.close(ours)  # the cable is pulled
        await until(lambda: end.trouble().startswith("trying again"))
        assert queue._packets[-1][1] == b"" and not end.send(b"x")
        ours, theirs = pty.openpty()
        link.unlink()
        link.symlink_to(os.ttyname(theirs))
        await until(lambda: end.trouble() == "")
        assert end.counters["connections"] == 2
        end.close()
        os.close(ours)
        os.close(theirs)

    asyncio.run(scene())


def test_a_serial_port_that_is_not_there_or_has_no_such_speed_is_waited_for(tmp_path):
    async def scene():
        end = SerialEndpoint(Address("serial", str(tmp_path / "none"), 57600), PacketQueue(), now)
        await end.open()
        assert "no such file" in end.trouble()
        end.close()
        ours, theirs = pty.openpty()
        end = SerialEndpoint(Address("serial", os.ttyname(theirs), 57601), PacketQueue(), now)
        await end.open()
        assert "no speed of 57601 baud" in end.trouble()
        end.close()
        os.close(ours)
        os.close(theirs)

    asyncio.run(scene())
