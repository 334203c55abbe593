"""Plots of a radar in UDP datagrams: the packet of thesis 5.1, and ours, which says when, how exactly and how strongly.

Ours, version 1, big-endian: the header `HEADER` (magic ``WBRP``, version, flags, number of the radar, sequence number,
time of validity in Unix microseconds, count of plots, bytes of a plot), the plots `PLOT` (32-bit floats; NaN where not
measured or not stated), and the CRC-32 of all before it. Plots may be longer than a reader knows: it skips the rest.
"""

import math
import struct
import zlib
from collections import Counter

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.links.config import RadarUdpConfig, ThesisPacketConfig
from wideberth.links.radar_plots import OwnshipAt, RadarUnit, joint_health, unit_of
from wideberth.types import FloatArray, Scan, SensorHealth

MAGIC = b"WBRP"
VERSION = 1
CONE = 1
"""Flag: the angles are those of a line array (kind ``"radar_cone"``)."""

HEADER = struct.Struct(">4sBBHIqHH")
PLOT = (
    "range_m",
    "azimuth_rad",
    "elevation_rad",
    "range_rate_mps",
    "snr_db",
    "range_sigma_m",
    "azimuth_sigma_rad",
    "elevation_sigma_rad",
    "range_rate_sigma_mps",
)
_PLOT_BYTES = 4 * len(PLOT)
_CRC = struct.Struct(">I")
MAX_DATAGRAM = 65507
MAX_PLOTS = (MAX_DATAGRAM - HEADER.size - _CRC.size) // _PLOT_BYTES
_SEQUENCES = 1 << 32
_LATE = 10_000_000
"""Microseconds up to which a packet may come late behind a newer one."""

_THESIS_MAX_PLOTS = (MAX_DATAGRAM - 4) // 8


