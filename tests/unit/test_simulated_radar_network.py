"""Plots of simulated radars: the right number, the right errors, and streams that do not disturb each other."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import binom, chi2, poisson

from tests.naive import registration as naive
from wideberth.simulation.radar_network import RadarSite, simulate_plots
from wideberth.types import DetectionModel, FloatArray

DETECTION = DetectionModel(np.array([0.0, 1000.0, 2000.0]), np.array([1.0, 0.8, 0.4]))
SIGMA = (5.0, 0.01, 0.02, 0.5)
BIAS = np.array([12.0, 0.01, 0.05, -0.03, 0.02, -0.04, 8.0, -6.0, 3.0, 0.1])
SITE = RadarSite("west", np.array([10.0, 20.0, -5.0]), DETECTION, SIGMA, bias=BIAS)


def hovering(position: FloatArray, seconds: float, velocity: FloatArray | None = None):
    t = np.array([0.0, seconds])
    velocity = np.zeros(3) if velocity is None else velocity
    positions = position + velocity * t[:, None]
    return t, positions[:, None], np.tile(velocity, (2, 1, 1))


def test_measurements_have_the_biases_and_the_noise() -> None:
    """Of 2000 looks: whitened errors by the naive twin, mean and spread of each element within 99.9 %."""
    velocity = np.array([0.3, -0.2, 0.05])
    t, positions, velocities = hovering(np.array([400.0, 500.0, -150.0]), 999.9, velocity)
    scans = simulate_plots(
        [dataclasses.replace(SITE, detection=DetectionModel(np.array([9e3]), np.ones(1)))], t, positions, velocities, 1
    )
    flat = [scan for step in scans for scan in step]
    assert len(flat) == 2000 and [len(step) for step in scans] == [1, 1999]
    errors = []
    for scan in flat:
        assert scan.t == scan.t_received == scan.t_valid[0] and scan.z.shape == (1, 4)
        true_t = scan.t - BIAS[9]
        x = np.concatenate([positions[0, 0] + velocity * true_t, velocity])
        expected = naive.biased_plot(BIAS, SITE.position, SITE.attitude, x, BIAS[9])
        line = x[:3] - (SITE.position + BIAS[6:9])
        rate = line @ velocity / np.linalg.norm(line)
        errors.append([*naive.difference(scan.z[0, :3], expected), scan.z[0, 3] - rate])
        assert np.array_equal(scan.R[0], np.diag(np.square(SIGMA)))
    white = np.array(errors) / SIGMA
    low, high = chi2.ppf([0.000125, 0.999875], 2000)
    assert (np.abs(white.mean(axis=0)) < 3.7 / math.sqrt(2000)).all()
    assert ((low < (white**2).sum(axis=0)) & ((white**2).sum(axis=0) < high)).all()


def test_detections_and_clutter_are_as_many_as_stated() -> None:
    """At 1500 m the probability is 0.6; two-sided bounds of 99.9 % each."""
    site = dataclasses.replace(SITE, bias=np.zeros(10), clutter=3.0)
    t, positions, velocities = hovering(SITE.position + np.array([1500.0, 0.0, -1.0]), 999.9)
    flat = [scan for step in simulate_plots([site], t, positions, velocities, 2) for scan in step]
    z = np.concatenate([scan.z for scan in flat])
    # A clutter plot within four sigma of the aircraft is rare: 1e-5 of them.
    mine = (np.abs(z[:, :3] - [1500.0, 0.0, 1.0 / 1500.0]) < 4.0 * np.array(SIGMA[:3])).all(axis=1)
    low, high = binom.ppf([0.0005, 0.9995], 2000, 0.6)
    assert low - 1 <= mine.sum() <= high + 1
    low, high = poisson.ppf([0.0005, 0.9995], 6000)
    assert low - 1 <= (~mine).sum() <= high + 1
    clutter = z[~mine]
    assert (clutter[:, 2] >= 0.0).all() and (clutter[:, 0] <= 2000.0).all()
    # Even over the volume: half of it is beyond 0.794 of the range.
    assert 0.45 < (clutter[:, 0] > 2000.0 * 0.5 ** (1 / 3)).mean() < 0.55


def test_beyond_the_range_and_outside_the_field_of_view_nothing_is_seen() -> None:
    narrow = dataclasses.replace(SITE, bias=np.zeros(10), field_of_view=(0.5, 0.5))
    cases = {
        (500.0, 0.0, -50.0): True,
        (0.0, 500.0, -50.0): False,
        (300.0, 0.0, -800.0): False,
        (2100.0, 0.0, -9.0): False,
    }
    for place, seen in cases.items():
        t, positions, velocities = hovering(SITE.position + np.array(place), 50.0)
        plots = sum(len(s.z) for step in simulate_plots([narrow], t, positions, velocities, 3) for s in step)
        assert plots > 50 if seen else plots == 0


def test_a_radar_added_or_an_aircraft_out_of_sight_changes_nothing_for_the_others() -> None:
    t, positions, velocities = hovering(np.array([400.0, 500.0, -150.0]), 60.0)
    site = dataclasses.replace(SITE, clutter=2.0)
    other = dataclasses.replace(SITE, name="east", period_s=0.3, phase_s=0.17)
    alone = simulate_plots([site], t, positions, velocities, 4)
    together = simulate_plots([site, other], t, positions, velocities, 4)
    for a, b in zip(alone, together, strict=True):
        mine = [scan for scan in b if scan.sensor == "west"]
        assert len(a) == len(mine)
        assert all(np.array_equal(x.z, y.z) for x, y in zip(a, mine, strict=True))
        assert [scan.t for scan in b] == sorted(scan.t for scan in b)
    again = simulate_plots([site], t, positions, velocities, 5)
    assert any(not np.array_equal(x[0].z, y[0].z) for x, y in zip(alone[1:], again[1:], strict=True))


def test_rates_phases_silence_and_changes() -> None:
    t = np.arange(0.0, 10.01, 0.5)
    positions, velocities = np.tile([600.0, 0.0, -100.0], (len(t), 1, 1)), np.zeros((len(t), 1, 3))
    shifted = np.zeros(10)
    shifted[0] = 300.0
    site = dataclasses.replace(
        SITE,
        bias=np.zeros(10),
        period_s=0.4,
        phase_s=0.1,
        silent=((2.0, 4.0),),
        blind=((4.0, 6.0),),
        changes=((8.0, shifted),),
    )
    steps = simulate_plots([site], t, positions, velocities, 6)
    times = [scan.t for step in steps for scan in step]
    assert times == pytest.approx([x for x in np.arange(0.1, 10.0, 0.4) if not 2.0 <= x < 4.0])
    for k, step in enumerate(steps):
        assert all(t[k] - 0.5 < scan.t <= t[k] + 1e-9 for scan in step)
    for scan in (scan for step in steps for scan in step):
        if 4.0 <= scan.t < 6.0:
            assert len(scan.z) == 0 and scan.z.shape == (0, 4) and scan.R.shape == (0, 4, 4)
        elif len(scan.z):
            assert (scan.z[0, 0] > 800.0) == (scan.t >= 8.0)


def test_aircraft_that_are_not_there_and_elements_not_measured() -> None:
    t, positions, velocities = hovering(np.array([400.0, 500.0, -150.0]), 20.0)
    positions = np.concatenate([positions, np.full((2, 1, 3), np.nan)], axis=1)
    velocities = np.concatenate([velocities, np.zeros((2, 1, 3))], axis=1)
    site = dataclasses.replace(SITE, sigma=(5.0, 0.01, math.nan, math.nan), clutter=1.0)
    for scan in simulate_plots([site], t, positions, velocities, 7)[1]:
        assert np.isnan(scan.z[:, 2:]).all() and np.isfinite(scan.z[:, :2]).all()
        assert np.isnan(scan.R[:, [2, 3], [2, 3]]).all() and np.isfinite(scan.R[:, [0, 1], [0, 1]]).all()
        assert (scan.R[:, 0, 1:] == 0.0).all()


def test_truth_between_the_steps_follows_a_turn() -> None:
    t = np.arange(0.0, 20.1, 1.0)
    angle = 0.2 * t
    positions = np.stack([500 + 100 * np.sin(angle), 100 * np.cos(angle), np.full_like(t, -100.0)], axis=1)[:, None]
    velocities = np.stack([20 * np.cos(angle), -20 * np.sin(angle), np.zeros_like(t)], axis=1)[:, None]
    exact = dataclasses.replace(
        SITE, position=np.zeros(3), bias=np.zeros(10), sigma=(1e-9, 1e-12, 1e-12, 1e-9), period_s=0.37
    )
    for scan in (scan for step in simulate_plots([exact], t, positions, velocities, 8) for scan in step):
        a = 0.2 * scan.t
        truth = np.array([500 + 100 * np.sin(a), 100 * np.cos(a), -100.0])
        for z in scan.z:
            assert z[0] == pytest.approx(np.linalg.norm(truth), abs=0.002)
            assert z[3] == pytest.approx(
                truth @ [20 * np.cos(a), -20 * np.sin(a), 0.0] / np.linalg.norm(truth), abs=0.01
            )


def test_wrong_arguments_are_named() -> None:
    t, positions, velocities = hovering(np.ones(3), 5.0)
    with pytest.raises(ValueError, match="two increasing times"):
        simulate_plots([SITE], t[::-1], positions, velocities, 1)
    with pytest.raises(ValueError, match=r"must both be \(2, aircraft, 3\)"):
        simulate_plots([SITE], t, positions[:, 0], velocities[:, 0], 1)
    with pytest.raises(ValueError, match="names of radars must differ"):
        simulate_plots([SITE, SITE], t, positions, velocities, 1)
    with pytest.raises(ValueError, match="seed must be"):
        simulate_plots([SITE], t, positions, velocities, -1)
    for change, words in (
        ({"position": np.array([0.0, math.nan, 0.0])}, "radar west: position must be finite"),
        ({"period_s": 0.0}, "radar west: period_s must be positive"),
        ({"bias": np.zeros(3)}, r"radar west: bias must have shape \(10,\)"),
        ({"changes": ((1.0, np.full(10, math.nan)),)}, "radar west: bias must be finite"),
        ({"clutter": -1.0}, "radar west: clutter must be"),
        ({"sigma": (0.0, 0.1, 0.1, 0.1)}, "radar west: sigma of range and azimuth must be positive"),
    ):
        with pytest.raises(ValueError, match=words):
            dataclasses.replace(SITE, **change)
