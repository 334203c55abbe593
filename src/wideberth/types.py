"""The data that flows through the corridor: frozen values in SI units, radians and the local frame of `frames`."""

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class AlertLevel(enum.IntEnum):
    """How serious a threat is; higher is worse. `UNKNOWN`: the sensors cannot tell, which is not the same as clear."""

    CLEAR = 0
    UNKNOWN = 1
    PREVENTIVE = 2
    CORRECTIVE = 3
    WARNING = 4


class TrackStatus(enum.IntEnum):
    """Life of a track: not yet trusted, trusted and fed, trusted but without recent measurements."""

    TENTATIVE = 0
    CONFIRMED = 1
    COASTING = 2


@dataclass(frozen=True, slots=True)
class Ownship:
    """State of our own aircraft.

    Attributes
    ----------
    t : float
        Time, s.
    position, velocity : ndarray, shape (3,)
        Local NED, m and m/s.
    attitude : ndarray, shape (3, 3)
        Rotation C_ned_body.
    covariance : ndarray, shape (6, 6)
        Of position and velocity.
    state : str
        "ok", or in words why the state is only an extrapolation that may be wrong.
    """

    t: float
    position: FloatArray
    velocity: FloatArray
    attitude: FloatArray = field(default_factory=lambda: np.eye(3))
    covariance: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))
    state: str = "ok"

    def __post_init__(self) -> None:
        for name in ("position", "velocity"):
            if not all(map(math.isfinite, getattr(self, name))):
                raise ValueError(f"ownship {name} is not finite: {getattr(self, name)}")


@dataclass(frozen=True, slots=True)
class SourceInfo:
    """What a cooperative aircraft says of itself beside its state; None where it has not said it (yet).

    ADS-B paper, table 1. `nic_bound` is the containment radius of the NIC, m.
    """

    callsign: str | None = None
    category: str | None = None
    nic: int | None = None
    nacp: int | None = None
    nacv: int | None = None
    sil: int | None = None
    sda: int | None = None
    squawk: str | None = None
    ident: bool | None = None
    emergency: str | None = None
    length: float | None = None
    width: float | None = None
    tcas_equipped: bool | None = None
    tcas_advisory: bool | None = None
    adsb_in: bool | None = None


@dataclass(frozen=True, slots=True)
class SensorHealth:
    """How a sensor does: age of its last message (s, inf if none), messages a second, rejects by cause, and state."""

    age: float
    rate: float
    rejects: Mapping[str, int]
    state: str = "ok"


@dataclass(frozen=True, slots=True)
class DetectionModel:
    """How probably a sensor sees an aircraft inside its field of view, against range.

    Attributes
    ----------
    ranges : ndarray, shape (n,)
        Increasing, m. Nearer than the first the first probability holds; beyond the last nothing is seen.
    probabilities : ndarray, shape (n,)
        Linear in between.
    """

    ranges: FloatArray
    probabilities: FloatArray

    def __post_init__(self) -> None:
        ranges, probabilities = self.ranges, self.probabilities
        if ranges.ndim != 1 or ranges.shape != probabilities.shape or not len(ranges):
            raise ValueError(f"ranges {ranges.shape} and probabilities {probabilities.shape}: one each is needed")
        if not (np.isfinite(ranges).all() and (np.diff(ranges) > 0.0).all() and ranges[0] >= 0.0):
            raise ValueError("ranges must be finite, not negative, and increase")
        if not ((probabilities >= 0.0) & (probabilities <= 1.0)).all():
            raise ValueError("probabilities must lie in [0, 1]")


@dataclass(frozen=True, slots=True)
class Scan:
    """Measurements of one sensor over one step. An empty scan is information: the sensor lives and saw nothing.

    Attributes
    ----------
    t, t_received : float
        Time of validity (the end of the step) and of receipt, s.
    sensor : str
        Name of the sensor.
    kind : str
        Kind of measurement. ``"adsb"``: z is (k, 6) = north, east, down, velocity north, east, down; NaN where a report
        lacks the element; R is the covariance of the *white* part of the error (the slowly varying part, from NACp, is
        the tracker's to add).
        ``"radar"``: z is (k, 4) = range (m), azimuth (rad, clockwise from the sensor's forward axis), elevation (rad,
        above its horizontal plane), range rate (m/s, positive opening); NaN where the sensor does not give the element;
        R is diagonal.
        ``"radar_cone"``: as ``"radar"``, but of a line of elements, which cannot tell elevation: the azimuth column is
        the angle from the plane at right angles to the line, asin(right / distance) in the sensor's axes (thesis
        (5.1)), and the elevation is NaN.
    z : ndarray, shape (k, m)
    R : ndarray, shape (k, m, m)
    t_valid : ndarray, shape (k,)
        Time of each measurement, s.
    source_ids : tuple of str
        The address of each measurement's aircraft, empty for sensors that do not identify.
    sources : tuple of SourceInfo
        What each aircraft says of itself, in the order of `source_ids`.
    sensor_position : ndarray, shape (3,)
    sensor_attitude : ndarray, shape (3, 3)
    field_of_view : tuple of float
        Azimuth and elevation half-widths, rad; (pi, pi/2) sees everything.
    detection : DetectionModel or None
        None where the sensor has not said it.
    health : SensorHealth or None
        How the sensor does at time `t`.
    """

    t: float
    t_received: float
    sensor: str
    kind: str
    z: FloatArray
    R: FloatArray
    t_valid: FloatArray
    source_ids: tuple[str, ...] = ()
    sources: tuple[SourceInfo, ...] = ()
    sensor_position: FloatArray = field(default_factory=lambda: np.zeros(3))
    sensor_attitude: FloatArray = field(default_factory=lambda: np.eye(3))
    field_of_view: tuple[float, float] = (np.pi, np.pi / 2)
    detection: DetectionModel | None = None
    health: SensorHealth | None = None


