"""How well any detector could do that knows the velocity, but hears position and altitude with the sensor's errors.

Encounters are drawn as the experiment draws them. The error of the position hardly changes within an encounter (its
time constant is 1100 s), so that looking often does not help, and neither does filtering; the altitude error is the
same if it is a bias, and what a filter leaves of it if it is white. The detector raises an alarm where the probability
of entering the volume, given the measured miss and height, is high. ERRATA, "ADS-B paper".
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from wideberth.evaluation.montecarlo.curves import DetectorCurve, ScoreHistogram
from wideberth.evaluation.montecarlo.experiment import EncounterConfig, Experiment
from wideberth.sensors.adsb.accuracy import position_sigma
from wideberth.units import FOOT, KNOT, NAUTICAL_MILE

FloatArray = NDArray[np.float64]

FILTERED_ALTITUDE_SIGMA_M = 20 * FOOT
"""What a filter leaves of a white altitude error of 75.9 ft."""

_BLOCK = 100_000


@dataclass(frozen=True, slots=True)
class IdealDetector:
    """The curve of the ideal detector.

    Attributes
    ----------
    curve : DetectorCurve
        Its threshold is the negative log10 of the probability.
    samples : int
        Intruders drawn.
    position_sigma_m, altitude_sigma_m : float
        Errors of one horizontal axis and of the altitude.
    """

    curve: DetectorCurve
    samples: int
    position_sigma_m: float
    altitude_sigma_m: float


def ideal_curve(experiment: Experiment, samples: int, seed: int) -> IdealDetector:
    """Return P_cd against P_fa of the ideal detector.

    Parameters
    ----------
    experiment : Experiment
    samples : int
        Intruders to draw; of the collision set one in 54 is an event.
    seed : int

    Raises
    ------
    ValueError
        If there are no samples.
    """
    if samples < 1:
        raise ValueError(f"samples must be at least 1, got {samples}")
    scoring, sensor = experiment.scoring, experiment.scenario.sensor.config
    stationary = experiment.errors.start == "stationary"
    sigma_position = position_sigma(sensor.nacp) if stationary else 0.0
    bias = experiment.errors.altitude == "bias"
    sigma_altitude = sensor.altitude_sigma_ft * FOOT if bias else FILTERED_ALTITUDE_SIGMA_M
    rng = np.random.default_rng(seed)
    histogram = ScoreHistogram()
    for first in range(0, samples, _BLOCK):
        n = min(_BLOCK, samples - first)
        position, velocity, height = draw_intruders(experiment.encounter, n, rng)
        speed = np.hypot(*velocity.T)
        miss = (position[:, 0] * velocity[:, 1] - position[:, 1] * velocity[:, 0]) / speed
        t_cpa = -(position * velocity).sum(axis=1) / speed**2
        # A very slow intruder is not looked at before the run ends.
        near = np.sqrt(np.maximum(scoring.threshold_radius_m**2 - miss**2, 0.0)) / speed
        looked_at = t_cpa - np.maximum(near, scoring.tau_s) <= experiment.encounter.duration_s + scoring.lookahead_s
        event = looked_at & (np.abs(miss) < scoring.volume_radius_m) & (np.abs(height) < scoring.volume_half_height_m)
        heard_miss = miss + sigma_position * rng.standard_normal(n)
        heard_height = height + sigma_altitude * rng.standard_normal(n)
        probability = np.where(
            looked_at,
            _within(scoring.volume_radius_m, heard_miss, sigma_position)
            * _within(scoring.volume_half_height_m, heard_height, sigma_altitude),
            0.0,
        )
        with np.errstate(divide="ignore"):
            histogram.add(-np.log10(probability), event)
    return IdealDetector(histogram.curve(), samples, sigma_position, sigma_altitude)


def _within(limit: float, heard: FloatArray, sigma: float) -> FloatArray:
    """Return the probability that a value lies within +-`limit`, given what was heard of it."""
    if sigma == 0.0:
        return (np.abs(heard) < limit).astype(float)
    far = np.abs(heard)
    # The difference of the lower tails keeps its digits far outside.
    result: FloatArray = ndtr((limit - far) / sigma) - ndtr((-limit - far) / sigma)
    return result


def draw_intruders(
    encounter: EncounterConfig, count: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Draw first intruders of encounters.

    Parameters
    ----------
    encounter : EncounterConfig
    count : int
    rng : numpy.random.Generator

    Returns
    -------
    position, velocity : ndarray, shape (count, 2)
        North and east of the ownship, m, and relative to its velocity, m/s.
    height : ndarray, shape (count,)
        Above the ownship, m.
    """
    angle = 2 * np.pi * (np.arange(count) % encounter.points) / encounter.points
    position = encounter.circle_nmi * NAUTICAL_MILE * np.column_stack([np.cos(angle), np.sin(angle)])
    own = encounter.ownship_speed_kt * KNOT
    low, high = encounter.intruder_speed_min_kt * KNOT, encounter.intruder_speed_max_kt * KNOT
    velocity = np.empty((count, 2))
    speed = rng.uniform(low, high, count)
    todo = np.arange(count)
    while todo.size:
        if encounter.redraw == "speed_and_heading":
            speed[todo] = rng.uniform(low, high, todo.size)
        else:
            # Slower than the ownship's part along its bearing, an intruder enters the circle on no heading.
            slow = todo[speed[todo] <= -own * np.cos(angle[todo])]
            speed[slow] = rng.uniform(low, high, slow.size)
        heading = rng.uniform(-np.pi, np.pi, todo.size)
        velocity[todo, 0] = speed[todo] * np.cos(heading) - own
        velocity[todo, 1] = speed[todo] * np.sin(heading)
        todo = todo[(velocity[todo] * position[todo]).sum(axis=1) >= 0.0]
    offset = encounter.altitude_offset_ft * FOOT
    return position, velocity, rng.uniform(-offset, offset, count)
