"""What is kept of reports and of filters, so that a late report can be put in its place and the filters run again."""

from dataclasses import dataclass
from typing import NamedTuple

from wideberth.types import FloatArray


class Report(NamedTuple):
    """One row of a scan: time and internal step of validity, the six elements, their variances, time uncertainty."""

    t: float
    step: int
    z: tuple[float, ...]
    r: tuple[float, ...]
    time_sigma: float


class Outcome(NamedTuple):
    """What became of a report: counts by key, what happened in words."""

    counts: tuple[str, ...]
    events: tuple[str, ...] = ()


ACCEPTED_OUTCOME = Outcome(("position accepted",))
NO_POSITION_OUTCOME = Outcome(("report without position used",))


@dataclass(slots=True)
class AircraftFilter:
    """One filter of an address: which slot it has, and how far it is to be trusted.

    Attributes
    ----------
    slot : int
    number : int
        1 for the first aircraft with the address, 2 for a second one.
    accepted : int
        Positions accepted since the start, that one included.
    t_position : float
        Time of the last accepted position, s.
    fix : tuple of (int, float, float)
        Internal step, north, east of the last accepted position.
    vertical_rejects : int
        Altitudes rejected one after the other.
    """

    slot: int
    number: int
    accepted: int
    t_position: float
    fix: tuple[int, float, float]
    vertical_rejects: int = 0


class Update(NamedTuple):
    """A filter to be updated with a report: which elements to use (position, altitude, climb rate, velocity)."""

    filter: AircraftFilter
    use: tuple[bool, bool, bool, bool]


class FilterState(NamedTuple):
    """All of a filter at one time, to go back to."""

    number: int
    accepted: int
    t_position: float
    fix: tuple[int, float, float]
    vertical_rejects: int
    x: FloatArray
    p: FloatArray
    last: int


class State(NamedTuple):
    """All of an address at one time, to go back to."""

    filters: tuple[FilterState, ...]
    last_position: tuple[float, float] | None
    velocity: tuple[int, float, float] | None
    altitude: tuple[int, float] | None
    rejected: tuple[tuple[int, float, float], ...]
    consecutive: int


class Entry(NamedTuple):
    """A report that was used, what became of it, and the state after it."""

    t: float
    report: Report | None
    outcome: Outcome | None
    state: State


def entry_time(entry: Entry) -> float:
    """Return the time of validity of an entry's report, s."""
    return entry.t
