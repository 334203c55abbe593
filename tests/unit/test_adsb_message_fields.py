import math
import random

import pytest
import rs1090

from tests.adsb_frames import field, ground_velocity, parity, reply, squitter
from wideberth.sensors.adsb import message_fields as fields
from wideberth.sensors.adsb import quality
from wideberth.sensors.adsb.parity import syndromes
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT


def test_parity_agrees_with_long_division():
    generator = random.Random(3)
    frames = [generator.randbytes(generator.choice((7, 14))) for _ in range(300)]
    for frame, found in zip(frames, syndromes(frames), strict=True):
        data = int.from_bytes(frame[:-3], "big")
        assert found == parity(data, 8 * len(frame) - 24) ^ int.from_bytes(frame[-3:], "big")


def test_parity_carries_the_address():
    assert syndromes([reply(0xABCDEF, 4, 0), reply(0x123456, 20, 0, 77), squitter(0x4840D6, 5)]) == [
        0xABCDEF,
        0x123456,
        0,
    ]
    assert syndromes([]) == []
    with pytest.raises(ValueError, match="7 or 14 bytes"):
        syndromes([b"12345678"])


@pytest.mark.parametrize(("code", "digits"), [(0, "0000"), (0b0101010101010, "7700"), (0x1FBF, "7777")])
def test_squawk(code, digits):
    assert fields.squawk(code) == digits


def test_squawk_agrees_with_the_library():
    for code in range(0, 0x2000, 37):
        frame = reply(0x393322, 5, code & 0x1FBF)
        assert rs1090.decode(frame.hex())["squawk"] == fields.squawk(code & 0x1FBF)


@pytest.mark.parametrize("state", range(8))
def test_emergency_state(state):
    me = field((1, 5, 28), (6, 3, 1), (9, 3, state))
    said = fields.emergency_state(me)
    expected = rs1090.decode(squitter(0x393322, me).hex())["emergency_state"].replace("_", " ")
    assert said.split()[0] == expected.split()[0]


def test_velocity():
    said = fields.velocity(ground_velocity(-120, 250, -1024, nacv=3, difference_ft=-225))
    assert said.north == pytest.approx(-120 * KNOT)
    assert said.east == pytest.approx(250 * KNOT)
    assert said.climb_rate == pytest.approx(-1024 * FOOT_PER_MINUTE)
    assert said.difference == pytest.approx(-225 * FOOT)
    assert (said.nacv, said.ground) == (3, True)


def test_velocity_supersonic_counts_by_four():
    said = fields.velocity(ground_velocity(800, -1200, step=4))
    assert (said.north, said.east) == pytest.approx((800 * KNOT, -1200 * KNOT))


def test_velocity_without_information():
    one_missing = ground_velocity(100, 100) & ~field((26, 10, 1023))
    assert math.isnan(fields.velocity(one_missing).north)
    assert math.isnan(fields.velocity(one_missing).east)
    said = fields.velocity(ground_velocity(1, 1, climb_fpm=None))
    assert math.isnan(said.climb_rate)
    assert math.isnan(said.difference)
    airspeed = fields.velocity(field((1, 5, 19), (6, 3, 3), (14, 1, 1), (15, 10, 512), (26, 10, 101)))
    assert math.isnan(airspeed.north)
    assert not airspeed.ground


def test_velocity_agrees_with_the_library():
    for north, east, climb in [(0, 5, 64), (321, -123, -6400), (-7, -440, 640)]:
        me = ground_velocity(north, east, climb, difference_ft=325)
        said, library = fields.velocity(me), rs1090.decode(squitter(0x393322, me).hex())
        assert math.hypot(said.north, said.east) == pytest.approx(library["groundspeed"] * KNOT)
        assert math.degrees(math.atan2(said.east, said.north)) % 360 == pytest.approx(library["track"])
        assert said.climb_rate == pytest.approx(library["vertical_rate"] * FOOT_PER_MINUTE)
        assert said.difference == pytest.approx(library["geo_minus_baro"] * FOOT)


