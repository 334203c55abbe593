"""The plot-level radar model against the samples: detection, bias, variance, false alarms, pairs.

Bounds are those that a right model passes in all but one of a thousand runs of a line, with what the model is allowed
to be off by: 0.06 in the probability of detection, 15 % in standard deviations.
"""

import math

import numba
import numpy as np
import pytest
from scipy import stats

from wideberth.sensors.radar.config import SimulatedRadarConfig
from wideberth.sensors.radar.plot_model import PlotModel
from wideberth.sensors.radar.sampled_look import SampledLook

pytestmark = pytest.mark.skipif(bool(vars(numba.config)["DISABLE_JIT"]), reason="takes minutes without the compiler")

# Point targets: the floors stand for the extent of aircraft.
POINTS = {"range_floor_bins": 1e-9, "direction_floor_beamwidths": 1e-9, "range_rate_floor_bins": 1e-9}
BASE = {"if_bandwidth_mhz": 0.125, "range_rate": True, "azimuth_beamwidth_deg": 360.0, "elevation_beamwidth_deg": 360.0}
LINE = {**BASE, "elevation_fov_deg": 90.0}
PLANE = {**LINE, "channels": 16, "array_rows": 4, "averages": 20}
LOOKS = 160
AZIMUTH, ELEVATION = 0.2, 0.1


def config_of(level, settings, **more):
    return SimulatedRadarConfig.model_validate({**settings, "level": level, "plot_model": POINTS, **more})


def looks_of(config, places, rates, ratio_db, n, seed):
    """Yield true places (k, 3) and plots of many looks at aircraft of a mean ratio, dB, each elsewhere in its bin."""
    model, random = PlotModel(config), np.random.default_rng(seed)
    sampled = SampledLook(config, model, "radar") if config.level == "samples" else None
    for k in range(n):
        shift = config.range_bin * (random.random() - 0.5)
        distance = np.linalg.norm(places, axis=1)
        towards = places / distance[:, None]
        at = (distance + shift)[:, None] * towards
        there = np.isfinite(at).all(axis=1)
        rcs = np.ones(len(at))
        rcs[there] = 10.0 ** (ratio_db / 10.0) / model.ratio(at[there], rcs[there])
        if sampled is None:
            z, _ = model.look(random, at, rates, rcs)
        else:
            z, _ = sampled.look(float(k), random, at, rates[:, None] * towards, rcs)
        yield distance + shift, z


def place(distance):
    level = math.cos(ELEVATION)
    return distance * np.array([[level * math.cos(AZIMUTH), level * math.sin(AZIMUTH), -math.sin(ELEVATION)]])


def seen(level, settings, ratio_db, rate, seed, n=LOOKS, **more):
    """Return the errors, (detected, 4), of the plots of one aircraft."""
    config = config_of(level, settings, **more)
    angle = math.asin(math.cos(ELEVATION) * math.sin(AZIMUTH)) if config.array_rows == 1 else AZIMUTH
    errors = []
    for distance, z in looks_of(config, place(60.0), np.array([rate]), ratio_db, n, seed):
        near = z[np.abs(z[:, 0] - distance[0]) < 4.0 * config.range_bin]
        if len(near):
            best = near[np.argmin(np.abs(near[:, 0] - distance[0]))]
            errors.append(best - [distance[0], angle, ELEVATION, rate])
    return np.reshape(errors, (-1, 4))


@pytest.mark.parametrize("settings", [LINE, PLANE], ids=["line", "plane"])
@pytest.mark.parametrize(
    ("swerling", "ratio_db", "rate"), [(0, -3.0, 0.0), (0, 0.5, 20.0), (1, 3.0, 3.0), (3, 0.0, -12.0)]
)
def test_detection_is_as_probable(settings, swerling, ratio_db, rate):
    # Of the plane 20 sweeps are 320 powers, of the line 32 are 128.
    ratio_db -= 2.0 if settings is PLANE else 0.0
    counts = [
        len(seen(level, settings, ratio_db, rate, [swerling, k], swerling=swerling))
        for k, level in enumerate(("samples", "plots"))
    ]
    mean = np.clip(sum(counts) / (2 * LOOKS), 0.02, 0.98)
    assert 0.05 < mean < 0.97
    assert abs(counts[0] - counts[1]) / LOOKS < 3.3 * math.sqrt(2.0 * mean * (1.0 - mean) / LOOKS) + 0.06


