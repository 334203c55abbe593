"""What readers of decoded positions share: their aircraft, what these say of themselves, and counters."""

from collections import Counter
from dataclasses import replace

from wideberth.sensors.adsb.geodetic_aircraft import GeodeticAircraft
from wideberth.sensors.adsb.readers import nonzero

_CROWD = 20_000
_REFUSED = ("position jumps", "position off the Earth", "whose of two aircraft with one address is unknown")


class GeodeticReader:
    """The part that readers of decoded positions share.

    Attributes
    ----------
    kinds, results : Counter
        Messages understood by kind, and what became of their positions.
    messages : int
        All messages, understood or not.
    """

    def __init__(self) -> None:
        self.kinds: Counter[str] = Counter()
        self.results: Counter[str] = Counter()
        self.messages = 0
        self._rejects: Counter[str] = Counter()
        self._aircraft: dict[str, GeodeticAircraft] = {}

    @property
    def counters(self) -> dict[str, int]:
        """Counts of messages by kind, of results, and of rejections by cause."""
        return {"messages": self.messages} | nonzero(self.kinds, self.results) | self._left_out()

    @property
    def understood(self) -> int:
        """How many messages made sense, of aircraft in the air or not."""
        return sum(self.kinds.values()) + self._rejects["surface"]

    @property
    def rejects(self) -> dict[str, int]:
        """Rejections by cause, positions refused included."""
        return self._left_out() | {name: self.results[name] for name in _REFUSED if self.results[name]}

    @property
    def addresses(self) -> tuple[str, ...]:
        """The addresses heard; in a crowd only the last ones."""
        return tuple(self._aircraft)

    def _left_out(self) -> dict[str, int]:
        return nonzero(self._rejects)

    def _of(self, address: str) -> GeodeticAircraft:
        """Return the aircraft with an address, as the last heard."""
        aircraft = self._aircraft.pop(address, None)
        if aircraft is None:
            aircraft = GeodeticAircraft(address, self.results)
            if len(self._aircraft) >= _CROWD:
                del self._aircraft[next(iter(self._aircraft))]
        self._aircraft[address] = aircraft
        return aircraft


def say(aircraft: GeodeticAircraft, said: dict[str, object]) -> None:
    """Keep what an aircraft says of itself (fields of `SourceInfo`)."""
    if any(getattr(aircraft.info, name) != value for name, value in said.items()):
        aircraft.info = replace(aircraft.info, **said)  # type: ignore[arg-type]
