"""The formats of traffic, and telling them apart by their content."""

import re
from collections.abc import Callable

from wideberth.errors import InputError
from wideberth.sensors.adsb import beast
from wideberth.sensors.adsb.frame_readers import AvrReader, JsonFrameReader
from wideberth.sensors.adsb.gdl90.framing import coverage as gdl90_coverage
from wideberth.sensors.adsb.gdl90.reader import Gdl90Reader
from wideberth.sensors.adsb.readers import Reader
from wideberth.sensors.adsb.sbs import SbsReader
from wideberth.sensors.adsb.trajectories import TrajectoryReader
from wideberth.sensors.adsb.uat.reader import UatReader

READERS: dict[str, Callable[[], Reader]] = {
    "trajectories": TrajectoryReader,
    "frames": JsonFrameReader,
    "beast": beast.BeastReader,
    "beast-gps": lambda: beast.BeastReader(gps_time=True),
    "beast-12mhz": lambda: beast.BeastReader(gps_time=False),
    "avr": AvrReader,
    "avr-untimed": lambda: AvrReader(timed=False),
    "sbs": SbsReader,
    "uat": UatReader,
    "gdl90": Gdl90Reader,
}
LIVE_READERS = ("beast", "avr", "sbs", "uat", "gdl90")
LISTENING = ("gdl90",)
"""Live readers of datagrams, which are not connected to but listened for."""

_TEXT = (
    ("sbs", re.compile(r"(\d+,)?(MSG|SEL|ID|AIR|STA|CLK),")),
    ("avr", re.compile(r"(@[0-9A-Fa-f]{12}|<[0-9A-Fa-f]{14}|%[0-9A-Fa-f]{12})[0-9A-Fa-f]+;")),
    ("avr-untimed", re.compile(r"[*:][0-9A-Fa-f]+;")),
    ("uat", re.compile(r"(\d+,)?[-+][0-9A-Fa-f]{20,}")),
)
_MIN_COVERAGE = 0.5


def names() -> str:
    """Return the names of all formats, for messages."""
    return ", ".join(["auto", *READERS])


def detect(head: bytes, name: str) -> str:
    """Return the format of traffic by its first bytes.

    Parameters
    ----------
    head : bytes
        The first piece, unpacked.
    name : str
        What to call it in messages.

    Raises
    ------
    InputError
        If it is empty, or nothing known.
    """
    if not head.strip():
        raise InputError(f"traffic '{name}' is empty")
    if beast.coverage(head) >= _MIN_COVERAGE:
        return "beast"
    if gdl90_coverage(head) >= _MIN_COVERAGE:
        return "gdl90"
    text = head.decode("latin-1").lstrip("\ufeff\u00ef\u00bb\u00bf \t\r\n")
    if text.startswith("["):
        return "trajectories"
    lines = [stripped for line in text.splitlines()[:200] if (stripped := line.strip())]
    if text.startswith("{"):
        if '"frame"' in lines[0]:
            return "frames"
        raise InputError(f"traffic '{name}' is JSON but neither a list of trajectory rows nor lines with a frame")
    votes = {kind: sum(bool(pattern.match(line)) for line in lines) for kind, pattern in _TEXT}
    best = max(votes, key=lambda kind: votes[kind])
    if votes[best] < max(1, _MIN_COVERAGE * len(lines)):
        raise InputError(
            f"traffic '{name}' is none of the known formats ({names()}): name its format if it is one of them"
        )
    return best
