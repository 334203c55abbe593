"""Scans and reports onto the wire in real time, so that everything can be tried without hardware."""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from wideberth.errors import InputError
from wideberth.frames import euler_angles
from wideberth.links.config import ThesisPacketConfig
from wideberth.links.radar_udp import encode_radar, encode_thesis
from wideberth.live.sender_outputs import Output
from wideberth.sensors.adsb import beast, sbs_encoder, squitters
from wideberth.sensors.adsb.gdl90 import of_report as gdl90
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.adsb.uat import of_report as uat
from wideberth.types import Scan

T = TypeVar("T")

RADAR_FORMATS = ("wideberth", "thesis", "asterix")
TRAFFIC_PORTS = {"gdl90": 4000, "sbs": 30003, "beast": 30005, "uat": 30978, "asterix": 30021}
"""Formats of traffic, and the ports that their receivers are used to."""

DATAGRAM_FORMATS = ("gdl90", "asterix")
_TICKS = 12e6
_LEVEL = 1e-6
_LATE = 0.5
_REPORTS_IN_A_BLOCK = 100


class RadarPackets:
    """Turns scans into packets.

    Parameters
    ----------
    fmt : {"wideberth", "thesis", "asterix"}
    first_id : int
        Number of the radar that is heard first; others follow. In ASTERIX 256 SAC + SIC.
    thesis : ThesisPacketConfig, optional

    Raises
    ------
    InputError
        If there is no such format, or libasterix is needed and not there.
    """

    def __init__(self, fmt: str, first_id: int = 1, thesis: ThesisPacketConfig | None = None) -> None:
        if fmt not in RADAR_FORMATS:
            raise InputError(f"radar packets '{fmt}' are not known: use one of {', '.join(RADAR_FORMATS)}")
        self._format, self._first_id, self._thesis = fmt, first_id, thesis
        self._ids: dict[str, int] = {}
        self._sequences: Counter[str] = Counter()
        self._asterix: dict[str, Any] = {}
        if fmt == "asterix":
            self._encoder(first_id)

    def encode(self, scan: Scan, t: float) -> bytes:
        """Return the packet of a scan that was true at time `t`, Unix s.

        Raises
        ------
        InputError
            If the format cannot carry it: a second radar in the thesis's packets, a tilted one or a line array in
            ASTERIX, or too many plots.
        """
        number = self._ids.setdefault(scan.sensor, self._first_id + len(self._ids))
        try:
            if self._format == "thesis":
                if len(self._ids) > 1:
                    raise InputError(
                        "the thesis's packets do not say which radar they are of: choose one with --sensor"
                    )
                return encode_thesis(scan.z, self._thesis)
            if self._format == "asterix":
                return self._asterix_block(scan, t, number)
            sequence = self._sequences[scan.sensor]
            self._sequences[scan.sensor] += 1
            sigma = np.sqrt(np.diagonal(scan.R, axis1=1, axis2=2)).reshape(-1, 4)
            return encode_radar(number, sequence, t, scan.z, sigma, cone=scan.kind == "radar_cone")
        except ValueError as error:
            raise InputError(f"radar '{scan.sensor}': {error}") from None

    def _asterix_block(self, scan: Scan, t: float, number: int) -> bytes:
        roll, pitch, yaw = euler_angles(scan.sensor_attitude)
        if abs(roll) > _LEVEL or abs(pitch) > _LEVEL or scan.kind != "radar":
            raise InputError(
                f"radar '{scan.sensor}' is tilted or a line array: ASTERIX has azimuths in the horizontal plane"
            )
        if scan.sensor not in self._asterix:
            self._asterix[scan.sensor] = self._encoder(number)
        block: bytes = self._asterix[scan.sensor].plots(t, scan.z, yaw, -float(scan.sensor_position[2]))
        return block

    @staticmethod
    def _encoder(number: int) -> Any:
        from wideberth.links.asterix.encode import AsterixEncoder

        return AsterixEncoder(*divmod(number, 256))


