"""Who uses an address: positions that no aircraft could have flown between are told apart, not averaged."""

import math
from dataclasses import dataclass, field

_EARTH_RADIUS = 6371000.0
MAX_SPEED = 700.0  # m/s, faster than any aircraft that takes part in traffic
MARGIN = 1500.0  # m, for errors of position and of the time of receipt
CONFIRMATIONS = 3  # positions that agree with each other before a second place is believed
CANDIDATES = 3  # places on trial at a time
FORGET_AFTER = 60.0  # s without a position after which the second user of an address is forgotten


def distance(latitude_a: float, longitude_a: float, latitude_b: float, longitude_b: float) -> float:
    """Return the distance of two near positions (rad) on the sphere, m; good to a per cent below some 500 km."""
    dlon = (longitude_b - longitude_a + math.pi) % (2 * math.pi) - math.pi
    return _EARTH_RADIUS * math.hypot(latitude_b - latitude_a, dlon * math.cos((latitude_a + latitude_b) / 2))


@dataclass(slots=True)
class Place:
    """The last position of one user of an address: s, rad."""

    t: float
    latitude: float
    longitude: float
    t_first: float
    count: int = 1


@dataclass(slots=True)
class AddressUse:
    """The users of one address, one as a rule, two at most.

    Parameters
    ----------
    timed : bool
        False where times of receipt are made up: nothing can be said about speeds then, and every position is believed.
    """

    timed: bool = True
    places: list[Place] = field(default_factory=list)
    _candidates: list[Place] = field(default_factory=list)

    def assign(self, t: float, latitude: float, longitude: float) -> int | None:
        """Return which user (0 or 1) a position (rad) belongs to; None if it is too far from all of them.

        A place that no known user can have reached is believed after some positions that agree on it: as a second
        user if the first was heard in its own place meanwhile, else as the place where the aircraft really is.
        """
        places = self.places
        if len(places) == 2 and t - places[1].t > FORGET_AFTER:
            places.pop()
        nearest, least = -1, math.inf
        for k, place in enumerate(places):
            gap = distance(place.latitude, place.longitude, latitude, longitude)
            if gap < least and self._reachable(place, t, gap):
                nearest, least = k, gap
        if nearest >= 0:
            _move(places[nearest], t, latitude, longitude)
            return nearest
        if not places:
            places.append(Place(t, latitude, longitude, t))
            return 0
        for candidate in self._candidates:
            if self.plausible(candidate, t, latitude, longitude):
                break
        else:
            self._candidates = [*self._candidates[1 - CANDIDATES :], Place(t, latitude, longitude, t)]
            return None
        _move(candidate, t, latitude, longitude)
        if candidate.count < CONFIRMATIONS:
            return None
        self._candidates.remove(candidate)
        if len(places) == 1 and places[0].t > candidate.t_first:
            places.append(candidate)
            return 1
        oldest = min(range(len(places)), key=lambda k: places[k].t)
        places[oldest] = candidate
        return oldest

    def plausible(self, place: Place, t: float, latitude: float, longitude: float) -> bool:
        """Return whether an aircraft can have come from a place to a position (rad) by time `t`."""
        return self._reachable(place, t, distance(place.latitude, place.longitude, latitude, longitude))

    def _reachable(self, place: Place, t: float, gap: float) -> bool:
        return not self.timed or gap <= MAX_SPEED * abs(t - place.t) + MARGIN


def _move(place: Place, t: float, latitude: float, longitude: float) -> None:
    place.t, place.latitude, place.longitude = t, latitude, longitude
    place.count += 1


def identity(address: str, user: int) -> str:
    """Return the name to report a user of an address under: the address, or "abc123#2" for its second user."""
    return address if user == 0 else f"{address}#{user + 1}"
