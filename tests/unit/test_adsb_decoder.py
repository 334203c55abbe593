import math

import pytest

from tests import adsb_frames as encoder
from tests.adsb_frames import field, squitter
from wideberth.sensors.adsb.decoder import ModeSDecoder
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

ADDRESS = 0x393322


def decode(decoder, frames):
    return decoder.decode([frame for _, frame in frames], [t for t, _ in frames])


def located(reports):
    return [r for r in reports if not math.isnan(r.latitude)]


def test_a_flight():
    decoder = ModeSDecoder()
    reports = decode(decoder, encoder.flight(ADDRESS, north_kt=120, east_kt=-60, duration=30.0))
    assert decoder.kinds == {"airborne positions": 60, "velocities": 60}
    assert decoder.results == {"positions": 59, "positions unresolved": 1}  # the first has no other half
    assert not decoder.rejects
    for report in located(reports):
        dt = report.t - 1000.0
        assert math.degrees(report.latitude) == pytest.approx(48.0 + 120 * dt / 216000, abs=1e-4)
        assert math.degrees(report.longitude) == pytest.approx(
            2.0 - 60 * dt / 216000 / math.cos(math.radians(48)), abs=1e-4
        )
        assert report.pressure_altitude == pytest.approx(3000 * FOOT)
        assert math.isnan(report.velocity_north)
    velocities = [r for r in reports if not math.isnan(r.velocity_north)]
    assert len(velocities) == 60
    assert all(r.velocity_north == pytest.approx(120 * KNOT) for r in velocities)
    assert all(r.velocity_east == pytest.approx(-60 * KNOT) for r in velocities)
    assert all(math.isnan(r.pressure_altitude) and math.isnan(r.latitude) for r in velocities)
    assert {r.address for r in reports} == {"393322"}


def test_a_pair_too_far_apart_gives_no_position():
    decoder = ModeSDecoder()
    even = squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 3000, 0))
    odd = squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 3000, 1))
    assert not located(decode(decoder, [(0.0, even), (10.5, odd)]))
    assert located(decode(decoder, [(20.0, even)]))  # 9.5 s after the odd one


def test_after_a_long_silence_a_single_message_gives_no_position():
    decoder = ModeSDecoder()
    frames = encoder.flight(ADDRESS, duration=5.0)
    assert located(decode(decoder, frames))
    later = squitter(ADDRESS, encoder.airborne_position(48.1, 2.0, 3000, 0))
    assert located(decode(decoder, [(1060.0, later)]))
    assert not located(decode(decoder, [(1060.0 + 121.0, later)]))


def test_damaged_frames_are_counted_and_left_out():
    decoder = ModeSDecoder()
    frames = encoder.flight(ADDRESS, duration=5.0)
    damaged = [(t, bytes([*frame[:6], frame[6] ^ 4, *frame[7:]])) for t, frame in frames]
    assert decode(decoder, damaged) == []
    assert decoder.rejects == {"crc failed": len(frames)}


def test_surface_aircraft_are_left_out():
    decoder = ModeSDecoder()
    decode(decoder, encoder.flight(ADDRESS, duration=5.0))
    surface = squitter(ADDRESS, field((1, 5, 7), (6, 7, 20), (22, 1, 1), (23, 17, 1000), (40, 17, 2000)))
    moving = squitter(ADDRESS, encoder.ground_velocity(5, 5))
    assert decode(decoder, [(1006.0, surface), (1006.1, moving)]) == []
    assert decoder.rejects == {"surface": 2}
    airborne = [(1010.0 + k / 2, squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 500, k % 2))) for k in (0, 1)]
    assert located(decode(decoder, airborne))


def test_replies_count_only_for_aircraft_known_by_a_true_checksum():
    decoder = ModeSDecoder()
    reply = encoder.reply(ADDRESS, 5, 0b0101010101010)
    decode(decoder, [(0.0, reply)])
    assert decoder.rejects == {"address not known": 1}
    decode(decoder, [(1.0, encoder.all_call(ADDRESS)), (2.0, reply)])
    assert decoder.kinds == {"all-call replies": 1, "surveillance replies": 1}
    report = decode(decoder, encoder.flight(ADDRESS, duration=2.0))[-1]
    assert report.info.squawk == "7700"


