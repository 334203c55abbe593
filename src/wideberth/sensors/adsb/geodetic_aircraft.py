"""One aircraft of a source that gives decoded positions: what it said of itself, and repeats of its last report."""

import math
from collections import Counter
from dataclasses import dataclass, field

from wideberth.sensors.adsb.address_use import AddressUse, identity
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import SourceInfo


@dataclass(slots=True)
class GeodeticAircraft:
    """Turns decoded values of one aircraft into reports, leaving out what is stale or impossible.

    Parameters
    ----------
    address : str
    results : Counter
        Counts what became of positions (shared by all aircraft of a source).
    """

    address: str
    results: Counter[str]
    use: AddressUse = field(default_factory=AddressUse)
    info: SourceInfo = field(default_factory=SourceInfo)
    _position: tuple[float, float] | None = None
    _values: tuple[float, ...] = (math.nan,) * 5

    def report(
        self,
        t: float,
        position: tuple[float, float] | None,
        pressure_altitude: float,
        geometric_altitude: float,
        velocity: tuple[float, float, float],
    ) -> AdsbReport | None:
        """Return the report of new values, or None where nothing in them is new.

        Parameters
        ----------
        t : float
            s.
        position : tuple or None
            Latitude and longitude, degrees, as the source gives them: one that repeats the aircraft's last exactly is a
            stale report (recordings put out at 1 Hz repeat what they last heard), not an aircraft that hovers.
        pressure_altitude, geometric_altitude : float
            m; NaN where unknown.
        velocity : tuple of float
            North, east, up, m/s; NaN where unknown.
        """
        values = (pressure_altitude, geometric_altitude, *velocity)
        if position is not None and not (abs(position[0]) <= 90.0 and abs(position[1]) <= 180.0):
            self.results["position off the Earth"] += 1
            position = None
        latitude = longitude = math.nan
        user = 0
        if position is None:
            if len(self.use.places) > 1:
                self.results["whose of two aircraft with one address is unknown"] += 1
                return None
            fresh: tuple[float, ...] = values
        elif position == self._position:
            self.results["repeated positions"] += 1
            fresh = tuple(new if new != old else math.nan for new, old in zip(values, self._values, strict=True))
        else:
            self._position = position
            latitude, longitude = math.radians(position[0]), math.radians(position[1])
            users = len(self.use.places)
            assigned = self.use.assign(t, latitude, longitude)
            if assigned is None:
                self.results["position jumps"] += 1
                return None
            user, fresh = assigned, values
            self.results["positions"] += 1
            if len(self.use.places) > users == 1:
                self.results["addresses used by two aircraft"] += 1
        if math.isnan(sum(values)):
            self._values = tuple(old if math.isnan(new) else new for new, old in zip(values, self._values, strict=True))
        else:
            self._values = values
        if math.isnan(latitude) and all(math.isnan(value) for value in fresh):
            return None
        pressure_altitude, geometric_altitude, north, east, up = fresh
        return AdsbReport(
            t,
            identity(self.address, user),
            latitude,
            longitude,
            pressure_altitude,
            geometric_altitude,
            north,
            east,
            up,
            info=self.info,
        )
