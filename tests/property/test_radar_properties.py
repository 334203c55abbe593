"""What must hold of any radar: the fourth power, order, and inverses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.coverage import confirmed_range
from wideberth.sensors.radar.detection import detection_probability, required_snr_db
from wideberth.sensors.radar.link_budget import max_range, snr_db

radars = st.builds(
    RadarConfig,
    carrier_frequency_ghz=st.floats(1.0, 80.0),
    bandwidth_mhz=st.floats(10.0, 1000.0),
    transmit_power_w=st.floats(0.01, 10.0),
    transmit_gain_dbi=st.floats(0.0, 30.0),
    receive_gain_dbi=st.floats(0.0, 30.0),
    noise_figure_db=st.floats(0.0, 15.0),
    averages=st.integers(1, 32),
    channels=st.integers(1, 16),
)
distance = st.floats(1.0, 1e5)
section = st.floats(1e-4, 1e3)
swerling = st.sampled_from([0, 1, 3])


@given(radars, distance, section, st.floats(1.01, 100.0))
def test_the_fourth_power(radar: RadarConfig, r: float, rcs: float, factor: float) -> None:
    here = snr_db(r, rcs, radar)
    assert here - snr_db(r * factor, rcs, radar) == pytest.approx(40 * np.log10(factor), abs=1e-9)
    assert snr_db(r * factor, rcs * factor**4, radar) == pytest.approx(here, abs=1e-9)


@given(radars, distance, section, st.floats(-1.0, 1.0))
def test_max_range_is_the_inverse(radar: RadarConfig, r: float, rcs: float, azimuth: float) -> None:
    level = snr_db(r, rcs, radar, azimuth=azimuth)
    assert max_range(rcs, level, radar, azimuth=azimuth) == pytest.approx(r, rel=1e-9)
    assert max_range(16 * rcs, level, radar, azimuth=azimuth) == pytest.approx(2 * r, rel=1e-9)


@given(st.floats(-40.0, 40.0), st.floats(0.0, 10.0), st.floats(1e-12, 0.4), swerling, st.integers(1, 500))
def test_more_signal_is_detected_no_less(snr: float, more: float, p_fa: float, kind: int, looks: int) -> None:
    low, high = detection_probability([snr, snr + more], p_fa, kind, looks=looks)
    assert p_fa * (1 - 1e-9) <= low <= high + 1e-11 and high <= 1.0
    # More false alarms allowed, more detections; more looks as well.
    assert detection_probability(snr, 2 * p_fa, kind, looks=looks) >= low - 1e-11
    assert detection_probability(snr, p_fa, kind, looks=looks + 1) >= low - 1e-9


@given(st.floats(0.01, 0.99), st.floats(1e-12, 0.3), swerling, st.integers(1, 500))
def test_the_required_ratio_is_the_inverse(p_d: float, p_fa: float, kind: int, looks: int) -> None:
    if p_d <= 1.01 * p_fa:
        return
    level = required_snr_db(p_d, p_fa, kind, looks=looks)
    assert detection_probability(level, p_fa, kind, looks=looks) == pytest.approx(p_d, rel=1e-6)


@settings(max_examples=30)
@given(
    st.floats(1e-4, 10.0),
    st.floats(1.0, 4.0),
    st.floats(5.0, 150.0),
    st.floats(-1.04, 1.04),
    st.integers(1, 6),
    st.integers(0, 4),
)
def test_confirmed_range_in_order(
    rcs: float, factor: float, speed: float, azimuth: float, hits: int, spare: int
) -> None:
    radar = RadarConfig(confirm_hits=hits, confirm_window=hits + spare)
    small, large = confirmed_range([rcs, rcs * factor], speed, radar, azimuth=azimuth)
    assert 0.0 <= small <= large <= radar.range_limit
    assert confirmed_range(rcs, speed, radar, azimuth=0.0) >= small
    assert confirmed_range(rcs, speed, radar, azimuth=-azimuth) == pytest.approx(small, abs=1e-6)
    stricter = radar.model_copy(update={"confirmation_probability": 0.99})
    assert confirmed_range(rcs, speed, stricter, azimuth=azimuth) <= small
