import math
import struct
import zlib

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.frames import LocalFrame
from wideberth.links.config import RadarUdpConfig, RadarUnitConfig, ThesisPacketConfig
from wideberth.links.radar_udp import HEADER, MAX_PLOTS, RadarUdpReader, encode_radar, encode_thesis
from wideberth.types import Ownship

PLOTS = np.array([[120.0, 0.3, -0.1, -12.5], [80.0, -0.7, np.nan, np.nan]])


def unit(**settings) -> RadarUnitConfig:
    return RadarUnitConfig(**settings)


def reader(**settings) -> RadarUdpReader:
    return RadarUdpReader(RadarUdpConfig(units=(unit(**settings),)))


def thesis(**settings) -> RadarUdpReader:
    return RadarUdpReader(RadarUdpConfig(packet="thesis", thesis=ThesisPacketConfig(**settings)))


def resealed(packet: bytes) -> bytes:
    return packet[:-4] + struct.pack(">I", zlib.crc32(packet[:-4]))


def changed(packet: bytes, at: int, *new: int) -> bytes:
    return resealed(packet[:at] + bytes(new) + packet[at + len(new) :])


def test_plots_become_a_scan_with_the_radar_s_pose_and_noise():
    settings = {
        "name": "mast",
        "north_m": 10.0,
        "east_m": -5.0,
        "altitude_m": 1.83,
        "boresight_azimuth_deg": 73.8,
        "boresight_elevation_deg": 3.0,
        "azimuth_fov_deg": 120.0,
        "elevation_fov_deg": 30.0,
        "range_sigma_m": 0.5,
        "azimuth_sigma_deg": 2.0,
        "detection_ranges_m": (0.0, 300.0),
        "detection_probabilities": (0.9, 0.5),
    }
    radar = reader(**settings)
    sigma = np.full((2, 4), np.nan)
    sigma[0] = 0.7, 0.01, 0.02, 0.3
    (scan,) = radar.feed(encode_radar(7, 0, 1000.0, PLOTS, sigma, np.array([14.0, np.nan])), 1000.05)
    assert (scan.sensor, scan.kind, scan.t, scan.t_received) == ("mast", "radar", 1000.0, 1000.05)
    np.testing.assert_allclose(scan.z, PLOTS, rtol=1e-6)
    np.testing.assert_allclose(np.sqrt(scan.R[0].diagonal()), [0.7, 0.01, 0.02, 0.3], rtol=1e-6)
    np.testing.assert_allclose(np.sqrt(scan.R[1].diagonal()), [0.5, math.radians(2.0), np.nan, np.nan], rtol=1e-6)
    np.testing.assert_array_equal(scan.sensor_position, [10.0, -5.0, -1.83])
    forward = scan.sensor_attitude @ [1.0, 0.0, 0.0]
    assert math.degrees(math.atan2(forward[1], forward[0])) == pytest.approx(73.8)
    assert math.degrees(math.asin(-forward[2])) == pytest.approx(3.0)
    np.testing.assert_allclose(scan.field_of_view, np.radians([60.0, 15.0]))
    assert scan.detection is not None
    assert scan.detection.probabilities.tolist() == [0.9, 0.5]
    assert scan.health is not None
    assert scan.health.state == "ok"


def test_an_empty_scan_is_a_scan():
    (scan,) = reader().feed(encode_radar(0, 0, 5.0, np.zeros((0, 4))), 5.0)
    assert scan.z.shape == (0, 4)
    assert scan.R.shape == (0, 4, 4)
    (scan,) = thesis().feed(encode_thesis(np.zeros((0, 2))), 5.0)
    assert scan.z.shape == (0, 4)


def test_a_line_array_s_packet_gives_cones():
    (scan,) = reader().feed(encode_radar(0, 0, 5.0, PLOTS[1:], cone=True), 5.0)
    assert scan.kind == "radar_cone"


