import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wideberth.links.remote_id import remote_id_fields, remote_id_report
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import SourceInfo

FIELDS = {
    "status": 2,
    "direction": 9000,
    "speed_horizontal": 1250,
    "speed_vertical": -50,
    "latitude": 401_234_567,
    "longitude": -751_234_567,
    "altitude_barometric": 120.0,
    "altitude_geodetic": 131.5,
    "horizontal_accuracy": 10,
    "speed_accuracy": 3,
    "timestamp": 3599.5,
}
HOUR = 3600.0 * 450_000


def test_fields_become_a_report():
    report = remote_id_report(HOUR + 0.2, "1581F5FKB22A0010", **FIELDS)
    assert report is not None
    # The stamp is of the hour before.
    assert report.t == HOUR - 0.5
    assert math.degrees(report.latitude) == pytest.approx(40.1234567)
    assert math.degrees(report.longitude) == pytest.approx(-75.1234567)
    assert (report.pressure_altitude, report.geometric_altitude) == (120.0, 131.5)
    assert (report.velocity_north, report.velocity_east) == (pytest.approx(0.0, abs=1e-9), pytest.approx(12.5))
    assert report.climb_rate == -0.5
    assert not report.on_ground
    assert (report.info.callsign, report.info.nacp, report.info.nacv) == ("1581F5FKB22A0010", 10, 3)
    assert report.address.startswith("~")
    assert len(report.address) == 7
    assert report.address != remote_id_report(0.0, "other", **FIELDS).address


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"latitude": 0, "longitude": 0}, "latitude"),
        ({"direction": 36100}, "velocity_north"),
        ({"speed_horizontal": 25500}, "velocity_east"),
        ({"speed_vertical": 6300}, "climb_rate"),
        ({"altitude_barometric": -1000.0}, "pressure_altitude"),
        ({"altitude_geodetic": math.nan}, "geometric_altitude"),
    ],
)
def test_what_is_not_known_is_nan(change, name):
    assert math.isnan(getattr(remote_id_report(HOUR, "x", **FIELDS | change), name))


def test_stamps_that_do_not_fit_give_way_to_the_time_of_receipt():
    for stamp in (65535.0, math.nan, -1.0, 1800.0, 5.0):
        assert remote_id_report(HOUR, "x", **FIELDS | {"timestamp": stamp}).t == HOUR


def test_states_and_refusals():
    assert remote_id_report(HOUR, "x", **FIELDS | {"status": 1}).on_ground
    assert remote_id_report(HOUR, "x", **FIELDS | {"status": 3}).info.emergency == "general emergency"
    assert remote_id_report(HOUR, "x", **FIELDS | {"latitude": 900_000_001}) is None
    assert remote_id_report(math.nan, "x", **FIELDS) is None
    nothing = {"latitude": 0, "longitude": 0, "direction": 36100, "speed_vertical": 6300} | {
        "altitude_barometric": -1000.0,
        "altitude_geodetic": -1000.0,
    }
    assert remote_id_report(HOUR, "x", **FIELDS | nothing) is None
    info = remote_id_report(HOUR, "x", **FIELDS | {"horizontal_accuracy": 12, "speed_accuracy": 0}).info
    assert (info.nacp, info.nacv) == (11, None)


@given(
    st.floats(-1.5, 1.5),
    st.floats(-3.1, 3.1),
    st.floats(-500.0, 5000.0),
    st.floats(-100.0, 100.0),
    st.floats(-100.0, 100.0),
    st.floats(-60.0, 60.0),
    st.booleans(),
)
def test_a_report_goes_round(latitude, longitude, altitude, north, east, up, ground):
    info = SourceInfo(callsign="ID", nacp=9, nacv=2)
    sent = AdsbReport(HOUR + 12.5, "", latitude, longitude, altitude, altitude + 30.0, north, east, up, ground, info)
    found = remote_id_report(HOUR + 12.6, "ID", **remote_id_fields(sent))
    assert found is not None
    assert found.t == HOUR + 12.5
    assert found.latitude == pytest.approx(latitude, abs=1e-9) or abs(latitude) + abs(longitude) < 1e-8
    assert found.longitude == pytest.approx(longitude, abs=1e-9) or abs(latitude) + abs(longitude) < 1e-8
    assert (found.pressure_altitude, found.on_ground) == (altitude, ground)
    assert found.velocity_north == pytest.approx(north, abs=0.03)
    assert found.velocity_east == pytest.approx(east, abs=0.03)
    assert found.climb_rate == pytest.approx(up, abs=0.006)
    assert (found.info.nacp, found.info.nacv) == (9, 2)


INTEGERS = st.integers(-(2**31), 2**31 - 1)


@given(
    st.floats(),
    st.text(max_size=20),
    st.fixed_dictionaries(
        dict.fromkeys([name for name, value in FIELDS.items() if isinstance(value, int)], INTEGERS)
        | dict.fromkeys(("altitude_barometric", "altitude_geodetic", "timestamp"), st.floats(width=32))
    ),
)
def test_any_fields_are_taken_or_refused(t, identity, fields):
    report = remote_id_report(t, identity, **fields)
    if report is None:
        return
    assert math.isfinite(report.t)
    assert report.t <= t
    assert math.isnan(report.latitude) or abs(report.latitude) <= math.pi / 2
    for name in ("pressure_altitude", "geometric_altitude", "velocity_north", "velocity_east", "climb_rate"):
        assert not math.isinf(getattr(report, name))
