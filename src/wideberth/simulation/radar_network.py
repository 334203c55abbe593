"""Plots of a network of radars that see the same true aircraft, each with its own pose, rate, errors and faults.

One radar is a network of one. The noise of every look of a radar is its own counter-based stream, keyed by the seed,
the radar and the number of the look: adding a radar at the end changes nothing in the plots of the others.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from wideberth.argument_checks import FINITE, NOT_NEGATIVE, POSITIVE, checked
from wideberth.tracking import radar_kernels, registration_kernels
from wideberth.types import DetectionModel, FloatArray, Scan


@dataclass(frozen=True, slots=True)
class RadarSite:
    """A radar of the network, as it is told to be and as it really is.

    Attributes
    ----------
    name : str
    position : ndarray, shape (3,)
        Told position, NED, m.
    detection : DetectionModel
        Probability of detection against range.
    sigma : tuple of float
        Standard deviations of range (m), azimuth (rad), elevation (rad) and range rate (m/s). NaN for the elevation or
        the range rate: not measured.
    attitude : ndarray, shape (3, 3)
        Told C_ned_sensor.
    field_of_view : tuple of float
        Azimuth and elevation half-widths, rad.
    period_s, phase_s : float
        Looks are at ``phase_s``, ``phase_s + period_s``, ...
    clutter : float
        Mean number of false plots in a look, spread evenly over the volume seen.
    bias : ndarray, shape (10,)
        As in `wideberth.tracking.registration_kernels`.
    changes : tuple of (float, ndarray)
        From each time (s) on, increasing, the biases are these: a radar that is moved and not told so.
    silent : tuple of (float, float)
        From, until (s): no scans at all.
    blind : tuple of (float, float)
        From, until (s): scans with clutter only.
    """

    name: str
    position: FloatArray
    detection: DetectionModel
    sigma: tuple[float, float, float, float]
    attitude: FloatArray = field(default_factory=lambda: np.eye(3))
    field_of_view: tuple[float, float] = (math.pi, math.pi / 2)
    period_s: float = 0.5
    phase_s: float = 0.0
    clutter: float = 0.0
    bias: FloatArray = field(default_factory=lambda: np.zeros(registration_kernels.BIASES))
    changes: tuple[tuple[float, FloatArray], ...] = ()
    silent: tuple[tuple[float, float], ...] = ()
    blind: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        who = f"radar {self.name}: "
        checked(who + "position", self.position, FINITE)
        checked(who + "attitude", self.attitude, FINITE)
        checked(who + "period_s", self.period_s, POSITIVE)
        checked(who + "phase_s", self.phase_s, FINITE)
        checked(who + "clutter", self.clutter, NOT_NEGATIVE)
        checked(who + "sigma of range and azimuth", self.sigma[:2], POSITIVE)
        for bias in (self.bias, *(b for _, b in self.changes)):
            if np.shape(bias) != (registration_kernels.BIASES,):
                raise ValueError(f"{who}bias must have shape ({registration_kernels.BIASES},), got {np.shape(bias)}")
            checked(who + "bias", bias, FINITE)

    def bias_at(self, t: float) -> FloatArray:
        """Return the biases (10,) at time `t`, s."""
        current = self.bias
        for since, bias in self.changes:
            if t >= since:
                current = bias
        return current


def simulate_plots(
    sites: Sequence[RadarSite], t: FloatArray, positions: FloatArray, velocities: FloatArray, seed: int
) -> list[list[Scan]]:
    """Return what radars see of true aircraft, step by step.

    Parameters
    ----------
    sites : sequence of RadarSite
        The place in the sequence keys a radar's noise.
    t : ndarray, shape (n,)
        Ends of the steps, s, increasing.
    positions, velocities : ndarray, shape (n, k, 3)
        True states at these times, NED, m and m/s; NaN where an aircraft is not there. In between they are interpolated
        by the cubic that fits both.
    seed : int
        Not negative.

    Returns
    -------
    list of list of Scan
        For each time the scans since the time before (none for the first but a look at it exactly), in order of time.

    Raises
    ------
    ValueError
        If times do not increase, shapes do not fit, or two radars have the same name.
    """
    times = checked("t", t, FINITE)
    if times.ndim != 1 or len(times) < 2 or not (np.diff(times) > 0.0).all():
        raise ValueError("t must be at least two increasing times")
    if positions.shape != velocities.shape or positions.ndim != 3 or positions.shape[::2] != (len(times), 3):
        raise ValueError(
            f"positions {positions.shape} and velocities {velocities.shape} must both be ({len(times)}, aircraft, 3)"
        )
    if len({site.name for site in sites}) != len(sites):
        raise ValueError("names of radars must differ")
    checked("seed", seed, NOT_NEGATIVE)
    steps: list[list[Scan]] = [[] for _ in times]
    for number, site in enumerate(sites):
        first = math.ceil((times[0] - site.phase_s) / site.period_s - 1e-9)
        last = math.floor((times[-1] - site.phase_s) / site.period_s + 1e-9)
        for look in range(first, last + 1):
            when = min(max(site.phase_s + look * site.period_s, times[0]), times[-1])
            if any(start <= when < end for start, end in site.silent):
                continue
            step = int(np.searchsorted(times, when - 1e-9))
            # The counter starts at a different multiple for each look; a look draws far fewer numbers than that.
            generator = np.random.Philox(key=[seed, number], counter=[0, 0, look % 2**63, 0])
            scan = _look(site, when, _states(when, times, positions, velocities), np.random.Generator(generator))
            steps[step].append(scan)
    for scans in steps:
        scans.sort(key=lambda scan: scan.t)
    return steps


def _states(when: float, times: FloatArray, positions: FloatArray, velocities: FloatArray) -> FloatArray:
    """Return position and velocity (k, 6) by Hermite's cubic; a radar's clock offset moves along the velocity."""
    i = min(max(int(np.searchsorted(times, when, side="right")) - 1, 0), len(times) - 2)
    h = times[i + 1] - times[i]
    s = (when - times[i]) / h
    p0, p1, v0, v1 = positions[i], positions[i + 1], velocities[i] * h, velocities[i + 1] * h
    step = p1 - p0
    position = p0 + s * (v0 + s * ((3 * step - 2 * v0 - v1) + s * (v0 + v1 - 2 * step)))
    velocity = (v0 + s * (2 * (3 * step - 2 * v0 - v1) + 3 * s * (v0 + v1 - 2 * step))) / h
    return np.concatenate([position, velocity], axis=1)


def _look(site: RadarSite, t: float, states: FloatArray, random: np.random.Generator) -> Scan:
    sigma = np.array(site.sigma)
    bias = site.bias_at(t)
    k = len(states)
    # Drawn for all aircraft whether seen or not, so that one aircraft's presence does not change another's noise.
    chance, noise = random.random(k), random.standard_normal((k, 4))
    blind = any(start <= t < end for start, end in site.blind)
    pose = np.zeros((4, 3))
    registration_kernels.true_pose(bias, site.position, site.attitude, pose)
    seen, plot = np.zeros(3), np.zeros(3)
    slopes = np.zeros((3, registration_kernels.BIASES)), np.zeros((3, 6)), np.zeros((12, 3))
    rows: list[FloatArray] = []
    for i in range(0 if blind else k):
        if not np.isfinite(states[i]).all():
            continue
        radar_kernels.to_sensor(pose[3], pose[:3], states[i], seen)
        radar_kernels.to_plot(seen, plot)
        if not _within(site, plot) or chance[i] >= _probability(site.detection, plot[0]):
            continue
        registration_kernels.biased_plot(bias, site.position, site.attitude, states[i], bias[-1], plot, *slopes)
        rate = radar_kernels.range_rate(pose[3], np.zeros(3), states[i])
        rows.append(np.array([*plot, rate]) + noise[i] * sigma)
    rows.extend(_clutter(site, random))
    z = np.array(rows).reshape(-1, 4)
    z[:, 1] = np.mod(z[:, 1] + math.pi, 2.0 * math.pi) - math.pi
    z = z[random.permutation(len(z))]
    told = t + float(bias[-1])
    return Scan(
        told,
        told,
        site.name,
        "radar",
        z,
        np.where(np.isnan(z)[:, :, None] & np.eye(4, dtype=np.bool_), np.nan, np.diag(np.nan_to_num(sigma) ** 2)),
        np.full(len(z), told),
        sensor_position=site.position,
        sensor_attitude=site.attitude,
        field_of_view=site.field_of_view,
        detection=site.detection,
    )


def _within(site: RadarSite, plot: FloatArray) -> bool:
    return bool(abs(plot[1]) <= site.field_of_view[0] and abs(plot[2]) <= site.field_of_view[1])


def _probability(detection: DetectionModel, distance: float) -> float:
    return float(np.interp(distance, detection.ranges, detection.probabilities, right=0.0))


def _clutter(site: RadarSite, random: np.random.Generator) -> list[FloatArray]:
    """Return false plots, even over the volume, at range rates of slow things."""
    n = int(random.poisson(site.clutter))
    far = float(site.detection.ranges[-1])
    distance = far * np.cbrt(random.random(n))
    azimuth = site.field_of_view[0] * (2.0 * random.random(n) - 1.0)
    elevation = np.arcsin(math.sin(site.field_of_view[1]) * (2.0 * random.random(n) - 1.0))
    rate = random.normal(0.0, 3.0, n)
    rows: list[FloatArray] = []
    position, seen, plot = np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(n):
        radar_kernels.to_position(site.position, site.attitude, distance[i], azimuth[i], elevation[i], position)
        # What lies below the radar's level is mirrored to above it: nothing is seen in the ground.
        position[2] = site.position[2] - abs(position[2] - site.position[2])
        radar_kernels.to_sensor(site.position, site.attitude, position, seen)
        radar_kernels.to_plot(seen, plot)
        row = np.array([*plot, rate[i]])
        row[np.isnan(site.sigma)] = np.nan
        if _within(site, plot):
            rows.append(row)
    return rows