@pytest.mark.parametrize("settings", [LINE, PLANE], ids=["line", "plane"])
@pytest.mark.parametrize(("ratio_db", "rate"), [(8.0, 3.0), (20.0, -14.0)])
def test_errors_have_the_same_bias_and_variance(settings, ratio_db, rate):
    a, b = (seen(level, settings, ratio_db, rate, 5, swerling=0) for level in ("samples", "plots"))
    assert len(a) > 0.97 * LOOKS and len(b) > 0.97 * LOOKS
    for x, y in zip(a.T, b.T, strict=True):
        assert np.isnan(x).all() == np.isnan(y).all()
        if np.isnan(x).all():
            continue
        x, y = x[np.isfinite(x)], y[np.isfinite(y)]
        assert len(x) > 0.95 * LOOKS  # range rates are known
        low, high = stats.f.ppf([5e-4, 1.0 - 5e-4], len(x), len(y))
        assert low / 1.15**2 < np.var(x) / np.var(y) < high * 1.15**2
        assert abs(np.mean(x) - np.mean(y)) < 3.3 * math.sqrt((np.var(x) + np.var(y)) / LOOKS) + 0.1 * np.std(x)


@pytest.mark.parametrize("settings", [LINE, PLANE], ids=["line", "plane"])
@pytest.mark.parametrize(("p_fa", "n"), [(0.01, 200), (0.1, 20)])
def test_noise_alone_gives_as_many_plots(settings, p_fa, n):
    nothing, counts = np.full((1, 3), np.nan), []
    for level in ("samples", "plots"):
        config = config_of(level, settings, false_alarm_probability=p_fa, processing={"max_plots": 4096})
        counts.append(sum(len(z) for _, z in looks_of(config, nothing, np.zeros(1), 0.0, n, 3)))
    # Poisson counts; the model's may be off by a fifth.
    assert min(counts) > 20
    assert abs(counts[0] - counts[1]) < 3.3 * math.sqrt(sum(counts)) + 0.2 * max(counts)


@pytest.mark.parametrize(
    ("beamformer", "bins", "sines", "resolved"),
    [
        ("conventional", 0.8, 0.0, False),
        ("conventional", 0.0, 0.6, False),
        ("conventional", 2.5, 0.0, True),
        ("conventional", 2.5, 0.4, True),
        ("mvdr", 0.0, 0.1, True),
        ("mvdr", 0.0, 0.6, True),
        ("mvdr", 1.5, 0.0, True),
    ],
)
def test_pairs_are_resolved_or_not_alike(beamformer, bins, sines, resolved):
    shares = []
    for level in ("samples", "plots"):
        config = config_of(level, LINE, swerling=0, processing={"beamformer": beamformer})
        side = 0.5 * sines * np.array([-1.0, 1.0])
        distance = 60.0 + np.array([0.0, bins * config.range_bin])
        places = np.stack([distance * np.sqrt(1.0 - side**2), distance * side, np.zeros(2)], axis=1)
        rates = np.array([0.0, 1.0])  # of which the phases differ from sweep to sweep
        near = [
            np.count_nonzero(np.abs(z[:, 0] - d.mean()) < (3.0 + bins) * config.range_bin) >= 2
            for d, z in looks_of(config, places, rates, 15.0, 40, 8)
        ]
        shares.append(float(np.mean(near)))
    assert all(share > 0.8 if resolved else share < 0.3 for share in shares), shares