def test_sequence_numbers_lost_repeated_behind_and_started_anew():
    radar = reader()

    def feed(sequence, t):
        return len(radar.feed(encode_radar(0, sequence, t, PLOTS), t + 0.01))

    assert [feed(2**32 - 1, 1.0), feed(0, 1.1), feed(4, 1.5)] == [1, 1, 1]
    assert radar.counters["packets lost"] == 3
    assert feed(4, 1.5) == 0
    assert radar.rejects["sequence number repeated"] == 1
    assert feed(3, 1.4) == 0
    assert radar.rejects["behind a newer packet"] == 1
    assert feed(0, 2.0) == 1
    assert radar.counters["sequence numbers started anew"] == 1
    assert feed(1, 2.1) == 1
    assert radar.counters["packets lost"] == 3


def test_times_that_are_absurd_or_jump_are_refused_and_counted():
    radar = reader()
    now = 1_700_000_000.0
    for k, t in enumerate((0.0, now + 3.0, now - 3.0, -1e12, 8e12)):
        assert radar.feed(encode_radar(0, k, t, PLOTS), now) == []
    assert radar.rejects == {"time ahead of its receipt": 2, "time too long before its receipt": 3}
    assert radar.health(now).state == "all refused: time ahead of its receipt"
    assert len(radar.feed(encode_radar(0, 9, now, PLOTS), now)) == 1
    # Slightly ahead: the clocks differ by a little, and nothing is true before it is received.
    (scan,) = radar.feed(encode_radar(0, 10, now + 0.15, PLOTS), now + 0.1)
    assert scan.t == now + 0.1
    assert radar.feed(encode_radar(0, 11, now + 0.05, PLOTS), now + 0.2) == []
    assert radar.rejects["time not after the last scan's"] == 1
    for t in (math.nan, math.inf):
        assert radar.feed(encode_radar(0, 12, now, PLOTS), t) == []
    assert radar.counters["time of receipt not a number"] == 2


def test_times_of_receipt_are_taken_where_wanted():
    config = RadarUdpConfig(clock={"use": "receipt", "latency_s": 0.2})
    (scan,) = RadarUdpReader(config).feed(encode_radar(0, 0, 3.0, PLOTS), 1000.0)
    assert scan.t == 999.8


def test_a_radar_that_counts_time_from_its_start_is_told_from_late_packets():
    radar = RadarUdpReader(RadarUdpConfig(clock={"use": "receipt"}))

    def feed(sequence, own, t):
        return len(radar.feed(encode_radar(0, sequence, own, PLOTS), t))

    assert [feed(100, 50.0, 1000.0), feed(102, 50.2, 1000.2), feed(101, 50.1, 1000.25), feed(103, 50.3, 1000.3)] == [
        1,
        1,
        0,
        1,
    ]
    assert radar.rejects == {"behind a newer packet": 1}
    assert feed(0, 0.0, 1005.0) == 1
    assert radar.counters["sequence numbers started anew"] == 1
    assert radar.counters["packets lost"] == 1


@pytest.mark.parametrize(
    ("packet", "cause"),
    [
        (b"", "packet too short"),
        (b"WBRP", "packet too short"),
        (bytes(60), "not our packet"),
        (encode_radar(0, 0, 1.0, PLOTS)[:-1], "crc failed"),
        (changed(encode_radar(0, 0, 1.0, PLOTS), 0, 88), "not our packet"),
        (changed(encode_radar(0, 0, 1.0, PLOTS), 4, 2), "version not known"),
        (changed(encode_radar(0, 0, 1.0, PLOTS), HEADER.size - 3, 3), "count and length do not agree"),
        (changed(encode_radar(0, 0, 1.0, PLOTS), HEADER.size - 4, 255, 255), "count and length do not agree"),
        (changed(encode_radar(0, 0, 1.0, PLOTS), HEADER.size - 3, 1), "count and length do not agree"),
        (changed(encode_radar(0, 0, 1.0, PLOTS), HEADER.size - 1, 0), "count and length do not agree"),
        (encode_radar(9, 0, 1.0, PLOTS), "another radar's"),
    ],
)
def test_what_is_no_packet_is_refused_with_the_cause(packet, cause):
    radar = reader(radar_id=8)
    assert radar.feed(packet, 1.0) == []
    assert radar.rejects == {cause: 1}
    assert radar.counters == {"datagrams": 1, cause: 1}


