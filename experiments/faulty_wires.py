"""Wires of a flight on loopback that can fail: cut, lossy, noisy; and receivers and radars that send over them."""

import contextlib
import math
import select
import socket
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experiments.loopback import HOST
from experiments.made_reports import made_report
from wideberth.frames import LocalFrame
from wideberth.links.asterix.encode import AsterixEncoder
from wideberth.links.radar_udp import encode_radar
from wideberth.live.senders import TrafficPackets
from wideberth.sensors.adsb import squitters
from wideberth.types import FloatArray

Send = Callable[[bytes], None]

TRAFFIC = {"gdl90": "udp", "beast": "tcp", "avr": "tcp", "sbs": "tcp", "uat": "tcp"}
DATAGRAM = 65536
NOISE = 500  # bytes of a piece of noise
HOLD = 5  # tenths of a second that a late packet may be held


@dataclass(slots=True)
class Fault:
    """What a wire does to the packets on it.

    Attributes
    ----------
    cut : bool
    loss, repeat, late : float
        Probability that a packet is lost, comes twice, or late and so behind others.
    noise : int
        Random bytes with each tenth of a second.
    """

    cut: bool = False
    loss: float = 0.0
    repeat: float = 0.0
    late: float = 0.0
    noise: int = 0


class FaultyWire:
    """Passes packets on, as far as its fault lets it."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.fault = Fault()
        self.noise_bytes = 0
        self._rng = rng
        self._held: list[tuple[int, bytes, Send]] = []

    def carry(self, data: bytes, send: Send) -> None:
        """Pass on a packet."""
        fault, rng = self.fault, self._rng
        if fault.cut or rng.random() < fault.loss:
            return
        if rng.random() < fault.late:
            self._held.append((int(rng.integers(1, HOLD + 1)), data, send))
            return
        send(data)
        if rng.random() < fault.repeat:
            send(data)

    def tick(self, send: Send) -> None:
        """Let a tenth of a second pass: send what was held until now, and noise."""
        held, self._held = self._held, []
        for left, data, to in held:
            if left > 1:
                self._held.append((left - 1, data, to))
            else:
                to(data)
        left = self.fault.noise
        while left > 0:
            piece = self._rng.bytes(min(left, NOISE))
            send(piece)
            self.noise_bytes += len(piece)
            left -= len(piece)


class DatagramEnd:
    """Sends datagrams to a port of loopback."""

    def __init__(self, port: int) -> None:
        self._peer = (HOST, port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def send(self, data: bytes) -> None:
        """Send one; where nobody listens it is lost."""
        with contextlib.suppress(OSError):
            self._socket.sendto(data, self._peer)

    def open(self, *, whether: bool) -> None:
        """Do nothing: datagrams have no connection."""


class ServerEnd:
    """Sends to whoever has connected to a port of loopback; closed it refuses connections."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._listening: socket.socket | None = None
        self._clients: list[socket.socket] = []
        self.open(whether=True)

    def send(self, data: bytes) -> None:
        """Send to all, and take those in who wait."""
        if self._listening is None:
            return
        while select.select([self._listening], [], [], 0.0)[0]:
            client, _ = self._listening.accept()
            client.settimeout(0.05)
            self._clients.append(client)
        for client in tuple(self._clients):
            try:
                client.sendall(data)
            except OSError:
                client.close()
                self._clients.remove(client)

    def open(self, *, whether: bool) -> None:
        """Open the port, or close it and break all connections."""
        if whether and self._listening is None:
            self._listening = socket.create_server((HOST, self._port))
        elif not whether and self._listening is not None:
            for one in (self._listening, *self._clients):
                one.close()
            self._listening, self._clients = None, []


class Relay:
    """A vehicle's link to the program by way of a wire in both directions."""

    def __init__(self, port: int, program: int, wire: FaultyWire) -> None:
        self._wire = wire
        self._program = (HOST, program)
        self._near = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._near.bind((HOST, port))
        self._far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._far.bind((HOST, 0))
        self._vehicle: tuple[str, int] | None = None

    def serve(self, seconds: float) -> None:
        """Carry what comes within some time, or the first of it."""
        ready, _, _ = select.select([self._near, self._far], [], [], max(seconds, 0.0))
        for one in ready:
            with contextlib.suppress(OSError):
                data, peer = one.recvfrom(DATAGRAM)
                if one is self._near:
                    self._vehicle = peer
                    self._wire.carry(data, self.to_program)
                elif self._vehicle is not None:
                    self._wire.carry(data, self._to_vehicle)

    def to_program(self, data: bytes) -> None:
        """Send to the program."""
        with contextlib.suppress(OSError):
            self._far.sendto(data, self._program)

    def _to_vehicle(self, data: bytes) -> None:
        assert self._vehicle is not None
        with contextlib.suppress(OSError):
            self._near.sendto(data, self._vehicle)


class RadarSource:
    """A radar on the ground at the origin that sees one aircraft, ten times a second, in our packets or ASTERIX."""

    def __init__(self, kind: str) -> None:
        self.clock_error = 0.0
        self._asterix = AsterixEncoder(0, 7) if kind == "asterix" else None
        self._step = 0

    def packet(self, t: float, position: FloatArray, velocity: FloatArray) -> bytes:
        """Return the scan of time `t`, Unix s, of an aircraft (3,), NED."""
        r = float(np.linalg.norm(position))
        rate = float(position @ velocity) / r
        z = np.array([[r, math.atan2(position[1], position[0]) % (2.0 * math.pi), math.asin(-position[2] / r), rate]])
        self._step += 1
        if self._asterix is not None:
            return self._asterix.plots(t + self.clock_error, z)
        return encode_radar(1, self._step, t + self.clock_error, z, np.array([[3.0, 0.01, 0.01, 0.5]]))


class TrafficSource:
    """A receiver that hears one aircraft once a second."""

    def __init__(self, kind: str, number: int, frame: LocalFrame) -> None:
        self._packets = None if kind == "avr" else TrafficPackets(kind)
        self._number, self._frame = number, frame

    def packets(self, t: float, position: FloatArray, velocity: FloatArray) -> list[bytes]:
        """Return what the receiver gives out at time `t`, Unix s, of its aircraft (3,), NED."""
        number = self._number
        report = made_report(t, 0xB00000 + number, f"FAULT{number}", self._frame, position, velocity)
        if self._packets is not None:
            return self._packets.encode([report], t)
        return [f"*{frame.hex()};\n".encode() for frame in squitters.encode(report)]
