"""What a radar on the ground does for an aircraft: where it may fly, for each speed of an intruder (thesis 4.1)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wideberth.analysis.operation_volume import OperationVolume, SurveillanceVolume, operation_volume
from wideberth.analysis.sensor_sizing import RequiredRangeFunction
from wideberth.analysis.sizing_config import AircraftConfig, GroundRadarConfig
from wideberth.argument_checks import POSITIVE, FloatArray, checked
from wideberth.sensors.radar.coverage import confirmed_range, off_boresight
from wideberth.units import DEGREE, GRAVITY

_ELEVATIONS = np.radians(np.linspace(0.0, 90.0, 31))
_BEARINGS = np.radians(np.arange(-180.0, 180.0, 0.5))


@dataclass(frozen=True, slots=True)
class GroundProtection:
    """What a radar on the ground does for an aircraft, for each intruder speed.

    Attributes
    ----------
    intruder_speeds : ndarray, shape (s,)
        m/s.
    required_range : ndarray, shape (s,)
        From whichever bearing takes most, m.
    turn_margin : float
        Radius of the aircraft's turn, kept free inside the border, m.
    surveillance : tuple of (SurveillanceVolume or None)
        Where the radar holds tracks of intruders of that speed; None: nowhere that goes all round.
    operation : tuple of (OperationVolume or None)
        Where the aircraft is protected; None as above, and where no range is enough.
    """

    intruder_speeds: FloatArray
    required_range: FloatArray
    turn_margin: float
    surveillance: tuple[SurveillanceVolume | None, ...]
    operation: tuple[OperationVolume | None, ...]

    @property
    def protected(self) -> list[bool]:
        """Whether there is an operation volume, for each speed."""
        return [volume is not None and volume.radius > 0.0 for volume in self.operation]


def surveillance_volume(
    sensor: GroundRadarConfig, intruder_speed: ArrayLike, *, rcs: float = 1.0
) -> tuple[SurveillanceVolume | None, ...]:
    """Return where a radar on the ground holds confirmed tracks, whatever the direction an intruder comes from.

    The intruder flies straight at the radar: no other closes faster. Of the directions the worst counts. With a
    ceiling the volume is the largest cylinder all of whose rim is seen; the radar need not see straight up then.

    Parameters
    ----------
    sensor : GroundRadarConfig
    intruder_speed : array_like, shape (s,)
        m/s.
    rcs : float
        Radar cross-section of the intruder, m2.

    Returns
    -------
    tuple of (SurveillanceVolume or None)
        One for each speed; None where the radar does not look all round, or holds no track.

    Raises
    ------
    ValueError
        If a speed or cross-section is not finite and positive.
    """
    speeds = np.atleast_1d(checked("intruder_speed", intruder_speed, POSITIVE))
    # The gain falls with the angle from the nearest boresight, so the azimuth between two of them is the worst.
    azimuths = np.radians(np.arange(0.0, 360.0, 1.0))
    off, _, _ = off_boresight(azimuths, sensor.boresight_elevation_deg * DEGREE, sensor)
    worst = azimuths[np.argmax(np.abs(off))]
    reach = confirmed_range(rcs, speeds[:, None], sensor, azimuth=worst, elevation=_ELEVATIONS)
    if sensor.ceiling_m is None:
        radii = reach.min(axis=1)
        return tuple(SurveillanceVolume(float(r), float(r), "hemisphere") if r > 0.0 else None for r in radii)
    return tuple(_cylinder(row, sensor.ceiling_m) for row in reach)


def _cylinder(reach: FloatArray, ceiling: float) -> SurveillanceVolume | None:
    """Return the widest cylinder of the height that a reach by elevation holds, but for what is straight above."""
    for slant in np.linspace(reach.max(), 0.0, 400, endpoint=False):
        if slant <= ceiling:
            return None
        # One elevation more than the rim's, so that the rim lies between two that are seen.
        rim = min(int(np.searchsorted(_ELEVATIONS, math.asin(ceiling / slant))), len(reach) - 1)
        if reach[: rim + 1].min() >= slant:
            return SurveillanceVolume(math.sqrt(slant**2 - ceiling**2), ceiling, "cylinder")
    return None


def ground_protection(
    sensor: GroundRadarConfig,
    aircraft: AircraftConfig,
    intruder_speeds: ArrayLike,
    *,
    required_range: RequiredRangeFunction,
    rcs: float = 1.0,
) -> GroundProtection:
    """Return where a radar on the ground protects an aircraft.

    Intruders may come from any direction, from above too (below a ceiling: from the sides only).

    Parameters
    ----------
    sensor : GroundRadarConfig
    aircraft : AircraftConfig
    intruder_speeds : array_like, shape (s,)
        m/s.
    required_range : callable
        See `sensor_sizing.RequiredRangeFunction`.
    rcs : float
        Radar cross-section of the intruders, m2.

    Returns
    -------
    GroundProtection

    Raises
    ------
    ValueError
        If a speed or cross-section is not finite and positive.
    """
    speeds = np.atleast_1d(checked("intruder_speeds", intruder_speeds, POSITIVE))
    bearing, speed = np.meshgrid(_BEARINGS, speeds, indexing="ij")
    required = np.nan_to_num(required_range(bearing, speed, aircraft), nan=0.0, posinf=math.inf).max(axis=0)
    margin = aircraft.speed_cruise_mps**2 / (GRAVITY * math.tan(aircraft.bank_max_deg * DEGREE))
    volumes = surveillance_volume(sensor, speeds, rcs=rcs)
    height = None if sensor.ceiling_m is None else 0.0
    operation = tuple(
        operation_volume(volume, float(needed), required_height=height, turn_margin=margin)
        if volume is not None and math.isfinite(needed)
        else None
        for volume, needed in zip(volumes, required, strict=True)
    )
    return GroundProtection(speeds, required, margin, volumes, operation)
