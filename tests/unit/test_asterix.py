import importlib
import math

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.errors import InputError
from wideberth.links.config import AsterixConfig, RadarUnitConfig
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import SourceInfo

pytest.importorskip("asterix", reason="libasterix is not installed: pip install 'wideberth[links]'")

from wideberth.links.asterix import blocks
from wideberth.links.asterix.encode import AsterixEncoder
from wideberth.links.asterix.reader import AsterixReader

MIDNIGHT = 86400.0 * 19_675
ENCODER = AsterixEncoder(1, 2)
PLOTS = np.array([[1000.0, 0.3, 0.05, -12.3], [2000.0, -1.0, np.nan, np.nan]])
REPORT = AdsbReport(
    MIDNIGHT + 100.0,
    "abc123",
    0.7,
    -1.3,
    1000.0,
    1020.0,
    30.0,
    -40.0,
    2.5,
    info=SourceInfo(callsign="N123AB", category="A1", nic=8, nacp=9, nacv=2, sil=3, sda=2),
)


def reader(scan="packet", clock=None, **unit) -> AsterixReader:
    return AsterixReader(AsterixConfig(scan=scan, units=(RadarUnitConfig(**unit),), clock=clock or {}))


def test_plots_become_a_scan():
    radar = reader(boresight_azimuth_deg=30.0, altitude_m=10.0, range_sigma_m=5.0, north_m=7.0)
    block = ENCODER.plots(MIDNIGHT + 0.25, PLOTS, math.radians(30.0), 10.0)
    (scan,) = radar.feed(block, MIDNIGHT + 0.3)
    assert (scan.kind, scan.t) == ("radar", MIDNIGHT + 0.25)
    np.testing.assert_allclose(scan.z[:, 0], [1000.0, 2000.0], atol=3.7)
    np.testing.assert_allclose(scan.z[:, 1], PLOTS[:, 1], atol=1e-4)
    # Heights have steps of 25 ft.
    assert scan.z[0, 2] == pytest.approx(0.05, abs=3.9 / 1000.0)
    assert math.isnan(scan.z[1, 2])
    assert scan.z[0, 3] == -12.0
    assert math.isnan(scan.z[1, 3])
    assert math.sqrt(scan.R[0, 0, 0]) == pytest.approx(math.hypot(5.0, 1852 / 256 / math.sqrt(12)))
    assert scan.sensor_position[0] == 7.0
    forward = scan.sensor_attitude @ [1.0, 0.0, 0.0]
    assert math.degrees(math.atan2(forward[1], forward[0])) == pytest.approx(30.0)


def test_a_north_mark_without_plots_is_an_empty_scan():
    (scan,) = reader().feed(ENCODER.plots(MIDNIGHT, PLOTS[:0]), MIDNIGHT + 0.1)
    assert scan.z.shape == (0, 4)


def test_time_of_day_rolls_over_at_midnight():
    radar = reader()
    (before,) = radar.feed(ENCODER.plots(MIDNIGHT - 0.125, PLOTS), MIDNIGHT + 0.5)
    (after,) = radar.feed(ENCODER.plots(MIDNIGHT + 0.75, PLOTS), MIDNIGHT + 0.8)
    assert (before.t, after.t) == (MIDNIGHT - 0.125, MIDNIGHT + 0.75)
    assert radar.rejects == {}
    assert blocks.unix_time(86399.9, MIDNIGHT + 0.1) == pytest.approx(MIDNIGHT - 0.1)
    assert blocks.unix_time(0.1, MIDNIGHT - 0.1) == pytest.approx(MIDNIGHT + 0.1)
    assert blocks.time_of_day(MIDNIGHT - 1e-9) == 0.0
    assert math.isnan(blocks.unix_time(math.nan, 5.0))


def test_times_that_jump_are_refused_and_counted():
    radar = reader()
    assert radar.feed(ENCODER.plots(MIDNIGHT + 3.0, PLOTS), MIDNIGHT) == []
    assert radar.feed(ENCODER.plots(MIDNIGHT - 3600.0, PLOTS), MIDNIGHT) == []
    assert radar.rejects["time ahead of its receipt"] == 2
    assert radar.rejects["time too long before its receipt"] == 2
    assert len(radar.feed(ENCODER.plots(MIDNIGHT, PLOTS), MIDNIGHT)) == 1
    assert radar.feed(ENCODER.plots(MIDNIGHT, PLOTS), MIDNIGHT) == []
    assert radar.feed(ENCODER.plots(MIDNIGHT, PLOTS), math.nan) == []