def test_longer_plots_of_a_later_sender_are_read_up_to_what_is_known():
    packet = encode_radar(0, 0, 1.0, PLOTS)
    plots = [packet[HEADER.size + 36 * k : HEADER.size + 36 * (k + 1)] for k in range(2)]
    longer = packet[: HEADER.size - 2] + struct.pack(">H", 40) + plots[0] + b"abcd" + plots[1] + b"efgh" + bytes(4)
    (scan,) = reader().feed(resealed(longer), 1.0)
    np.testing.assert_allclose(scan.z, PLOTS, rtol=1e-6)


def test_plots_that_cannot_be_are_left_out_one_by_one():
    rows = [
        ([100.0, 0.1, 0.1, 0.0], 1.0, ""),
        ([np.nan, 0.1, 0.1, 0.0], 1.0, "plot without range or angle"),
        ([100.0, np.inf, 0.1, 0.0], 1.0, "plot without range or angle"),
        ([100.0, 0.1, -np.inf, 0.0], 1.0, "plot not finite"),
        ([0.0, 0.1, 0.1, 0.0], 1.0, "range not positive"),
        ([-5.0, 0.1, 0.1, 0.0], 1.0, "range not positive"),
        ([501.0, 0.1, 0.1, 0.0], 1.0, "plot beyond range_max_m"),
        ([100.0, 57.3, 0.1, 0.0], 1.0, "angle impossible"),
        ([100.0, 0.1, 2.5, 0.0], 1.0, "angle impossible"),
        ([100.0, 0.1, 0.1, 1e6], 1.0, "range rate impossible"),
        ([100.0, 0.1, 0.1, 0.0], 0.0, "standard deviation not positive"),
        ([100.0, 0.1, 0.1, 0.0], -1.0, "standard deviation not positive"),
        ([100.0, 0.1, 0.1, 0.0], np.inf, "plot not finite"),
        ([100.0, 0.1, 0.1, 0.0], np.nan, ""),
    ]
    radar = reader(range_max_m=500.0)
    z, sigma = np.array([row[0] for row in rows]), np.array([[row[1]] * 4 for row in rows])
    (scan,) = radar.feed(encode_radar(0, 0, 1.0, z, sigma), 1.0)
    assert len(scan.z) == 2
    wanted = [row[2] for row in rows if row[2]]
    assert radar.rejects == {cause: wanted.count(cause) for cause in wanted}


def test_angles_are_brought_into_their_ranges():
    z = np.array([[10.0, 1.5 * math.pi, 0.0, 0.0], [10.0, 0.0, 0.5 * math.pi + 0.1, 0.0], [10.0, -math.pi, 0.0, 0.0]])
    (scan,) = reader().feed(encode_radar(0, 0, 1.0, z), 1.0)
    np.testing.assert_allclose(scan.z[0, 1], -0.5 * math.pi, rtol=1e-6)
    # Past the zenith: the same direction with the azimuth turned round.
    np.testing.assert_allclose(np.abs(scan.z[1, 1:3]), [math.pi, 0.5 * math.pi - 0.1], rtol=1e-6)
    assert abs(scan.z[2, 1]) == pytest.approx(math.pi)
    cone = np.array([[10.0, 0.5 * math.pi, np.nan, np.nan], [10.0, 1.7, np.nan, np.nan]])
    radar = reader()
    (scan,) = radar.feed(encode_radar(0, 0, 1.0, cone, cone=True), 1.0)
    assert len(scan.z) == 1
    assert scan.z[0, 1] <= 0.5 * math.pi
    assert radar.rejects == {"angle impossible": 1}


def test_tiny_standard_deviations_do_not_make_a_singular_covariance():
    (scan,) = reader().feed(encode_radar(0, 0, 1.0, PLOTS[:1], np.full((1, 4), 1e-30)), 1.0)
    assert (scan.R[0].diagonal() >= 1e-10).all()


def test_of_too_many_plots_the_strongest_or_nearest_are_kept():
    z = np.full((5, 4), np.nan)
    z[:, 0], z[:, 1] = [50.0, 40.0, 30.0, 20.0, 10.0], 0.0
    radar = reader(max_plots=2)
    (scan,) = radar.feed(encode_radar(0, 0, 1.0, z, snr=np.array([5.0, 20.0, np.nan, 30.0, 1.0])), 1.0)
    assert scan.z[:, 0].tolist() == [40.0, 20.0]
    assert radar.rejects == {"plots beyond the most in a scan": 3}
    (scan,) = radar.feed(encode_radar(0, 1, 2.0, z), 2.0)
    assert scan.z[:, 0].tolist() == [20.0, 10.0]


