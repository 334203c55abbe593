"""Whatever the radar and the sky: plots are finite where measured, in range, with variances, and not too many."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from wideberth.sensors.radar.config import SimulatedRadarConfig
from wideberth.sensors.radar.plot_model import PlotModel

radars = st.fixed_dictionaries(
    {
        "channels": st.sampled_from([2, 4, 16]),
        "array_rows": st.sampled_from([1, 2, 4]),
        "averages": st.sampled_from([1, 8, 32]),
        "averaging": st.sampled_from(["coherent", "noncoherent"]),
        "detect_on": st.sampled_from(["channels", "beam"]),
        "swerling": st.sampled_from([0, 1, 3]),
        "false_alarm_probability": st.sampled_from([1e-9, 1e-3, 0.3]),
        "snr_threshold_db": st.sampled_from([None, 12.0]),
        "range_rate": st.booleans(),
        "azimuth_fov_deg": st.sampled_from([10.0, 180.0, 360.0]),
        "elevation_fov_deg": st.sampled_from([10.0, 180.0]),
        "transmit_power_w": st.sampled_from([1e-3, 1.0, 1e5]),
        "range_min_m": st.sampled_from([0.05, 100.0]),
    }
)
coordinates = st.sampled_from([0.0, 1e-9, 0.2, -3.0, 150.0, -299.9, 500.0, 1e5, math.nan])
skies = st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=6)


@settings(max_examples=150, deadline=None)
@given(radars, skies, st.integers(0, 5), st.integers(0, 1000))
def test_every_plot_is_sound(radar, sky, burst, seed):
    try:
        config = SimulatedRadarConfig.model_validate(radar)
    except ValidationError:
        return
    model = PlotModel(config)
    n = len(sky)
    places = np.array(sky, float).reshape(n, 3)
    z, variance = model.look(np.random.default_rng(seed), places, np.full(n, -20.0), np.full(n, 0.5), burst)
    assert z.shape == variance.shape and z.shape[1] == 4
    assert np.array_equal(np.isnan(z), np.isnan(variance))
    measured = [True, True, config.array_rows > 1, config.range_rate]
    assert (np.isfinite(z) == measured).all() and (variance[:, measured] > 0.0).all()
    assert (z[:, 0] > 0.0).all() and (z[:, 0] < config.range_limit + 100.0).all() and (np.abs(z[:, 1]) <= math.pi).all()
    assert burst <= len(z) <= burst + n + math.ceil(config.range_limit / config.range_bin) + 1
    assert len(z) - burst <= n or config.snr_threshold_db is None