def test_all_call_with_an_interrogator_code_makes_no_aircraft():
    decoder = ModeSDecoder()
    decode(decoder, [(0.0, encoder.all_call(ADDRESS, interrogator=13))])
    assert decoder.rejects == {"crc failed": 1}
    decode(decoder, [(0.0, encoder.all_call(ADDRESS)), (0.1, encoder.all_call(ADDRESS, interrogator=13))])
    assert decoder.kinds == {"all-call replies": 2}


def test_short_frames_in_the_space_of_long_ones():
    decoder = ModeSDecoder()
    decode(decoder, [(0.0, encoder.all_call(ADDRESS) + bytes(7)), (1.0, bytes(7) + b"1"), (2.0, squitter(1, 2)[:7])])
    assert decoder.kinds == {"all-call replies": 1}
    assert decoder.rejects == {"wrong length": 2}


def test_what_an_aircraft_says_of_itself():
    decoder = ModeSDecoder()
    frames = encoder.flight(ADDRESS, duration=3.0)
    status = field(
        (1, 5, 31), (11, 1, 1), (12, 1, 1), (31, 2, 2), (41, 3, 2), (44, 1, 1), (45, 4, 9), (51, 2, 3)
    )  # fmt: skip
    decode(
        decoder,
        [
            (999.0, squitter(ADDRESS, encoder.identification("AB123"))),
            (999.1, squitter(ADDRESS, status)),
            (999.2, squitter(ADDRESS, field((1, 5, 28), (6, 3, 1), (9, 3, 2), (12, 13, 0b0101010101010)))),
            *frames[:-2],
            (1003.0, squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 3000, 0, status=3, supplement_b=1))),
        ],
    )
    report = decode(decoder, frames[-1:])[0]
    info = report.info
    assert (info.callsign, info.category, info.squawk, info.emergency) == ("AB123", "A3", "7700", "medical")
    assert (info.nic, info.nacp, info.nacv, info.sil, info.sda) == (9, 9, 2, 3, 2)
    assert (info.tcas_equipped, info.tcas_advisory, info.adsb_in, info.ident) == (True, False, True, True)
    assert info.length is None


def test_version_0_quality_comes_from_the_type_code():
    decoder = ModeSDecoder()
    decode(decoder, [(0.0, squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 3000, 0, type_code=13)))])
    report = decode(decoder, [(0.5, squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 3000, 1, type_code=13)))])[0]
    assert (report.info.nic, report.info.nacp) == (6, 6)


def test_size_of_aircraft_on_the_ground():
    decoder = ModeSDecoder()
    status = field((1, 5, 31), (6, 3, 1), (21, 4, 7), (31, 2, 1), (41, 3, 2), (45, 4, 10), (51, 2, 2))
    decode(decoder, [(999.0, squitter(ADDRESS, status))])
    info = decode(decoder, encoder.flight(ADDRESS, duration=2.0))[-1].info
    assert (info.length, info.width, info.sda) == (45.0, 45.0, 1)


@pytest.mark.parametrize(
    "frame",
    [
        squitter(ADDRESS, field((1, 5, 28), (6, 3, 2), (9, 14, 1 << 13))),
        encoder.reply(ADDRESS, 16, 0, field((1, 8, 0x30), (9, 14, 1 << 13))),
        encoder.reply(ADDRESS, 20, 0, field((1, 8, 0x30), (9, 14, 1 << 13), (29, 2, 1), (31, 26, 0x123456 << 2))),
    ],
)
def test_resolution_advisory(frame):
    decoder = ModeSDecoder()
    flight = encoder.flight(ADDRESS, duration=2.0)
    assert decode(decoder, flight)[-1].info.tcas_advisory is None
    decode(decoder, [(1002.0, frame)])
    info = decode(decoder, [(1002.5, flight[-1][1])])[0].info
    assert (info.tcas_equipped, info.tcas_advisory) == (True, True)


