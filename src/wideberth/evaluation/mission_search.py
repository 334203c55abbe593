"""Missions for the ownship that run into recorded traffic, found by a random search.

A mission is a straight level flight at constant speed. Whether it is kept depends on the conflicts that it meets
without avoidance, never on what avoidance makes of it: it must cross enough low aircraft, lose the well-clear volume
with some of them, and end outside the volume of all. Kept missions are different from each other. A filter, recorded
with each mission, tells those apart in which avoidance has a fair chance: no loss at the start, and every aircraft in
conflict seen some time before its loss.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields

import numpy as np

from wideberth.conflict.well_clear import PRESETS
from wideberth.evaluation.mission_kernels import meetings
from wideberth.frames import SEMI_MAJOR_AXIS, LocalFrame
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.simulation.recorded import RecordedTraffic
from wideberth.types import FloatArray
from wideberth.units import FOOT, KNOT, NAUTICAL_MILE

STEP = 1.0  # s between the samples of traffic
MEMORY_MAX = 4e9  # bytes of sampled states
RADIUS_MAX = 500e3  # m from the middle of the recording: beyond it distances in one plane are wrong by over 0.3 %


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """What is searched for; SI units.

    Attributes
    ----------
    volume : str
        Name of the well-clear preset that is to be lost.
    min_aircraft : int
        Aircraft to be crossed at least: nearer than `cross_radius` and `cross_height` while below `ceiling`.
    min_losses : int
        Aircraft to lose the volume with at least, where modified tau counts only towards a miss of at most DTHR, so
        that the number holds whichever way losses are counted. All other times are of the wider definition.
    speed : float
        Ground speed, m/s.
    duration_min, duration_max : float
        s.
    altitude_min, altitude_max : float
        Of the mission, m; the same kind of altitude as the traffic's.
    quiet_time : float
        Filter: no loss earlier than this, s from the start.
    seen_time, fresh_age, max_gap : float
        Filter: `seen_time` before its loss an aircraft in conflict had a position at most `fresh_age` old, and from
        then on no gap longer than `max_gap`; s.
    receiver_range : float
        Filter: it was then within this distance, m.
    shared_max : float
        Of the conflicts of a mission at most this part may be (same aircraft, within a minute) those of another.
    max_tries : int
        Candidates after which the search ends.
    """

    volume: str = "sarp"
    min_aircraft: int = 5
    min_losses: int = 3
    cross_radius: float = 2 * NAUTICAL_MILE
    cross_height: float = 1000 * FOOT
    ceiling: float = 5000 * FOOT
    speed: float = 80 * KNOT
    duration_min: float = 300.0
    duration_max: float = 850.0
    altitude_min: float = 300.0
    altitude_max: float = 1500.0
    quiet_time: float = 60.0
    seen_time: float = 25.0
    fresh_age: float = 5.0
    max_gap: float = 15.0
    receiver_range: float = 185_200.0
    shared_max: float = 0.5
    max_tries: int = 200_000

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name == "volume":
                if value not in PRESETS:
                    raise ValueError(f"volume is '{value}': use one of {', '.join(PRESETS)}")
            elif not (math.isfinite(value) and value >= 0):
                raise ValueError(f"{item.name} is {value}: give a finite number, not negative")
        if not (self.speed > 0 and 0 < self.duration_min <= self.duration_max):
            raise ValueError("speed and durations must be positive, and duration_min not above duration_max")
        if self.altitude_min > self.altitude_max:
            raise ValueError("altitude_min must not be above altitude_max")


@dataclass(frozen=True, slots=True)
class Meeting:
    """What a mission without avoidance meets of one aircraft.

    Attributes
    ----------
    address : str
    t_cross : float
        When it is first crossed, s from the start; NaN if it is not.
    losses : dict of str to float
        First loss of each volume, s from the start; ``"<volume>_miss_filter"`` for the narrower definition.
    seen : bool
        Whether it was seen in time (the filter), True where the searched volume is not lost.
    """

    address: str
    t_cross: float
    losses: dict[str, float]
    seen: bool


@dataclass(frozen=True, slots=True)
class FoundMission:
    """A mission and what it meets.

    Attributes
    ----------
    t_start, duration : float
        Unix s, s.
    waypoints : ndarray, shape (2, 3)
        Latitude, longitude (rad), altitude (m).
    speed, course : float
        m/s, rad.
    meetings : tuple of Meeting
    quiet, seen : bool
        The two parts of the filter.
    """

    t_start: float
    duration: float
    waypoints: FloatArray
    speed: float
    course: float
    meetings: tuple[Meeting, ...]
    quiet: bool
    seen: bool

    @property
    def passes(self) -> bool:
        """Whether the mission passes the filter."""
        return self.quiet and self.seen

    def losses(self, volume: str) -> dict[str, float]:
        """Return the time of loss of a volume for each aircraft that loses it, s from the start."""
        return {m.address: m.losses[volume] for m in self.meetings if volume in m.losses}


@dataclass(slots=True)
class SearchResult:
    """What a search found, and why it did not keep the rest.

    Attributes
    ----------
    missions : list of FoundMission
        In the order found, those that pass the filter and those that do not.
    tries : int
    rejected : Counter of str
        Candidates by the first reason for leaving them out.
    """

    missions: list[FoundMission] = field(default_factory=list)
    tries: int = 0
    rejected: Counter[str] = field(default_factory=Counter)


class SampledTraffic:
    """The low traffic of a recording, sampled in time, and when each aircraft was heard.

    Parameters
    ----------
    reports : sequence of AdsbReport
        All of the recording; positions over 500 km from their median are left out.
    settings : SearchSettings

    Raises
    ------
    ValueError
        If there is no aircraft in the air at the altitudes of the settings, or the recording is too long to be sampled.
    """

    def __init__(self, reports: list[AdsbReport], settings: SearchSettings) -> None:
        self.heard = heard_times(reports)
        located = [r for r in reports if math.isfinite(r.latitude) and not r.on_ground]
        if not located:
            raise ValueError("there is no aircraft in the air with a position")
        latitude, longitude = (float(np.median([getattr(r, k) for r in located])) for k in ("latitude", "longitude"))
        self.frame = LocalFrame(latitude, longitude)
        recorded = RecordedTraffic(
            (r for r in reports if not _far(r, latitude, longitude)), self.frame, settings.max_gap
        )
        if not recorded.ids:
            raise ValueError("there is no aircraft that can be followed")
        # Whole seconds, as people write start times.
        self.times = np.arange(math.ceil(recorded.t_start), math.floor(recorded.t_end) + 1, STEP)
        if len(self.times) * len(recorded.ids) * 48 > MEMORY_MAX:
            raise ValueError(
                f"{len(recorded.ids)} aircraft over {len(self.times) * STEP / 3600:.0f} h are too much at once:"
                " split the recording"
            )
        states = recorded.truth_many(self.times)
        altitude = -states[:, :, 2]
        with np.errstate(invalid="ignore"):
            low = (altitude >= settings.altitude_min) & (altitude <= settings.altitude_max)
            ever = np.any(altitude <= settings.altitude_max + 10 * settings.cross_height, axis=0)
        kept = np.flatnonzero(ever)
        self.ids = tuple(recorded.ids[i] for i in kept)
        self.states = np.ascontiguousarray(states[:, kept])
        self.low = np.argwhere(low[:, kept].T)  # rows of aircraft, sample
        if not len(self.low):
            raise ValueError(
                f"there is no aircraft between {settings.altitude_min:.0f} and {settings.altitude_max:.0f} m"
            )


def _far(report: AdsbReport, latitude: float, longitude: float) -> bool:
    """Return whether a report has a position too far from the middle of the recording."""
    if not math.isfinite(report.latitude):
        return False
    cosine = math.sin(latitude) * math.sin(report.latitude) + math.cos(latitude) * math.cos(report.latitude) * math.cos(
        report.longitude - longitude
    )
    return cosine < math.cos(RADIUS_MAX / SEMI_MAJOR_AXIS)


def heard_times(reports: Iterable[AdsbReport]) -> dict[str, FloatArray]:
    """Return the times of each aircraft's positions in the air that do not repeat the one before, rising."""
    last: dict[str, tuple[float, float]] = {}
    times: dict[str, list[float]] = {}
    for r in reports:
        place = (r.latitude, r.longitude)
        if not r.on_ground and math.isfinite(r.latitude) and last.get(r.address) != place:
            last[r.address] = place
            times.setdefault(r.address, []).append(r.t)
    return {address: np.sort(np.array(t)) for address, t in times.items()}