def test_plots_outside_the_field_of_view_are_kept_and_counted():
    radar = reader(azimuth_fov_deg=60.0)
    (scan,) = radar.feed(encode_radar(0, 0, 1.0, np.array([[10.0, 2.0, 0.0, 0.0]])), 1.0)
    assert len(scan.z) == 1
    assert radar.counters["plots outside the field of view (kept)"] == 1


def test_radars_are_told_apart_by_their_numbers():
    units = tuple(unit(name=f"radar/{k}", radar_id=k, north_m=100.0 * k) for k in (1, 2))
    radars = RadarUdpReader(RadarUdpConfig(units=units))
    scans = [scan for k in (2, 1) for scan in radars.feed(encode_radar(k, 0, 1.0, PLOTS), 1.0)]
    assert [(scan.sensor, scan.sensor_position[0]) for scan in scans] == [("radar/2", 200.0), ("radar/1", 100.0)]
    assert radars.feed(encode_radar(3, 0, 1.0, PLOTS), 1.0) == []
    assert radars.counters["another radar's"] == 1
    # The one that fell silent decides how the input does.
    radars.feed(encode_radar(1, 1, 9.0, PLOTS), 9.0)
    assert radars.health(9.0).state == "silent for 8 s"


def test_a_radar_by_latitude_and_longitude_waits_for_the_frame_and_turns_with_the_meridian():
    config = RadarUdpConfig(units=(unit(latitude_deg=60.0, longitude_deg=10.5, altitude_m=20.0),))
    radar = RadarUdpReader(config)
    assert radar.feed(encode_radar(0, 0, 1.0, PLOTS), 1.0) == []
    assert radar.rejects == {"local frame not known": 1}
    radar.frame = LocalFrame(math.radians(60.0), math.radians(10.0))
    (scan,) = radar.feed(encode_radar(0, 1, 2.0, PLOTS), 2.0)
    assert scan.sensor_position[1] == pytest.approx(27_900.0, rel=0.01)
    assert scan.sensor_position[2] == -20.0
    turned = math.degrees(math.atan2(scan.sensor_attitude[1, 0], scan.sensor_attitude[0, 0]))
    assert turned == pytest.approx(-0.5 * math.sin(math.radians(60.0)), rel=0.01)


def test_a_radar_on_the_ownship_turns_with_it():
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    own = Ownship(0.9, np.array([0.0, 0.0, -50.0]), np.array([10.0, 0.0, 0.0]), turned)
    known: list[Ownship | None] = [None]
    config = RadarUdpConfig(units=(unit(mount="ownship", boresight_azimuth_deg=90.0),))
    radar = RadarUdpReader(config, ownship=lambda _: known[0])
    assert radar.feed(encode_radar(0, 0, 1.0, PLOTS), 1.0) == []
    assert radar.rejects == {"ownship's state not known": 1}
    known[0] = own
    (scan,) = radar.feed(encode_radar(0, 1, 1.1, PLOTS), 1.1)
    np.testing.assert_allclose(scan.sensor_position, [2.0, 0.0, -50.0])
    np.testing.assert_allclose(scan.sensor_attitude @ [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], atol=1e-12)


def test_health_says_how_old_how_often_and_silent():
    radar = reader(update_interval_s=0.1, silent_intervals=5.0)
    assert radar.health(0.0).state == "nothing heard yet"
    for k in range(20):
        radar.feed(encode_radar(0, k, 0.1 * k, PLOTS), 0.1 * k)
    health = radar.health(2.0)
    assert (health.state, health.rate) == ("ok", 2.0)
    assert health.age == pytest.approx(0.1)
    assert radar.health(5.0).state == "silent for 3 s"
    radar.feed(b"rubbish", 5.0)
    assert radar.health(5.0).state == "all refused: packet too short"
    assert radar.health(30.0).rate == 0.0


