import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wideberth.links.config import RadarUdpConfig, ThesisPacketConfig
from wideberth.links.radar_udp import RadarUdpReader, decode_thesis, encode_radar, encode_thesis

THESIS = RadarUdpConfig(packet="thesis")


def floats(low, high):
    return st.floats(low, high, width=32)


PLOTS = st.lists(
    st.tuples(floats(0.5, 50_000.0), floats(-3.125, 3.125), floats(-1.5, 1.5), floats(-200.0, 200.0)), max_size=20
).map(lambda rows: np.array(rows, float).reshape(-1, 4))


@given(PLOTS, st.integers(0, 65535), st.integers(0, 2**32 - 1), st.integers(0, 4 * 10**15))
def test_our_packet_goes_round(z, radar_id, sequence, microseconds):
    t = microseconds * 1e-6
    (scan,) = RadarUdpReader(RadarUdpConfig()).feed(encode_radar(radar_id, sequence, t, z), t + 1e-3)
    np.testing.assert_allclose(scan.z, z, rtol=1e-12, atol=1e-12)
    assert abs(scan.t - t) <= 1e-6


@given(
    PLOTS,
    st.builds(
        ThesisPacketConfig,
        byte_order=st.sampled_from(["little", "big"]),
        count_word=st.sampled_from(["float", "integer"]),
        angle_unit=st.sampled_from(["rad", "deg"]),
        angle_sign=st.sampled_from([1, -1]),
        range_unit_m=st.floats(0.01, 100.0),
        range_offset_m=st.floats(-10.0, 10.0),
        angle_offset_deg=st.floats(-90.0, 90.0),
    ),
)
def test_the_thesis_packet_goes_round(z, config):
    pairs = decode_thesis(encode_thesis(z, config), config)
    assert not isinstance(pairs, str)
    np.testing.assert_allclose(pairs, z[:, :2], rtol=1e-5, atol=1e-4)


@given(st.binary(max_size=200), st.floats(allow_nan=True), st.booleans())
def test_any_bytes_are_taken_or_counted(data, t, printed):
    reader = RadarUdpReader(THESIS if printed else RadarUdpConfig())
    scans = reader.feed(data, t)
    assert len(scans) == 1 or sum(reader.rejects.values()) == 1


@given(PLOTS.filter(len), st.data())
def test_a_damaged_packet_is_refused(z, data):
    packet = bytearray(encode_radar(0, 0, 1.0, z))
    at = data.draw(st.integers(0, len(packet) - 1))
    packet[at] ^= data.draw(st.integers(1, 255))
    reader = RadarUdpReader(RadarUdpConfig())
    assert reader.feed(bytes(packet[: data.draw(st.integers(0, len(packet)))]), 1.0) == []
    assert sum(reader.rejects.values()) == 1


@given(arrays(np.float32, st.tuples(st.integers(0, 8), st.just(9)), elements=st.floats(width=32)), st.booleans())
def test_any_numbers_in_a_sound_packet_give_a_sound_scan(values, cone):
    packet = encode_radar(0, 0, 1.0, values[:, :4], values[:, 5:], values[:, 4], cone=cone)
    reader = RadarUdpReader(RadarUdpConfig())
    (scan,) = reader.feed(packet, 1.0)
    assert len(scan.z) + sum(reader.rejects.values()) == len(values)
    assert (np.isfinite(scan.z[:, :2])).all()
    assert (scan.z[:, 0] > 0.0).all()
    assert (np.abs(scan.z[:, 1]) <= np.pi).all()
    assert not (np.abs(scan.z[:, 2]) > np.pi / 2).any()
    variance = np.diagonal(scan.R, axis1=1, axis2=2)
    np.testing.assert_array_equal(np.isnan(variance), np.isnan(scan.z))
    assert not (variance <= 0.0).any()


def test_a_million_random_bytes_in_datagrams():
    random = np.random.default_rng(3)
    for config in (RadarUdpConfig(), THESIS):
        reader = RadarUdpReader(config)
        sizes = random.integers(0, 1500, 1400)
        given_scans = sum(len(reader.feed(random.bytes(int(n)), float(k))) for k, n in enumerate(sizes))
        assert given_scans + sum(reader.rejects.values()) == reader.counters["datagrams"] == 1400
        assert sizes.sum() > 1e6