def test_a_turning_antenna_s_scan_ends_at_the_north_mark():
    radar = reader(scan="rotation", update_interval_s=4.0, clock={"age_max_s": 10.0})
    t = MIDNIGHT + 10.0
    for k in range(3):
        assert radar.feed(ENCODER.plots(t + k, PLOTS[:1]), t + k) == []
    (scan,) = radar.feed(ENCODER.north_mark(t + 3.0), t + 3.0)
    assert len(scan.z) == 3
    assert scan.t_valid.tolist() == [t, t + 1.0, t + 2.0]
    (scan,) = radar.feed(ENCODER.north_mark(t + 6.0), t + 6.0)
    assert len(scan.z) == 0
    # Without marks a turn's time ends it, also when nothing comes.
    assert radar.feed(ENCODER.plots(t + 7.0, PLOTS[:1]), t + 7.0) == []
    assert radar.feed(b"", t + 10.5) == []
    assert len(radar.feed(b"", t + 11.0)[0].z) == 1


def test_several_blocks_and_radars_in_a_datagram():
    units = tuple(RadarUnitConfig(name=f"r{sic}", radar_id=256 + sic) for sic in (2, 3))
    radar = AsterixReader(AsterixConfig(units=units))
    other = AsterixEncoder(1, 3)
    data = ENCODER.plots(MIDNIGHT, PLOTS) + other.plots(MIDNIGHT, PLOTS[:1]) + AsterixEncoder(9, 9).north_mark(MIDNIGHT)
    scans = radar.feed(data + ENCODER.adsb([REPORT]), MIDNIGHT + 0.01)
    assert [(scan.sensor, len(scan.z)) for scan in scans] == [("r2", 2), ("r3", 1)]
    assert radar.counters["another radar's"] == 1
    assert radar.counters["time ahead of its receipt"] == 1


def test_plots_that_are_none_are_left_out():
    spec = blocks.Specifications()
    base = {"010": (("SAC", 0), ("SIC", 0)), "140": 0, "040": (("RHO", 100), ("THETA", 0))}
    rows = [
        base | {"020": ((1, 1, 0, 0, 0, None),)},
        base | {"020": ((1, 0, 0, 0, 1, None),)},
        base | {"020": ((0, 0, 0, 0, 0, None),)},
        base | {"040": None},
        base | {"040": (("RHO", 0), ("THETA", 0))},
        base | {"110": (0, 8000)},
        base | {"120": {"CAL": (1, 0, 5)}},
    ]
    radar = reader()
    (scan,) = radar.feed(spec.block(48, rows), MIDNIGHT)
    assert len(scan.z) == 1
    assert math.isnan(scan.z[0, 3])
    assert radar.rejects == {
        "test target": 2,
        "no detection": 1,
        "plot without range or angle": 1,
        "range not positive": 1,
        "height does not fit its range": 1,
    }


def test_adsb_reports_and_system_tracks_go_round():
    radar = reader()
    assert radar.feed(ENCODER.adsb([REPORT]), REPORT.t + 0.05) == []
    assert radar.feed(ENCODER.tracks([REPORT]), REPORT.t + 0.05) == []
    adsb, track = radar.reports()
    assert radar.reports() == []
    for found in (adsb, track):
        assert (found.t, found.address) == (REPORT.t, REPORT.address)
        np.testing.assert_allclose(
            [found.latitude, found.longitude], [REPORT.latitude, REPORT.longitude], rtol=0, atol=5e-8
        )
        assert found.pressure_altitude == pytest.approx(1000.0, abs=3.9)
        assert found.geometric_altitude == pytest.approx(1020.0, abs=1.0)
        np.testing.assert_allclose([found.velocity_north, found.velocity_east], [30.0, -40.0], atol=0.13)
        assert found.climb_rate == pytest.approx(2.5, abs=0.02)
        assert (found.info.callsign, found.info.nacp, found.info.nacv) == ("N123AB", 9, 2)
    assert (adsb.info.nic, adsb.info.sil, adsb.info.sda, adsb.info.category) == (8, 3, 2, "A1")
    assert radar.addresses == ("abc123",)


@pytest.mark.parametrize("nacp", range(1, 12))
def test_a_track_s_accuracy_comes_back_as_its_category(nacp):
    for nacv in range(5):
        radar = reader()
        report = AdsbReport(1.0, "~000007", 0.8, 0.1, info=SourceInfo(nacp=nacp, nacv=nacv))
        radar.feed(ENCODER.tracks([report]), 1.0)
        (found,) = radar.reports()
        assert found.address == "~020007"
        # Steps of 0.6 m and 0.25 m/s round small standard deviations down.
        assert found.info.nacp == (nacp if nacp < 11 else 11)
        assert found.info.nacv in (nacv, nacv + 1)