class TrafficPackets:
    """Turns reports into packets.

    Parameters
    ----------
    fmt : str
        One of `TRAFFIC_PORTS`.

    Raises
    ------
    InputError
        If there is no such format, or libasterix is needed and not there.
    """

    def __init__(self, fmt: str) -> None:
        if fmt not in TRAFFIC_PORTS:
            raise InputError(f"traffic packets '{fmt}' are not known: use one of {', '.join(TRAFFIC_PORTS)}")
        self._format = fmt
        self._second = -math.inf
        self._asterix: Any = None
        if fmt == "asterix":
            from wideberth.links.asterix.encode import AsterixEncoder

            self._asterix = AsterixEncoder()

    def encode(self, reports: Sequence[AdsbReport], t: float) -> list[bytes]:
        """Return the packets of reports that were received at time `t`, Unix s; GDL90 adds its heartbeats."""
        now = [replace(report, t=t) for report in reports]
        if self._format == "asterix":
            pieces = range(0, len(now), _REPORTS_IN_A_BLOCK)
            return [self._asterix.adsb(now[k : k + _REPORTS_IN_A_BLOCK]) for k in pieces]
        if self._format == "beast":
            frames = (frame for report in now for frame in squitters.encode(report))
            return [b"".join(beast.encode(frame, int(t * _TICKS)) for frame in frames)]
        encode = {"gdl90": gdl90.encode, "sbs": sbs_encoder.encode, "uat": uat.encode}[self._format]
        packets = [encode(report) for report in now]
        if self._format == "gdl90" and t >= self._second + 1.0:
            self._second = math.floor(t)
            packets.insert(0, gdl90.heartbeat(t))
        return packets


@dataclass(slots=True)
class Sent:
    """What was sent.

    Attributes
    ----------
    packets, values, octets, late : int
        Packets, plots or reports in them, bytes, and pieces that were sent too late to count as real time.
    elapsed : float
        Time of the scenario or recording, s.
    """

    packets: int = 0
    values: int = 0
    octets: int = 0
    late: int = 0
    elapsed: float = 0.0


def send(
    pieces: Iterator[tuple[float, list[T]]],
    encode: Callable[[list[T], float], list[bytes]],
    count: Callable[[list[T]], int],
    output: Output,
    *,
    speed: float = 1.0,
    told: Callable[[Sent], None] | None = None,
    monotonic: Callable[[], float] = time.monotonic,
    wall: Callable[[], float] = time.time,
    sleep: Callable[[float], None] = time.sleep,
) -> Sent:
    """Send pieces at their times, the first at once.

    Parameters
    ----------
    pieces : iterator of (float, list)
        Time, s, and what is to be sent then; times must not run back.
    encode : callable
        Gives the packets of a piece that is sent at a Unix time, s.
    count : callable
        Gives how many values a piece holds.
    output : Output
        Not closed here.
    speed : float
        How much faster than real time; the times in the packets are those of sending.
    told : callable, optional
        Told after each piece what was sent so far.
    monotonic, wall, sleep : callable
        Clocks, s, and waiting.

    Returns
    -------
    Sent

    Raises
    ------
    ValueError
        If the speed is not positive.
    """
    if not 0.0 < speed < math.inf:
        raise ValueError(f"speed {speed} must be positive")
    sent = Sent()
    start = origin = math.nan
    for t, piece in pieces:
        if math.isnan(origin):
            origin, start, unix = t, monotonic(), wall()
        sent.elapsed = max(t - origin, sent.elapsed)
        due = sent.elapsed / speed
        while (wait := start + due - monotonic()) > 0.0:
            sleep(wait)
        sent.late += wait < -_LATE
        for packet in encode(piece, unix + due):
            if packet:
                output.send(packet)
                sent.packets += 1
                sent.octets += len(packet)
        sent.values += count(piece)
        if told is not None:
            told(sent)
    return sent