def test_the_thesis_packet():
    packet = struct.pack("<5f", 2.0, 120.0, 0.3, 80.0, -0.7)
    (scan,) = thesis().feed(packet, 1000.0)
    assert scan.kind == "radar_cone"
    np.testing.assert_allclose(scan.z[:, :2], [[120.0, 0.3], [80.0, -0.7]], rtol=1e-6)
    assert np.isnan(scan.z[:, 2:]).all()
    assert np.isnan(scan.R[:, 2, 2]).all()
    assert scan.t == 1000.0
    other = {"byte_order": "big", "count_word": "integer", "angle": "azimuth", "angle_unit": "deg", "angle_sign": -1}
    packet = struct.pack(">I4f", 2, 12.0, -10.0, 8.0, 20.0)
    config = ThesisPacketConfig(**other, range_unit_m=10.0, range_offset_m=1.0, angle_offset_deg=5.0)
    (scan,) = RadarUdpReader(RadarUdpConfig(packet="thesis", thesis=config)).feed(packet, 1.0)
    assert scan.kind == "radar"
    np.testing.assert_allclose(scan.z[:, 0], [121.0, 81.0])
    np.testing.assert_allclose(np.degrees(scan.z[:, 1]), [15.0, -15.0])
    assert encode_thesis(scan.z, config) == packet


@pytest.mark.parametrize(
    ("packet", "cause"),
    [
        (b"", "not a number of whole words"),
        (b"abcde", "not a number of whole words"),
        (struct.pack("<3f", 2.0, 1.0, 1.0), "count beyond the packet"),
        (struct.pack("<3f", 1e30, 1.0, 1.0), "count beyond the packet"),
        (struct.pack("<3f", -1.0, 1.0, 1.0), "count not a whole number"),
        (struct.pack("<3f", 0.5, 1.0, 1.0), "count not a whole number"),
        (struct.pack("<3f", math.nan, 1.0, 1.0), "count not a whole number"),
        (struct.pack("<3f", math.inf, 1.0, 1.0), "count not a whole number"),
        (struct.pack("<5f", 1.0, 1.0, 1.0, 2.0, 0.0), "words beyond the count"),
    ],
)
def test_thesis_packets_whose_count_lies_are_refused(packet, cause):
    radar = thesis()
    assert radar.feed(packet, 1.0) == []
    assert radar.rejects == {cause: 1}


def test_a_buffer_of_fixed_size_may_follow_the_count():
    assert len(thesis().feed(struct.pack("<5f", 1.0, 7.0, 0.1, 0.0, 0.0), 1.0)[0].z) == 1
    stale = struct.pack("<5f", 1.0, 7.0, 0.1, 9.0, 0.2)
    assert len(thesis(ignore_beyond_count=True).feed(stale, 1.0)[0].z) == 1


def test_packets_have_a_greatest_size():
    assert len(encode_radar(0, 0, 1.0, np.ones((MAX_PLOTS, 4)))) <= 65507
    with pytest.raises(ValueError, match="at most"):
        encode_radar(0, 0, 1.0, np.ones((MAX_PLOTS + 1, 4)))
    with pytest.raises(ValueError, match="at most"):
        encode_thesis(np.ones((9000, 2)))
    with pytest.raises(ValueError, match="does not fit"):
        encode_radar(70_000, 0, 1.0, PLOTS)
    with pytest.raises(ValueError, match="does not fit"):
        encode_radar(0, 0, math.nan, PLOTS)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"units": [{"name": "a"}, {"name": "a", "radar_id": 1}]}, "same name"),
        ({"units": [{"name": "a"}, {"name": "b", "radar_id": 1}]}, "radar_id each"),
        ({"units": [{"latitude_deg": 1.0}]}, "need each other"),
        ({"units": [{"latitude_deg": 1.0, "longitude_deg": 2.0, "mount": "ownship"}]}, "on the ground"),
        ({"units": [{"detection_ranges_m": [1.0]}]}, "equally many"),
        ({"units": [{"detection_ranges_m": [2.0, 1.0], "detection_probabilities": [1, 1]}]}, "must increase"),
        ({"packet": "thesis", "units": [{"name": "a", "radar_id": 0}, {"name": "b", "radar_id": 1}]}, "one of"),
        ({"units": []}, "at least 1"),
        ({"range_m": 1.0}, "Extra"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, message):
    with pytest.raises(ValidationError, match=message):
        RadarUdpConfig(**settings)