def test_tracks_and_reports_that_are_left_out():
    spec = blocks.Specifications()
    track = {"010": (("SAC", 0), ("SIC", 1)), "070": 0, "040": 5, "105": (1 << 20, 1 << 20)}
    rows = [
        track | {"080": ((0, 0, 0, 0, 1, None),)},
        track | {"080": ((0, 0, 0, 0, 0, None), (1, 0, 0, 0, 0, 0, 0, None))},
        track | {"080": ((0, 0, 0, 0, 0, None), (0, 1, 0, 0, 0, 0, 0, None))},
        track | {"040": None},
        track | {"105": None},
        track | {"070": 128 * 50_000},
    ]
    radar = reader()
    radar.feed(spec.block(62, rows), MIDNIGHT)
    adsb = {"010": (("SAC", 0), ("SIC", 1)), "073": 0, "080": 7, "131": (1 << 24, 1 << 24)}
    rows = [
        adsb | {"080": None},
        adsb | {"040": ((0, 0, 0, 1, None),)},
        adsb | {"040": ((0, 0, 0, 0, None), (0, 1, 0, 0, 0, 0, None))},
        adsb | {"040": ((2, 0, 0, 0, None),)},
        adsb | {"040": ((0, 0, 0, 0, None), (0, 0, 0, 0, 0, 1, None))},
    ]
    radar.feed(spec.block(21, rows), MIDNIGHT)
    assert radar.reports() == []
    assert radar.rejects == {
        "tentative track": 1,
        "test target": 2,
        "track ended": 1,
        "record without address": 2,
        "track without latitude and longitude": 1,
        "time too long before its receipt": 1,
        "surface": 2,
        "report suspect": 1,
    }


def test_without_radars_health_is_that_of_the_reports():
    source = AsterixReader(AsterixConfig(units=()))
    assert source.health(0.0).state == "nothing heard yet"
    assert source.feed(ENCODER.adsb([REPORT]), REPORT.t) == []
    health = source.health(REPORT.t + 1.0)
    assert (health.state, health.age, health.rate) == ("ok", 1.0, 0.1)
    assert source.health(REPORT.t + 12.0).state == "silent for 12 s"
    assert source.feed(ENCODER.plots(MIDNIGHT, PLOTS), MIDNIGHT) == []
    assert source.rejects == {"another radar's": 2}


def test_reports_nobody_takes_do_not_pile_up():
    radar = reader()
    block = ENCODER.adsb([AdsbReport(1.0, f"{k:06x}", 0.5, 0.1) for k in range(1, 101)])
    for _ in range(3):
        radar.feed(block, 1.0)
    assert len(radar.reports()) == 100  # the second and third time the positions are stale


@pytest.mark.parametrize(
    ("data", "cause"),
    [
        (b"\x30", "block cut or damaged"),
        (b"\x30\x00\x02", "block cut or damaged"),
        (b"\x30\xff\xff\x00", "block cut or damaged"),
        (b"\x01\x00\x04\x00", "category not used"),
        (b"\x30\x00\x04\xff", "record cut or damaged"),
        (ENCODER.plots(MIDNIGHT, PLOTS)[:-1], "block cut or damaged"),
    ],
)
def test_damage_is_counted(data, cause):
    radar = reader()
    assert radar.feed(data, MIDNIGHT) == []
    assert radar.rejects == {cause: 1}


def test_a_datagram_full_of_empty_records_is_cut_short():
    radar = reader()
    radar.feed(b"\x30\xff\xe3" + bytes(0xFFE0), MIDNIGHT)
    assert radar.rejects == {"plot without range or angle": 1000, "records beyond the most in a datagram": 1}


def test_what_does_not_fit_is_not_sent():
    with pytest.raises(ValueError, match="does not fit into a plot"):
        ENCODER.plots(0.0, np.array([[5e5, 0.0, 0.0, 0.0]]))
    with pytest.raises(ValueError, match="do not fit into a datagram"):
        ENCODER.plots(0.0, np.tile(PLOTS, (2500, 1)))


def test_radars_must_be_level_and_on_the_ground():
    for unit in ({"mount": "ownship"}, {"boresight_elevation_deg": 5.0}, {"boresight_roll_deg": 5.0}):
        with pytest.raises(ValidationError, match="level"):
            AsterixConfig(units=[unit])


def test_without_the_library_it_says_what_to_install(monkeypatch):
    real = importlib.import_module

    def missing(name, *rest):
        if name.startswith("asterix"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(InputError, match=r"pip install 'wideberth\[links\]'"):
        AsterixReader(AsterixConfig())


def test_random_bytes_never_raise():
    random = np.random.default_rng(5)
    radar = reader()
    blocks_of = [ENCODER.plots(MIDNIGHT, PLOTS), ENCODER.adsb([REPORT]), ENCODER.tracks([REPORT])]
    for k in range(600):
        radar.feed(random.bytes(1700), float(k))
        # A sound head, so that it is records that are random.
        body = random.bytes(int(random.integers(1, 60)))
        head = bytes([(21, 34, 48, 62)[k % 4], 0, len(body) + 3])
        radar.feed(head + body, float(k))
        damaged = bytearray(blocks_of[k % 3])
        damaged[int(random.integers(3, len(damaged)))] ^= int(random.integers(1, 256))
        radar.feed(bytes(damaged), MIDNIGHT)
    assert sum(radar.rejects.values()) >= 1000
    for report in radar.reports():
        assert not any(math.isinf(v) for v in (report.latitude, report.velocity_north, report.climb_rate))