class RadarUdpReader:
    """Turns datagrams of radars into scans.

    Parameters
    ----------
    config : RadarUdpConfig
    frame : LocalFrame, optional
        Needed for radars given by latitude and longitude. It may be set later (`frame`); until then their packets are
        refused and counted.
    ownship : callable, optional
        ``ownship(t)`` gives the ownship's state, or None where unknown; needed for radars mounted on it.

    Notes
    -----
    A packet that comes twice, late (behind a newer one) or with a time that jumps is refused and counted, and numbers
    left out are counted as lost. A number that runs back while the radar's time runs on, or is set back by more than
    10 s, is a radar that was started anew.
    """

    def __init__(
        self, config: RadarUdpConfig, frame: LocalFrame | None = None, ownship: OwnshipAt | None = None
    ) -> None:
        self._config = config
        self._units = {unit.radar_id: RadarUnit(unit, config.clock, frame, ownship) for unit in config.units}
        self._last: dict[RadarUnit, tuple[int, int]] = {}  # sequence number, microseconds
        self._rejects: Counter[str] = Counter()
        self._datagrams = 0

    @property
    def frame(self) -> LocalFrame | None:
        """The local frame."""
        return next(iter(self._units.values())).frame

    @frame.setter
    def frame(self, frame: LocalFrame | None) -> None:
        for unit in self._units.values():
            unit.frame = frame

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the radars."""
        return tuple(unit.name for unit in self._units.values())

    @property
    def counters(self) -> dict[str, int]:
        """Counts of datagrams, scans, plots, lost sequence numbers, and of what was left out, by cause."""
        counts = sum((unit.counters for unit in self._units.values()), Counter())
        return {"datagrams": self._datagrams, **counts, **self.rejects}

    @property
    def rejects(self) -> dict[str, int]:
        """Packets and plots left out, by cause."""
        return dict(sum((unit.rejects for unit in self._units.values()), self._rejects.copy()))

    def health(self, t: float) -> SensorHealth:
        """Return how the radars do at time `t`, s: the one that does worst, with the rejects of all."""
        return joint_health(list(self._units.values()), self._rejects, t)

    def feed(self, data: bytes, t: float) -> list[Scan]:
        """Return the scan of one datagram, or none where it is refused.

        Parameters
        ----------
        data : bytes
            One whole datagram.
        t : float
            Time of receipt, s.
        """
        self._datagrams += 1
        if not math.isfinite(t):
            self._rejects["time of receipt not a number"] += 1
            return []
        scan = self._thesis(data, t) if self._config.packet == "thesis" else self._ours(data, t)
        return [] if scan is None else [scan]

    def _ours(self, data: bytes, t: float) -> Scan | None:
        if len(data) < HEADER.size + _CRC.size:
            self._refuse("packet too short")
            return None
        magic, version, flags, radar_id, sequence, microseconds, count, size = HEADER.unpack_from(data)
        if magic != MAGIC:
            self._refuse("not our packet")
            return None
        if zlib.crc32(data[: -_CRC.size]) != _CRC.unpack(data[-_CRC.size :])[0]:
            self._refuse("crc failed")
            return None
        if version != VERSION:
            self._refuse("version not known")
            return None
        if size < _PLOT_BYTES or size % 4 or HEADER.size + count * size + _CRC.size != len(data):
            self._refuse("count and length do not agree")
            return None
        unit = unit_of(self._units, radar_id)
        if unit is None:
            self._refuse("another radar's")
            return None
        t_valid = unit.time(microseconds * 1e-6, t)
        if t_valid is None or not self._next(unit, sequence, microseconds, t_valid):
            return None
        values = np.frombuffer(data, ">f4", count * size // 4, HEADER.size).reshape(count, size // 4)
        with np.errstate(invalid="ignore"):
            values = values[:, : len(PLOT)].astype(np.float64)
        return unit.scan(t_valid, t, values[:, :4], values[:, 5:], values[:, 4], cone=bool(flags & CONE))

    def _next(self, unit: RadarUnit, sequence: int, microseconds: int, t_valid: float) -> bool:
        """Return whether a packet is newer than the last of its radar; lost and refused ones are counted."""
        last, last_time = self._last.get(unit, (sequence - 1, microseconds))
        ahead = (sequence - last) % _SEQUENCES
        if ahead == 0:
            unit.refuse("sequence number repeated")
            return False
        behind = ahead >= _SEQUENCES // 2
        # A late packet is older than the newest, but not by much: else the radar's clock or the radar was set anew.
        if behind and 0 <= last_time - microseconds <= _LATE:
            unit.refuse("behind a newer packet")
            return False
        if not unit.in_order(t_valid):
            return False
        if behind:
            unit.counters["sequence numbers started anew"] += 1
        elif ahead > 1:
            unit.counters["packets lost"] += ahead - 1
        self._last[unit] = sequence, microseconds
        return True

    def _thesis(self, data: bytes, t: float) -> Scan | None:
        (unit,) = self._units.values()
        pairs = decode_thesis(data, self._config.thesis)
        if isinstance(pairs, str):
            self._refuse(pairs)
            return None
        t_valid = unit.time(math.nan, t)
        if t_valid is None:
            return None
        z = np.full((len(pairs), 4), np.nan)
        z[:, :2] = pairs
        cone = self._config.thesis.angle == "cone"
        return unit.scan(t_valid, t, z, np.full(z.shape, np.nan), cone=cone)

    def _refuse(self, cause: str) -> None:
        if len(self._units) == 1:
            next(iter(self._units.values())).refuse(cause)
        else:
            self._rejects[cause] += 1


def encode_radar(
    radar_id: int,
    sequence: int,
    t_valid: float,
    z: FloatArray,
    sigma: FloatArray | None = None,
    snr: FloatArray | None = None,
    *,
    cone: bool = False,
) -> bytes:
    """Return our packet of one scan.

    Parameters
    ----------
    radar_id : int
        0 to 65535.
    sequence : int
        Of the scan; taken modulo 2**32.
    t_valid : float
        Unix s.
    z : ndarray, shape (k, 4)
        Range (m), azimuth or angle of the cone, elevation (rad), range rate (m/s, positive opening); NaN where not
        measured.
    sigma : ndarray, shape (k, 4), optional
        Standard deviations; NaN where not stated.
    snr : ndarray, shape (k,), optional
        dB.
    cone : bool
        Whether the angles are a line array's.

    Raises
    ------
    ValueError
        If there are more plots than a datagram holds, the number or the time does not fit, or shapes differ.
    """
    z = np.asarray(z, np.float64)
    if z.ndim != 2 or z.shape[1] != 4 or len(z) > MAX_PLOTS:
        raise ValueError(f"plots {z.shape}: a packet holds (k, 4) with at most {MAX_PLOTS} of them")
    if not (0 <= radar_id < 65536 and math.isfinite(t_valid) and abs(t_valid) < 9e12):
        raise ValueError(f"radar_id {radar_id} or time {t_valid} does not fit into a packet")
    values = np.full((len(z), len(PLOT)), np.nan)
    values[:, :4] = z
    if snr is not None:
        values[:, 4] = snr
    if sigma is not None:
        values[:, 5:] = sigma
    with np.errstate(over="ignore", invalid="ignore"):
        plots = values.astype(">f4").tobytes()
    head = HEADER.pack(
        MAGIC,
        VERSION,
        CONE if cone else 0,
        radar_id,
        sequence % _SEQUENCES,
        round(t_valid * 1e6),
        len(z),
        _PLOT_BYTES,
    )
    return head + plots + _CRC.pack(zlib.crc32(head + plots))


def decode_thesis(data: bytes, config: ThesisPacketConfig) -> FloatArray | str:
    """Return ranges (m) and angles (rad), shape (k, 2), of the thesis's packet; or why it is refused, in words."""
    order = "<" if config.byte_order == "little" else ">"
    if len(data) < 4 or len(data) % 4:
        return "not a number of whole words"
    with np.errstate(invalid="ignore"):
        words = np.frombuffer(data, order + "f4").astype(np.float64)
    first = float(words[0]) if config.count_word == "float" else struct.unpack_from(order + "I", data)[0]
    if not (math.isfinite(first) and first >= 0.0 and first == int(first)):
        return "count not a whole number"
    end = 1 + 2 * int(first)
    if end > len(words):
        return "count beyond the packet"
    if not config.ignore_beyond_count and data[4 * end :].strip(b"\0"):
        return "words beyond the count"
    pairs = words[1:end].reshape(-1, 2).copy()
    unit = 1.0 if config.angle_unit == "rad" else math.pi / 180.0
    pairs[:, 0] = pairs[:, 0] * config.range_unit_m + config.range_offset_m
    pairs[:, 1] = pairs[:, 1] * unit * config.angle_sign + math.radians(config.angle_offset_deg)
    return pairs


