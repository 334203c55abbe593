"""Quality categories of ADS-B against the published tables, and the covariance made of them."""

import math

import numpy as np
import pytest

from wideberth.sensors.adsb.accuracy import (
    climb_rate_sigma,
    gross_error_rate,
    measurement_covariance,
    nic_bound,
    position_sigma,
    velocity_sigma,
)
from wideberth.sensors.adsb.config import AdsbNoiseConfig
from wideberth.types import SourceInfo
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT, NAUTICAL_MILE

# RTCA DO-260B, tables 2-71 (NACp), 2-22 (NACv) and 2-70 (NIC)
EPU = {1: 10, 2: 4, 3: 2, 4: 1, 5: 0.5, 6: 0.3, 7: 0.1, 8: 0.05}
CONTAINMENT = {1: 20, 2: 8, 3: 4, 4: 2, 5: 1, 6: 0.6, 7: 0.2, 8: 0.1}
METRES = {9: 30.0, 10: 10.0, 11: 3.0}
CONTAINMENT_METRES = {9: 75.0, 10: 25.0, 11: 7.5}
RADIUS = math.sqrt(-2 * math.log(0.05))


@pytest.mark.parametrize(("nacp", "bound"), [*((k, v * NAUTICAL_MILE) for k, v in EPU.items()), *METRES.items()])
def test_nacp(nacp: int, bound: float) -> None:
    assert position_sigma(nacp) == pytest.approx(bound / RADIUS)


@pytest.mark.parametrize(("nacv", "bound"), [(1, 10.0), (2, 3.0), (3, 1.0), (4, 0.3)])
def test_nacv(nacv: int, bound: float) -> None:
    assert velocity_sigma(nacv) == pytest.approx(bound / RADIUS)


@pytest.mark.parametrize(
    ("nic", "bound"), [*((k, v * NAUTICAL_MILE) for k, v in CONTAINMENT.items()), *CONTAINMENT_METRES.items()]
)
def test_nic(nic: int, bound: float) -> None:
    assert nic_bound(nic) == pytest.approx(bound)


def test_unknown_categories_promise_little() -> None:
    assert math.isinf(nic_bound(0))
    assert position_sigma(0) > position_sigma(1)
    assert velocity_sigma(0) > velocity_sigma(1)


def test_numbers_of_the_paper() -> None:
    assert position_sigma(8) / FOOT == pytest.approx(124.0, abs=0.2)
    assert velocity_sigma(1) / KNOT == pytest.approx(8.0, abs=0.1)
    assert nic_bound(7) / FOOT == pytest.approx(1215.2, abs=0.1)
    assert gross_error_rate(3, 2) == pytest.approx(1e-7 + 1e-5)


@pytest.mark.parametrize("value", [-1, 12])
def test_categories_that_do_not_exist(value: int) -> None:
    for function in (position_sigma, velocity_sigma, nic_bound):
        with pytest.raises(ValueError, match="does not exist"):
            function(value)
    with pytest.raises(ValueError, match="SIL"):
        gross_error_rate(4, 2)


def test_covariance_is_the_white_part() -> None:
    r = measurement_covariance([SourceInfo()], AdsbNoiseConfig())[0]
    assert np.array_equal(r, np.diag(np.diag(r)))
    assert r[0, 0] == pytest.approx(3.66**2 + 5.0**2 / 12)
    assert r[2, 2] == pytest.approx((75.9**2 + 25**2 / 12) * FOOT**2)
    assert r[3, 3] == pytest.approx(velocity_sigma(1) ** 2)
    assert r[5, 5] == pytest.approx((27.96**2 + 64**2 / 12) * FOOT_PER_MINUTE**2)


def test_reported_accuracy_replaces_the_assumed() -> None:
    infos = [SourceInfo(nacp=11, nacv=3), SourceInfo(nacp=2, nacv=2), SourceInfo(nacp=14, nacv=7), SourceInfo()]
    r = measurement_covariance(infos, AdsbNoiseConfig())
    assert r[0, 0, 0] == pytest.approx(position_sigma(11) ** 2 + 25 / 12)
    assert r[1, 0, 0] == r[3, 0, 0]  # a bad NACp is a slowly varying error: not in the white part
    assert r[0, 3, 3] == pytest.approx(velocity_sigma(3) ** 2)
    assert np.array_equal(r[2], r[3])  # reserved values: as if nothing had been said


def test_climb_rate_has_two_regimes() -> None:
    config = AdsbNoiseConfig()
    resolution = 64 / math.sqrt(12)
    for climb, sigma in ((0.0, 27.96), (-499.0, 27.96), (501.0, 501 * 0.05 / 1.645), (-3000.0, 3000 * 0.05 / 1.645)):
        expected = math.hypot(sigma, resolution) * FOOT_PER_MINUTE
        assert climb_rate_sigma(climb * FOOT_PER_MINUTE, config) == pytest.approx(expected)
    climbs = np.array([0.0, 10.0, math.nan])
    r = measurement_covariance([SourceInfo()] * 3, config, climbs)
    assert r[1, 5, 5] == pytest.approx(climb_rate_sigma(10.0, config) ** 2)
    assert r[2, 5, 5] == r[0, 5, 5]


def test_no_reports() -> None:
    assert measurement_covariance([], AdsbNoiseConfig()).shape == (0, 6, 6)
