"""A radar on the ground: where it holds tracks all round, and where the aircraft may fly inside that."""

import math

import numpy as np
import pytest

from wideberth.analysis.escapes import escape_range, range_by_escapes
from wideberth.analysis.ground_sizing import ground_protection, surveillance_volume
from wideberth.analysis.sizing_config import AircraftConfig, GroundRadarConfig
from wideberth.sensors.radar.coverage import confirmed_range
from wideberth.units import DEGREE, GRAVITY

WING = AircraftConfig()


def test_a_hemisphere_of_the_worst_direction():
    radar = GroundRadarConfig()
    (volume,) = surveillance_volume(radar, 10.0, rcs=0.1)
    assert volume.shape == "hemisphere"
    assert volume.radius == volume.height == confirmed_range(0.1, 10.0, radar, elevation=0.3)
    # An antenna that sees less well near the horizon: that is what counts all round.
    lobe = GroundRadarConfig(elevation_beamwidth_deg=60.0, transmit_power_w=1.0)
    (narrow,) = surveillance_volume(lobe, 10.0, rcs=0.1)
    assert narrow.radius == pytest.approx(float(confirmed_range(0.1, 10.0, lobe, elevation=0.0)))
    assert narrow.radius < float(confirmed_range(0.1, 10.0, lobe, elevation=1.5))


def test_who_does_not_look_all_round_has_no_volume():
    assert surveillance_volume(GroundRadarConfig(azimuth_fov_deg=120.0), 10.0) == (None,)
    three = GroundRadarConfig(azimuth_fov_deg=120.0, boresight_azimuths_deg=(0.0, 120.0, 240.0))
    assert surveillance_volume(three, 10.0)[0] is not None
    # And who does not look up has none without a ceiling.
    low = {"boresight_elevation_deg": 15.0, "elevation_fov_deg": 40.0}
    assert surveillance_volume(GroundRadarConfig(**low), 10.0) == (None,)
    (volume,) = surveillance_volume(GroundRadarConfig(**low, ceiling_m=100.0), 10.0)
    assert volume.shape == "cylinder" and volume.height == 100.0
    assert math.degrees(math.atan2(100.0, volume.radius)) < 35.0
    assert math.hypot(volume.radius, 100.0) <= confirmed_range(1.0, 10.0, GroundRadarConfig(**low), elevation=0.2)
    assert surveillance_volume(GroundRadarConfig(**low, ceiling_m=600.0), 10.0) == (None,)


def test_the_operation_volume():
    found = ground_protection(GroundRadarConfig(), WING, [10.0, 15.0, 150.0], required_range=range_by_escapes, rcs=0.1)
    assert found.protected == [True, False, False]
    bearings = np.radians(np.arange(0.25, 180.0, 0.5))
    needed = escape_range("turn", bearings[:, None], [10.0, 15.0, 150.0], WING).max(axis=0)
    np.testing.assert_allclose(found.required_range, needed, rtol=5e-3)
    turn = WING.speed_cruise_mps**2 / (GRAVITY * math.tan(WING.bank_max_deg * DEGREE))
    assert found.turn_margin == pytest.approx(turn)
    volume, seen = found.operation[0], found.surveillance[0]
    assert volume.radius == pytest.approx(seen.radius - found.required_range[0] - turn) and volume.all_round
    below = ground_protection(
        GroundRadarConfig(ceiling_m=120.0), WING, [10.0], required_range=range_by_escapes, rcs=0.1
    ).operation[0]
    assert below.height == 120.0 and below.radius < seen.radius - found.required_range[0]
    hover = AircraftConfig(speed_min_mps=0.0, escapes=("slow_down",))
    never = ground_protection(GroundRadarConfig(), hover, [20.0], required_range=range_by_escapes)
    assert never.operation == (None,) and math.isinf(never.required_range[0])