def encode_thesis(z: FloatArray, config: ThesisPacketConfig | None = None) -> bytes:
    """Return the thesis's packet of a scan, the inverse of `decode_thesis`.

    Parameters
    ----------
    z : ndarray, shape (k, 2) or (k, 4)
        Range (m), azimuth or angle of the cone (rad); more columns are left out.
    config : ThesisPacketConfig, optional

    Raises
    ------
    ValueError
        If there are more plots than a datagram holds, or too few columns.
    """
    config = config or ThesisPacketConfig()
    z = np.asarray(z, np.float64)
    if z.ndim != 2 or z.shape[1] < 2 or len(z) > _THESIS_MAX_PLOTS:
        raise ValueError(f"plots {z.shape}: a packet holds (k, 2) with at most {_THESIS_MAX_PLOTS} of them")
    order = "<" if config.byte_order == "little" else ">"
    pairs = z[:, :2].copy()
    unit = 1.0 if config.angle_unit == "rad" else math.pi / 180.0
    pairs[:, 0] = (pairs[:, 0] - config.range_offset_m) / config.range_unit_m
    pairs[:, 1] = (pairs[:, 1] - math.radians(config.angle_offset_deg)) * config.angle_sign / unit
    count = struct.pack(order + ("f" if config.count_word == "float" else "I"), len(z))
    with np.errstate(over="ignore", invalid="ignore"):
        return count + pairs.astype(order + "f4").tobytes()