def test_geometric_altitude():
    decoder = ModeSDecoder()
    decode(decoder, encoder.flight(ADDRESS, duration=2.0))
    velocity = squitter(ADDRESS, encoder.ground_velocity(10, 10, climb_fpm=640, difference_ft=-250))
    report = decode(decoder, [(1002.0, velocity)])[0]
    assert report.geometric_altitude == pytest.approx(2750 * FOOT)
    assert report.climb_rate == pytest.approx(640 * FOOT_PER_MINUTE)
    assert math.isnan(decode(decoder, [(1010.0, velocity)])[0].geometric_altitude)  # the altitude is too old
    by_satellite = squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 3100, 0, type_code=20))
    report = decode(decoder, [(1010.5, by_satellite)])[0]
    assert report.geometric_altitude == pytest.approx(3100 * FOOT)
    assert math.isnan(report.pressure_altitude)


def test_airspeed_is_no_ground_velocity():
    decoder = ModeSDecoder()
    airspeed = field((1, 5, 19), (6, 3, 3), (14, 1, 1), (15, 10, 512), (26, 10, 101), (38, 9, 11))
    report = decode(decoder, [(0.0, squitter(ADDRESS, airspeed))])[0]
    assert math.isnan(report.velocity_north)
    assert report.climb_rate == pytest.approx(640 * FOOT_PER_MINUTE)
    assert decoder.kinds == {"airspeeds": 1}


@pytest.mark.parametrize(("control", "address"), [(0, "393322"), (1, "~393322"), (6, "393322")])
def test_non_transponder_squitters(control, address):
    decoder = ModeSDecoder()
    frames = [
        (k / 2, squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 3000, k), df=18, control=control))
        for k in (0, 1)
    ]
    assert located(decode(decoder, frames))[0].address == address


def test_traffic_information_broadcasts_are_left_out():
    decoder = ModeSDecoder()
    frame = squitter(ADDRESS, encoder.airborne_position(48.0, 2.0, 3000, 0), df=18, control=2)
    assert decode(decoder, [(0.0, frame)]) == []
    assert decoder.rejects == {"TIS-B not used": 1}


def test_two_aircraft_with_one_address_are_told_apart():
    decoder = ModeSDecoder()
    north, south = (encoder.flight(ADDRESS, latitude=latitude, duration=20.0) for latitude in (48.0, 47.5))
    both = sorted(north + [(t + 0.2, frame) for t, frame in south])
    reports = located(decode(decoder, both))
    assert decoder.results["addresses used by two aircraft"] == 1
    assert {r.address for r in reports} == {"393322", "393322#2"}
    places = {name: [math.degrees(r.latitude) for r in reports if r.address == name] for name in ("393322", "393322#2")}
    for latitudes in places.values():
        assert max(latitudes) - min(latitudes) < 0.02
    assert abs(places["393322"][0] - places["393322#2"][0]) == pytest.approx(0.5, abs=0.02)
    assert sum(r.address == "393322#2" for r in reports) > 30
    assert decoder.rejects["velocity of an address used by two aircraft"] > 30
    assert sum(decoder.kinds.values()) + sum(decoder.rejects.values()) == decoder.messages == len(both)


def test_a_single_wild_position_is_refused():
    decoder = ModeSDecoder()
    frames = encoder.flight(ADDRESS, duration=10.0)
    wild = [(1004.91 + k / 100, squitter(ADDRESS, encoder.airborne_position(48.6, 2.0, 3000, k))) for k in (0, 1)]
    reports = located(decode(decoder, sorted(frames + wild)))
    assert decoder.results["position jumps"] == 2
    assert decoder.results["addresses used by two aircraft"] == 0
    assert all(abs(math.degrees(r.latitude) - 48.0) < 0.02 for r in reports)


def test_an_aircraft_that_was_misplaced_is_found_again():
    decoder = ModeSDecoder()
    decode(decoder, encoder.flight(ADDRESS, latitude=47.0, duration=1.0))
    reports = located(decode(decoder, encoder.flight(ADDRESS, latitude=48.0, t0=1002.0)))
    assert {r.address for r in reports} == {"393322"}
    assert len(reports) > 30
    assert decoder.results["addresses used by two aircraft"] == 0
