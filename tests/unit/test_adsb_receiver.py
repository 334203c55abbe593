import math

import numpy as np
import pytest

from wideberth.frames import LocalFrame
from wideberth.sensors.adsb.accuracy import measurement_covariance
from wideberth.sensors.adsb.receiver import AdsbReceiver
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.adsb.report_list import ReportList
from wideberth.types import SourceInfo

FRAME = LocalFrame(math.radians(48.0), math.radians(2.0))


def receiver(*reports, **config):
    return AdsbReceiver(AdsbReceiver.Config(**config), ReportList("test", reports, {}, {}), FRAME)


def position(t, north=0.0, east=0.0, altitude=900.0, address="abcdef", **values):
    latitude, longitude, _ = FRAME.to_geodetic([north, east, 0.0])
    return AdsbReport(t, address, float(latitude), float(longitude), pressure_altitude=altitude, **values)


def test_positions_and_velocities():
    info = SourceInfo(nacp=9, nacv=2)
    one = receiver(
        position(0.5, 5000.0, -3000.0, info=info),
        AdsbReport(0.8, "abcdef", velocity_north=50.0, velocity_east=-20.0, climb_rate=2.0, info=info),
    )
    assert one.sense(0.4).z.shape == (0, 6)
    scan = one.sense(1.0)
    assert (scan.kind, scan.sensor, scan.t, scan.source_ids) == ("adsb", "adsb", 1.0, ("abcdef", "abcdef"))
    assert scan.t_valid.tolist() == [0.5, 0.8]
    np.testing.assert_allclose(scan.z[0], [5000.0, -3000.0, -900.0, np.nan, np.nan, np.nan], atol=1e-6)
    turned = FRAME.velocity_to_ned(*FRAME.to_geodetic([5000.0, -3000.0, 0.0])[:2], [50.0, -20.0, -2.0])
    np.testing.assert_allclose(scan.z[1], [np.nan, np.nan, np.nan, *turned], atol=1e-9)
    assert not np.allclose(turned[:2], [50.0, -20.0], atol=1e-3)  # meridians converge
    np.testing.assert_array_equal(
        scan.R, measurement_covariance((info, info), one.Config().noise, np.array([np.nan, 2.0]))
    )
    assert scan.sources == (info, info)
    assert scan.health == one.health(1.0)
    assert one.counters["reports passed"] == 2


def test_aircraft_out_of_range_are_counted_with_their_velocities():
    one = receiver(
        position(0.0, 10_000.0),
        position(0.1, 30_000.0, address="far111"),
        AdsbReport(0.2, "far111", velocity_north=1.0, velocity_east=1.0),
        AdsbReport(0.3, "abcdef", velocity_north=1.0, velocity_east=1.0),
        range_max_m=15_000.0,
    )
    scan = one.sense(1.0, np.zeros(3))
    assert scan.source_ids == ("abcdef", "abcdef")
    assert one.health(1.0).rejects == {"out of range": 2}
    near_it = receiver(position(0.1, 30_000.0), range_max_m=15_000.0).sense(1.0, np.array([20_000.0, 0.0, 0.0]))
    assert len(near_it.z) == 1


def test_altitude_window():
    one = receiver(
        position(0.0, altitude=900.0),
        position(0.1, altitude=9000.0, address="high11"),
        position(0.2, altitude=math.nan, address="none11"),
        altitude_window_m=1000.0,
    )
    assert one.sense(1.0, np.array([0.0, 0.0, -500.0])).source_ids == ("abcdef", "none11")
    assert one.health(1.0).rejects == {"outside the altitude window": 1}


def test_velocity_before_any_position_is_counted():
    one = receiver(AdsbReport(0.2, "abcdef", velocity_north=1.0, velocity_east=1.0), position(0.5))
    assert len(one.sense(1.0).z) == 1
    assert one.counters["no position yet"] == 1


def test_geometric_altitude_only_where_there_is_no_other():
    one = receiver(
        position(0.0, altitude=900.0, geometric_altitude=1000.0),
        position(0.1, altitude=math.nan, geometric_altitude=1010.0),
        position(0.2, altitude=math.nan, geometric_altitude=700.0, address="other1"),
    )
    np.testing.assert_array_equal(one.sense(1.0).z[:, 2], [-900.0, np.nan, -700.0])


def test_aircraft_on_the_ground_are_left_out():
    one = receiver(position(0.0, on_ground=True))
    assert len(one.sense(1.0).z) == 0
    assert one.counters["surface"] == 1


@pytest.mark.parametrize("key", ["range_max_m", "altitude_window_m"])
def test_settings_are_checked(key):
    with pytest.raises(ValueError, match=key):
        AdsbReceiver.Config(**{key: 0.0})


def test_each_report_of_one_call_keeps_its_own_place():
    one = receiver(position(0.1, 1000.0), position(0.6, 1100.0), position(0.9, 1150.0))
    np.testing.assert_allclose(one.sense(1.0).z[:, 0], [1000.0, 1100.0, 1150.0], atol=1e-6)
