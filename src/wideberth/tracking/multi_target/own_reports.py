"""Which aircraft that report may be the ownship, and what is said of those that fly where it does."""

from collections.abc import Callable

from wideberth.tracking.multi_target.bank_kernels import CONFIRMED
from wideberth.tracking.multi_target.config import ReportsConfig
from wideberth.tracking.multi_target.heard_kernels import Heard
from wideberth.tracking.ownship_kernels import FLAG, WEIGHT

_SURE_S = 2.0
"""So much weight of looks is needed before an address is said to be another aircraft's."""


def may_be_ownship(config: ReportsConfig, address: str) -> bool:
    """Return whether an aircraft with this address may be the ownship.

    Parameters
    ----------
    config : ReportsConfig
    address : str
    """
    if config.ownship_address is not None:
        return address.lower() == config.ownship_address.lower()
    return config.ownship_broadcasts


class OwnReports:
    """Tells in words, once each time it changes, which aircraft that only reports tell of is taken for the ownship.

    Parameters
    ----------
    config : ReportsConfig
    """

    def __init__(self, config: ReportsConfig) -> None:
        self._addressed = config.ownship_address is not None
        self._ours = -1
        self._others: set[int] = set()

    def tell(self, place: int, heard: Heard, name: Callable[[int], str]) -> list[str]:
        """Return what has changed.

        Parameters
        ----------
        place : int
            Of the aircraft that flies as the ownship does; -1: none.
        heard : Heard
        name : callable
            ``name(place)`` is what to call an aircraft.
        """
        events = []
        ours = place if place >= 0 and heard.own[place, FLAG] != 0.0 else -1
        if ours != self._ours:
            if self._ours >= 0 and heard.alive[self._ours] and heard.slot[self._ours] < 0:
                events.append(
                    f"track {heard.number[self._ours]}, {name(self._ours)}, is no longer taken for the ownship"
                )
            if ours >= 0:
                events.append(f"track {heard.number[ours]}, {name(ours)}, is taken for the ownship: its own ADS-B")
                self._others.discard(ours)
            self._ours = ours
        self._others = {other for other in self._others if heard.alive[other]}
        if place >= 0 and ours < 0 and place not in self._others:
            self._others.add(place)
            words = f"track {heard.number[place]}, {name(place)}, flies where the ownship does, and is another aircraft"
            events.append(f"{words}; if it is the ownship's own ADS-B, set reports.ownship_address")
        if self._addressed and ours < 0:
            for wrong in ((heard.mine == 1) & (heard.alive == 1) & (heard.slot < 0)).nonzero()[0].tolist():
                sure = heard.status[wrong] == CONFIRMED and heard.own[wrong, WEIGHT] >= _SURE_S
                if sure and wrong not in self._others:
                    self._others.add(wrong)
                    words = f"track {heard.number[wrong]}, {name(wrong)}, has the ownship's address"
                    events.append(f"{words} and flies elsewhere: it is another aircraft")
        return events