def test_operational_status_version_2_airborne():
    me = field(
        (1, 5, 31),
        (11, 1, 1),
        (12, 1, 1),
        (27, 1, 1),
        (28, 1, 1),
        (31, 2, 2),
        (41, 3, 2),
        (44, 1, 1),
        (45, 4, 9),
        (51, 2, 3),
    )
    said = fields.operational_status(me)
    assert said == fields.OperationalStatus(2, 1, 9, 3, 2, None, True, True, True, True, None)
    library = rs1090.decode(squitter(0x393322, me).hex())
    assert (library["NICa"], library["NACp"], library["SIL"], library["version"]) == (1, 9, 3, 2)


def test_operational_status_version_2_surface():
    me = field(
        (1, 5, 31), (6, 3, 1), (16, 1, 1), (17, 3, 2), (21, 4, 7), (31, 2, 1), (41, 3, 2), (45, 4, 10), (51, 2, 2)
    )
    said = fields.operational_status(me)
    assert (said.size_code, said.nacv, said.sda, said.adsb_in, said.tcas_equipped) == (7, 2, 1, True, None)


def test_operational_status_version_1_says_no_tcas_with_a_one():
    me = field((1, 5, 31), (41, 3, 1), (45, 4, 8), (51, 2, 2))
    assert fields.operational_status(me).tcas_equipped is True
    assert fields.operational_status(me | field((11, 1, 1))).tcas_equipped is False
    assert fields.operational_status(me).sda is None


@pytest.mark.parametrize("version", [0, 3, 7])
def test_operational_status_of_other_versions_says_only_that(version):
    assert fields.operational_status(field((1, 5, 31), (41, 3, version), (45, 4, 9))) == fields.OperationalStatus(
        version
    )


def test_advisory():
    assert fields.advisory_active(field((9, 14, 1 << 13)), 9)
    assert not fields.advisory_active(field((9, 14, 1 << 13), (27, 1, 1)), 9)  # terminated
    assert fields.advisory_active(field((28, 1, 1)), 9)  # several threats
    assert not fields.advisory_active(0, 9)


@pytest.mark.parametrize(
    ("version", "type_code", "a", "b", "nic"),
    [
        (2, 9, 0, 0, 11), (2, 10, 1, 1, 10), (2, 11, 1, 1, 9), (2, 11, 0, 0, 8), (2, 11, 1, 0, 8), (2, 12, 0, 0, 7),
        (2, 13, 0, 1, 6), (2, 14, 0, 0, 5), (2, 15, 0, 0, 4), (2, 16, 1, 1, 3), (2, 16, 0, 0, 2), (2, 17, 0, 0, 1),
        (2, 18, 0, 0, 0), (2, 20, 0, 0, 11), (2, 21, 0, 0, 10), (2, 22, 0, 0, 0), (1, 11, 1, 0, 9), (1, 16, 1, 0, 3),
        (0, 9, 0, 0, 11), (0, 11, 1, 1, 8), (0, 12, 0, 0, 7), (0, 13, 0, 0, 6), (0, 16, 0, 0, 1), (0, 18, 0, 0, 0),
        (0, 20, 0, 0, 11), (0, 22, 0, 0, 0),
    ],
)  # fmt: skip
def test_nic(version, type_code, a, b, nic):
    assert quality.nic(version, type_code, a, b) == nic


def test_nucp_agrees_with_the_library():
    for type_code in (9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 20, 21, 22):
        me = field((1, 5, type_code), (9, 12, 0b000010010111))
        assert rs1090.decode(squitter(0x393322, me).hex())["NUCp"] == quality.nucp(type_code)
    assert [quality.nacp_of_version_0(c) for c in (9, 10, 11, 12, 13, 14, 15, 16, 17, 18)] == [
        11,
        10,
        8,
        7,
        6,
        5,
        4,
        1,
        1,
        0,
    ]


def test_sizes_and_categories():
    assert quality.length_and_width(0) is None
    assert quality.length_and_width(1) == (15.0, 23.0)
    assert quality.length_and_width(15) == (85.0, 90.0)
    assert quality.emitter_category(4, 3) == "A3"
    assert quality.emitter_category(3, 6) == "B6"
    assert quality.emitter_category(1, 1) == "D1"
    assert quality.emitter_category(4, 0) is None