@dataclass(frozen=True, slots=True)
class Track:
    """An estimated aircraft.

    Attributes
    ----------
    id : str
        Stable name: the address, or a number for sensors that do not identify.
    t, t_last_update : float
        Time of the estimate and of the last accepted measurement, s.
    position, velocity, acceleration : ndarray, shape (3,)
        Local NED; m, m/s, m/s2.
    covariance : ndarray, shape (9, 9)
        Of position, velocity, acceleration, whatever the filter's states; includes slowly varying biases.
    status : TrackStatus
    existence : float
        Probability that the aircraft exists.
    is_ownship : bool
    sources : tuple of str
        Sensors that feed it.
    info : SourceInfo
    """

    id: str
    t: float
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    covariance: FloatArray
    status: TrackStatus
    t_last_update: float
    existence: float = 1.0
    is_ownship: bool = False
    sources: tuple[str, ...] = ()
    info: SourceInfo = field(default_factory=SourceInfo)

    @property
    def label(self) -> str:
        """What to call it in front of people: the callsign where known, else the id in capitals."""
        return self.info.callsign or self.id.upper()


@dataclass(frozen=True, slots=True)
class Threat:
    """What a track means for the ownship, in seconds from now and metres; NaN where it does not apply.

    Attributes
    ----------
    track_id : str
    t_cpa : float
        Time to the horizontal closest point of approach.
    horizontal_miss, vertical_miss : float
        Separation there.
    time_to_loss : float
        Time to loss of well clear.
    interval : tuple of float
        When it is inside the volume.
    probability : float
        Of entering the volume.
    level : AlertLevel
    """

    track_id: str
    t_cpa: float
    horizontal_miss: float
    vertical_miss: float
    time_to_loss: float
    interval: tuple[float, float]
    probability: float
    level: AlertLevel


@dataclass(frozen=True, slots=True)
class Maneuver:
    """A path to fly instead of the mission.

    Attributes
    ----------
    t : float
        When it was chosen, s.
    waypoints : ndarray, shape (n, 3)
        Local NED, m; the first is the next to reach.
    times : ndarray, shape (n,)
        When each is to be reached, s.
    reason : str
        In words, for people.
    valid_until : float
        After this time it must not be flown further.
    threat_ids : tuple of str
        The tracks it avoids.
    least_bad : bool
        True where every path was blocked and this one is only the least bad.
    """

    t: float
    waypoints: FloatArray
    times: FloatArray
    reason: str
    valid_until: float
    threat_ids: tuple[str, ...] = ()
    least_bad: bool = False


@dataclass(frozen=True, slots=True)
class Mission:
    """The path that the ownship is to fly when nothing is in the way.

    Attributes
    ----------
    waypoints : ndarray, shape (n, 3)
        Local NED, m; n >= 2, the first is the start.
    speeds : ndarray, shape (n,)
        Ground speed wanted on the leg that ends at each waypoint, m/s; the first is the speed at the start.
    t_start : float
        Time at the first waypoint, s.
    index : int
        The waypoint that is being flown to; ``len(waypoints)`` once all are reached.
    assumed : bool
        Whether nobody has given it: it is straight flight, and the sky is never told to be clear for it.
    """

    waypoints: FloatArray
    speeds: FloatArray
    t_start: float
    index: int = 1
    assumed: bool = False


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything about one step: the log record, and what a station shows.

    Attributes
    ----------
    t : float
    ownship : Ownship
        As it is believed to be at `t`, whatever telemetry says.
    tracks : tuple of Track
    threats : tuple of Threat
    maneuver : Maneuver or None
        None: fly the mission.
    alert_state : AlertLevel
        The worst level of all threats; at least `AlertLevel.UNKNOWN` if a sensor is silent, if some direction around
        the ownship is not watched by any, if a near aircraft was lost, if the ownship's own state is not "ok", or if
        the mission is assumed.
    mission_index : int
        The mission waypoint that is flown to.
    sensors : mapping of str to SensorHealth
    stage_times : mapping of str to float
        CPU seconds of each stage; ignored by replay comparison.
    events : tuple of str
        What happened in this step, in words (track lost, maneuver chosen, source silent).
    """

    t: float
    ownship: Ownship
    tracks: tuple[Track, ...]
    threats: tuple[Threat, ...]
    maneuver: Maneuver | None
    alert_state: AlertLevel
    mission_index: int
    sensors: Mapping[str, SensorHealth]
    stage_times: Mapping[str, float]
    events: tuple[str, ...] = ()
