import math

import numpy as np
import pytest

from tests import adsb_frames
from wideberth.sensors.adsb import cpr


def test_published_example():
    # 1090 MHz Riddle (Sun), section 5: 8D40621D58C382D690C8AC2863A7 and 8D40621D58C386435CC412692AD6.
    even, odd = (93000, 51372), (74158, 50194)
    lat, lon = cpr.decode_global(*even, *odd, latest_is_odd=False)
    assert lat == pytest.approx(52.2572021484375, abs=1e-10)
    assert lon == pytest.approx(3.91937255859375, abs=1e-10)
    lat, lon = cpr.decode_local(*even, odd=False, latitude=52.258, longitude=3.918)
    assert (lat, lon) == pytest.approx((52.2572021484375, 3.91937255859375), abs=1e-10)


def test_zones_agree_with_the_definition():
    latitudes = np.linspace(-90, 90, 40001)
    for latitude in latitudes:
        assert cpr.longitude_zones(latitude) == adsb_frames.zones(latitude)


def test_round_trip_everywhere():
    rng = np.random.default_rng(5)
    resolved = 0
    for latitude, longitude in zip(rng.uniform(-89.9, 89.9, 3000), rng.uniform(-180, 180, 3000), strict=True):
        even, odd = (adsb_frames.cpr(latitude, longitude, k) for k in (0, 1))
        for latest in (False, True):
            found = cpr.decode_global(*even, *odd, latest_is_odd=latest)
            if found is None:
                # Only where the two rounded latitudes lie either side of a change of zones.
                zones = {cpr.longitude_zones(latitude + d) for d in (-1e-4, 1e-4)}
                assert len(zones) == 2
                continue
            resolved += 1
            _check(found, latitude, longitude)
        reference = latitude + rng.uniform(-2, 2), longitude + rng.uniform(-2, 2)
        if abs(reference[0]) < 90:
            for k, code in enumerate((even, odd)):
                found = cpr.decode_local(*code, odd=bool(k), latitude=reference[0], longitude=reference[1])
                _check(found, latitude, longitude)
    assert resolved > 5900


def _check(found, latitude, longitude):
    assert found is not None
    assert -180 <= found[1] < 180
    assert found[0] == pytest.approx(latitude, abs=180 / 59 / 131072 * 1.01)
    width = 360 / max(cpr.longitude_zones(latitude) - 1, 1)
    error = (found[1] - longitude + 180) % 360 - 180
    assert abs(error) <= width / 131072


def test_pair_across_a_change_of_zones_is_refused():
    latitude = 10.470471  # 59 zones below, 58 above
    even, odd = adsb_frames.cpr(latitude - 0.01, 2.0, 0), adsb_frames.cpr(latitude + 0.01, 2.0, 1)
    assert cpr.decode_global(*even, *odd, latest_is_odd=True) is None


def test_positions_off_the_earth_are_refused():
    rng = np.random.default_rng(1)
    refused = 0
    for values in rng.integers(0, 131072, (2000, 4)):
        found = cpr.decode_global(*(int(v) for v in values), latest_is_odd=False)
        refused += found is None
        assert found is None or (abs(found[0]) <= 90 and abs(found[1]) <= 180)
    assert 0 < refused < 2000
    found = [cpr.decode_local(y, 0, odd=False, latitude=89.9, longitude=0.0) for y in range(0, 131072, 1000)]
    assert None in found
    assert all(f is None or abs(f[0]) <= 90 for f in found)
    assert math.isfinite(cpr.decode_local(0, 0, odd=True, latitude=-85.0, longitude=-179.0)[1])
