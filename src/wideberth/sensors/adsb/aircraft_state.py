"""What the decoder remembers of one aircraft between its messages."""

import math
from dataclasses import replace

from wideberth.sensors.adsb import cpr
from wideberth.sensors.adsb.address_use import MAX_SPEED, AddressUse, distance
from wideberth.types import SourceInfo

PAIR_AGE = 10.0  # s between an even and an odd message of one pair (DO-260B, A.1.7.7)
PAIR_MARGIN = 300.0  # m that the halves of a pair may lie apart beyond what the aircraft flew between them
REFERENCE_AGE = 120.0  # s after which the last position is no reference for local decoding any more
ALTITUDE_AGE = 5.0  # s after which a pressure altitude is too old to add the geometric difference to


class AircraftState:
    """CPR halves, last positions, and everything that the aircraft has said of itself."""

    __slots__ = (
        "_even",
        "_odd",
        "info",
        "nic_supplement_a",
        "on_ground",
        "pressure_altitude",
        "t_heard",
        "t_pressure_altitude",
        "use",
        "version",
    )

    def __init__(self, *, timed: bool = True) -> None:
        self.use = AddressUse(timed)
        self.info = SourceInfo()
        self.version = 0
        self.nic_supplement_a = 0
        self.on_ground = False
        self.pressure_altitude = math.nan
        self.t_pressure_altitude = -math.inf
        self.t_heard = -math.inf
        self._even: tuple[float, int, int] | None = None
        self._odd: tuple[float, int, int] | None = None

    def say(self, **said: object) -> None:
        """Keep what the aircraft says of itself (fields of `SourceInfo`)."""
        info = self.info
        if any(getattr(info, name) != value for name, value in said.items()):
            self.info = replace(info, **said)  # type: ignore[arg-type]

    def land(self) -> None:
        """Forget the airborne CPR halves: on the ground the encoding is another one."""
        self.on_ground = True
        self._even = self._odd = None

    def locate(self, t: float, lat: int, lon: int, *, odd: bool) -> tuple[int, float, float] | str:
        """Resolve a CPR position.

        First locally about the last position of each user of the address, then globally with the pair's other half.

        Returns
        -------
        tuple or str
            User of the address, latitude and longitude (rad); or why there is no position: ``"unresolved"`` (no
            reference and no fresh other half) or ``"jump"`` (too far from where the aircraft was).
        """
        use = self.use
        implausible = False
        for place in use.places:
            if abs(t - place.t) <= REFERENCE_AGE:
                found = cpr.decode_local(
                    lat, lon, odd=odd, latitude=math.degrees(place.latitude), longitude=math.degrees(place.longitude)
                )
                if found is not None and use.plausible(place, t, math.radians(found[0]), math.radians(found[1])):
                    return self._assign(t, found)
                implausible = True
        # Only halves that fit nobody are kept: those of a second user of the address must find each other.
        if odd:
            self._odd = (t, lat, lon)
        else:
            self._even = (t, lat, lon)
        even, other = self._even, self._odd
        if even is None or other is None or abs(even[0] - other[0]) > PAIR_AGE:
            return "jump" if implausible else "unresolved"
        pair = cpr.decode_global(even[1], even[2], other[1], other[2], latest_is_odd=odd)
        if pair is None or not self._belongs(pair, even if odd else other, half_is_odd=not odd, t=t):
            return "jump" if implausible else "unresolved"
        self._even = self._odd = None
        return self._assign(t, pair)

    def _belongs(
        self, position: tuple[float, float], half: tuple[float, int, int], *, half_is_odd: bool, t: float
    ) -> bool:
        """Return whether the other half of a pair lies where the aircraft can have been before it was at its position.

        Halves of two aircraft that use one address give some position anywhere; they rarely fit together so well.
        """
        latitude, longitude = position
        found = cpr.decode_local(half[1], half[2], odd=half_is_odd, latitude=latitude, longitude=longitude)
        if found is None or not self.use.timed:
            return found is not None
        apart = distance(*map(math.radians, (latitude, longitude, *found)))
        return apart <= MAX_SPEED * abs(t - half[0]) + PAIR_MARGIN

    def _assign(self, t: float, position: tuple[float, float]) -> tuple[int, float, float] | str:
        latitude, longitude = math.radians(position[0]), math.radians(position[1])
        user = self.use.assign(t, latitude, longitude)
        return "jump" if user is None else (user, latitude, longitude)
