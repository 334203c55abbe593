"""Reports that senders encode come back from the readers."""

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from wideberth.sensors.adsb import beast, cpr, quality, sbs_encoder, squitters
from wideberth.sensors.adsb.accuracy import nacp_of_sigma, nacv_of_sigma, position_sigma, velocity_sigma
from wideberth.sensors.adsb.beast import BeastReader
from wideberth.sensors.adsb.gdl90 import of_report as gdl90
from wideberth.sensors.adsb.gdl90.reader import Gdl90Reader
from wideberth.sensors.adsb.readers import Reader
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.adsb.sbs import SbsReader
from wideberth.sensors.adsb.uat import of_report as uat
from wideberth.sensors.adsb.uat.reader import UatReader
from wideberth.types import SourceInfo
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

T = 1_700_000_000.25


def beast_of(report: AdsbReport) -> bytes:
    return b"".join(beast.encode(frame, k) for k, frame in enumerate(squitters.encode(report)))


FORMATS = {
    "gdl90": (gdl90.encode, Gdl90Reader),
    "sbs": (sbs_encoder.encode, SbsReader),
    "beast": (beast_of, BeastReader),
    "uat": (uat.encode, UatReader),
}
# Position (deg), altitude, velocity and climb that a format's steps leave.
STEPS = {
    "gdl90": (2.2e-5, 12.6 * FOOT, 0.0248 * 400 + 0.52 * KNOT, 33 * FOOT_PER_MINUTE),
    "sbs": (1e-6, 0.6 * FOOT, 0.2 * KNOT, 0.6 * FOOT_PER_MINUTE),
    "beast": (5e-5, 12.6 * FOOT, 0.8 * KNOT, 33 * FOOT_PER_MINUTE),
    "uat": (2.2e-5, 12.6 * FOOT, 0.8 * KNOT, 33 * FOOT_PER_MINUTE),
}


def back(fmt: str, report: AdsbReport) -> list[AdsbReport]:
    encode, make = FORMATS[fmt]
    reader: Reader = make()
    return reader.feed(encode(report), T)


def value(reports: list[AdsbReport], name: str) -> float:
    values = [v for report in reports if not math.isnan(v := getattr(report, name))]
    return values[-1] if values else math.nan


@pytest.mark.parametrize("fmt", FORMATS)
@given(
    st.floats(-1.4, 1.4),
    st.floats(-3.1, 3.1),
    st.floats(-200.0, 12_000.0),
    st.floats(-250.0, 250.0),
    st.floats(-250.0, 250.0),
    st.floats(-40.0, 40.0),
    st.integers(1, 0xFFFFFE),
    st.booleans(),
)
def test_reports_go_round(fmt, latitude, longitude, altitude, north, east, up, address, other):
    # SBS has no way to tell this place from none.
    assume(fmt != "sbs" or abs(latitude) + abs(longitude) > 1e-6)
    name = f"{'~' * other}{address:06x}"
    info = SourceInfo(callsign="N123AB", category="A2", nic=8, nacp=9, nacv=2, sil=3, sda=2)
    sent = AdsbReport(T, name, latitude, longitude, altitude, math.nan, north, east, up, info=info)
    found = back(fmt, sent)
    degrees, feet, speed, climb = STEPS[fmt]
    assert {report.address for report in found} == {name}
    assert math.degrees(value(found, "latitude") - latitude) == pytest.approx(0.0, abs=degrees)
    around = math.remainder(value(found, "longitude") - longitude, 2 * math.pi)
    assert math.degrees(around) * math.cos(latitude) == pytest.approx(0.0, abs=degrees)
    assert value(found, "pressure_altitude") == pytest.approx(altitude, abs=feet)
    assert value(found, "velocity_north") == pytest.approx(north, abs=speed)
    assert value(found, "velocity_east") == pytest.approx(east, abs=speed)
    assert value(found, "climb_rate") == pytest.approx(up, abs=climb)
    said = found[-1].info
    assert said.callsign == "N123AB"
    if fmt != "sbs":
        assert (said.category, said.nacp) == ("A2", 9)
    if fmt in ("beast", "uat"):
        assert (said.nacv, said.sil, said.sda, said.nic) == (2, 3, 2, 8)


@pytest.mark.parametrize("fmt", FORMATS)
def test_what_a_report_lacks_is_not_made_up(fmt):
    found = back(fmt, AdsbReport(T, "abc123", 0.5, 0.1))
    for name in ("pressure_altitude", "velocity_north", "climb_rate"):
        assert math.isnan(value(found, name))
    assert math.isnan(value(back(fmt, AdsbReport(T, "abc123", velocity_north=10.0, velocity_east=0.0)), "latitude"))


@pytest.mark.parametrize("fmt", FORMATS)
def test_a_second_user_of_an_address_has_that_address(fmt):
    assert back(fmt, AdsbReport(T, "abc123#2", 0.5, 0.1, 100.0))[0].address == "abc123"


def test_every_nic_of_a_squitter_comes_back():
    for nic in range(1, 12):
        report = AdsbReport(T, "abc123", 0.5, 0.1, 100.0, info=SourceInfo(nic=nic))
        assert back("beast", report)[-1].info.nic == nic


def test_what_no_squitter_holds():
    assert squitters.encode(AdsbReport(T, "abc123", 0.5, 0.1, on_ground=True)) == []
    assert back("beast", AdsbReport(T, "abc123", 0.5, 0.1, 20_000.0)) == []
    fast = back("beast", AdsbReport(T, "abc123", 0.5, 0.1, velocity_north=1200.0, velocity_east=-3.0))
    assert value(fast, "velocity_north") == pytest.approx(1200.0, abs=4 * KNOT)
    geometric = back("beast", AdsbReport(T, "abc123", 0.5, 0.1, geometric_altitude=100.0))
    assert value(geometric, "geometric_altitude") == pytest.approx(100.0, abs=12.6 * FOOT)


def test_sbs_lines_have_22_fields():
    report = AdsbReport(T, "abc123", 0.5, 0.1, 100.0, math.nan, 1.0, 2.0, 3.0, info=SourceInfo(callsign="AB1"))
    lines = sbs_encoder.encode(report).decode().split("\r\n")[:-1]
    assert [line[:6] for line in lines] == ["MSG,1,", "MSG,3,", "MSG,4,"]
    assert {line.count(",") for line in lines} == {21}
    assert re.search(r",2023/11/14,22:13:20\.250,", lines[0])


@given(st.floats(-89.9, 89.9), st.floats(-180.0, 180.0), st.booleans())
def test_cpr_goes_round(latitude, longitude, odd):
    lat, lon = cpr.encode(latitude, longitude, odd=odd)
    found = cpr.decode_local(lat, lon, odd=odd, latitude=latitude, longitude=longitude)
    assert found is not None
    assert found[0] == pytest.approx(latitude, abs=3e-5)
    zones = max(cpr.longitude_zones(found[0]) - odd, 1)
    assert math.remainder(found[1] - longitude, 360.0) == pytest.approx(0.0, abs=360.0 / zones / 131072 + 1e-9)


def test_categories_have_numbers():
    for number in range(40):
        category = quality.emitter_category_of_number(number)
        assert quality.emitter_number(category) == (number if category else 0)
    assert quality.emitter_category_of_number(14) == "B6"


def test_accuracies_have_categories():
    for category in range(12):
        assert nacp_of_sigma(position_sigma(category)) == category
    for category in range(5):
        assert nacv_of_sigma(velocity_sigma(category)) == category
    assert nacp_of_sigma(1e9) == nacv_of_sigma(np.inf) == 0
    assert nacp_of_sigma(0.0) == 11