def search_missions(
    traffic: SampledTraffic,
    settings: SearchSettings,
    count: int,
    seed: int,
    *,
    outside: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> SearchResult:
    """Search missions; the same arguments give the same missions.

    Parameters
    ----------
    traffic : SampledTraffic
    settings : SearchSettings
    count : int
        Missions wanted that pass the filter.
    seed : int
    outside : int
        Missions wanted beside them that do not.
    progress : callable, optional
        Called with the missions found that pass, and the candidates tried.

    Returns
    -------
    SearchResult
        With fewer missions where `settings.max_tries` candidates did not hold as many.

    Raises
    ------
    ValueError
        If `count` or `outside` is negative.
    """
    if count < 0 or outside < 0:
        raise ValueError(f"count is {count} and outside {outside}: give numbers that are not negative")
    rng = np.random.default_rng(seed)
    search = _Search(traffic, settings)
    result = SearchResult()
    missing = {True: count, False: outside}
    while result.tries < settings.max_tries and (missing[True] or missing[False]):
        result.tries += 1
        found = search.candidate(rng)
        if isinstance(found, str):
            result.rejected[found] += 1
        elif not missing[found.passes]:
            result.rejected["enough of those that pass" if found.passes else "filter not passed"] += 1
        elif _repeats(found, result.missions, settings):
            result.rejected["like a mission found before"] += 1
        else:
            result.missions.append(found)
            missing[found.passes] -= 1
        if progress is not None and result.tries % 100 == 0:
            progress(count - missing[True], result.tries)
    return result


class _Search:
    """Draws candidates and judges them."""

    def __init__(self, traffic: SampledTraffic, settings: SearchSettings) -> None:
        self._traffic, self._settings = traffic, settings
        # The first volume decides about times and the end, the second about the number of losses.
        names = [settings.volume, *(name for name in PRESETS if name != settings.volume)]
        self._names = [settings.volume, f"{settings.volume}_miss_filter", *names[1:]]
        volumes = [PRESETS[name] for name in [settings.volume, *names]]
        self._volumes = np.array([[v.dthr, v.zthr, v.tthr, v.tcoa] for v in volumes])
        self._filtered = np.array([name.endswith("_miss_filter") for name in self._names])
        self._t_cross = np.empty(len(traffic.ids))
        self._t_loss = np.empty((len(traffic.ids), len(volumes)))
        # First row of each aircraft in `low`, so that rare visitors are drawn as often as circling ones.
        _, self._first = np.unique(traffic.low[:, 0], return_index=True)

    def candidate(self, rng: np.random.Generator) -> FoundMission | str:
        """Draw a mission through the neighbourhood of a random low aircraft; return it, or why not."""
        s, traffic = self._settings, self._traffic
        k = int(rng.integers(len(self._first)))
        end = self._first[k + 1] if k + 1 < len(self._first) else len(traffic.low)
        aircraft, sample = traffic.low[rng.integers(self._first[k], end)]
        samples = int(rng.integers(math.ceil(s.duration_min / STEP), math.floor(s.duration_max / STEP) + 1))
        # The meeting lies within the mission, not at its ends.
        before = int(rng.integers(samples // 8, samples - samples // 8))
        course = float(rng.uniform(0.0, 2 * math.pi))
        offset = rng.normal(size=3) * [500.0, 500.0, 60.0]
        first = int(sample) - before
        if first < 0 or first + samples >= len(traffic.times):
            return "beyond the recording"
        velocity = s.speed * np.array([math.cos(course), math.sin(course), 0.0])
        meeting = traffic.states[sample, aircraft, :3] + offset
        meeting[2] = -np.clip(-meeting[2], s.altitude_min, s.altitude_max)
        start = meeting - velocity * before * STEP
        inside = meetings(
            traffic.states,
            first,
            samples + 1,
            STEP,
            start,
            velocity,
            self._volumes,
            self._filtered,
            s.cross_radius,
            s.cross_height,
            s.ceiling,
            self._t_cross,
            self._t_loss,
        )
        if np.count_nonzero(np.isfinite(self._t_cross)) < s.min_aircraft:
            return "too few aircraft crossed"
        if np.count_nonzero(np.isfinite(self._t_loss[:, 1])) < s.min_losses:
            return "too few losses"
        if inside:
            return "ends inside the volume of an aircraft"
        return self._mission(first, samples * STEP, start, velocity, course)

    def _mission(
        self, first: int, duration: float, start: FloatArray, velocity: FloatArray, course: float
    ) -> FoundMission:
        s, traffic = self._settings, self._traffic
        t_start = float(traffic.times[first])
        met = []
        for i in np.flatnonzero(np.isfinite(self._t_cross) | np.isfinite(self._t_loss[:, 0])).tolist():
            losses = {n: float(t) for n, t in zip(self._names, self._t_loss[i], strict=True) if math.isfinite(t)}
            t_loss = losses.get(s.volume)
            seen = t_loss is None or self._seen(i, first, t_loss, start, velocity)
            met.append(Meeting(traffic.ids[i], float(self._t_cross[i]), losses, seen))
        lat, lon, altitude = traffic.frame.to_geodetic(np.stack([start, start + velocity * duration]))
        first_loss = min((m.losses[s.volume] for m in met if s.volume in m.losses), default=math.inf)
        return FoundMission(
            t_start,
            duration,
            np.column_stack([lat, lon, altitude]),
            s.speed,
            course,
            tuple(met),
            quiet=first_loss >= s.quiet_time,
            seen=all(m.seen for m in met),
        )

    def _seen(self, aircraft: int, first: int, t_loss: float, start: FloatArray, velocity: FloatArray) -> bool:
        """Return whether an aircraft was seen in time before its loss (see `SearchSettings`)."""
        s, traffic = self._settings, self._traffic
        t_loss_abs = float(traffic.times[first]) + t_loss
        heard = traffic.heard.get(traffic.ids[aircraft], np.empty(0))
        since = heard[(heard >= t_loss_abs - s.seen_time - s.fresh_age) & (heard <= t_loss_abs)]
        if not len(since) or since[0] > t_loss_abs - s.seen_time:
            return False
        if np.max(np.diff(np.append(since, t_loss_abs))) > s.max_gap:
            return False
        if t_loss < s.seen_time:
            return False  # the ownship did not fly yet
        sample = first + math.floor((t_loss - s.seen_time) / STEP)
        own = start + velocity * (sample - first) * STEP
        distance = np.hypot(*(traffic.states[sample, aircraft, :2] - own[:2]))
        return bool(distance <= s.receiver_range)


def _repeats(new: FoundMission, missions: list[FoundMission], settings: SearchSettings) -> bool:
    """Return whether too many conflicts of a mission are those of one mission before."""
    own = {address: new.t_start + t for address, t in new.losses(settings.volume).items()}
    for other in missions:
        theirs = {address: other.t_start + t for address, t in other.losses(settings.volume).items()}
        shared = sum(address in theirs and abs(t - theirs[address]) <= 60.0 for address, t in own.items())
        if shared > settings.shared_max * min(len(own), len(theirs)):
            return True
    return False
