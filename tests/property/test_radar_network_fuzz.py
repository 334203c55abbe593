"""Whatever radars send, the registration stays sound: covariance positive, below the prior, and nothing raised."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.nearest_tracker import NearestTracker
from wideberth.tracking.bias_correction import prior_sigma
from wideberth.tracking.config import RadarNetworkConfig, RegistrationConfig
from wideberth.tracking.radar_network import RadarNetwork
from wideberth.tracking.registration import Registration
from wideberth.types import DetectionModel, Scan, Track, TrackStatus

CONFIG = RegistrationConfig(position_sigma_m=5.0, clock_sigma_s=0.1, roll_sigma_deg=1.0)
wild = st.one_of(st.floats(), st.sampled_from([math.nan, math.inf, 0.0, -1.0]))


def tame(low: float, high: float):
    return st.one_of(*[st.floats(low, high)] * 5, wild)


plots = st.tuples(tame(1.0, 3000.0), tame(-3.2, 3.2), tame(-0.2, 1.5), tame(-50.0, 50.0))
numbers = st.floats(-200.0, 200.0)
scans = st.builds(
    lambda sensor, t, rows, sigma, place: Scan(
        t,
        t,
        sensor,
        "radar",
        np.array(rows).reshape(-1, 4),
        np.tile(np.diag(np.array(sigma) ** 2), (len(rows), 1, 1)),
        np.full(len(rows), t),
        sensor_position=np.array(place),
        detection=DetectionModel(np.array([3000.0]), np.array([0.9])),
    ),
    st.sampled_from(["a", "b", "c"]),
    tame(0.0, 5.0),
    st.lists(plots, max_size=4),
    st.tuples(tame(0.1, 30.0), tame(1e-4, 0.1), tame(1e-4, 0.1), tame(0.1, 1.0)),
    st.one_of(*[st.just((0.0, 0.0, 0.0))] * 5, st.tuples(wild, numbers, numbers)),
)
tracks = st.builds(
    lambda name, t, x, p: Track(
        name, t, np.array(x[:3]), np.array(x[3:]), np.zeros(3), np.eye(9) * p, TrackStatus.CONFIRMED, t
    ),
    st.sampled_from("xyz"),
    st.floats(0.0, 5.0),
    st.tuples(*[tame(-1000.0, 1000.0)] * 3, *[tame(-40.0, 40.0)] * 3),
    tame(0.01, 1e4),
)
step = st.tuples(st.lists(scans, max_size=3), st.lists(tracks, max_size=3), st.lists(tracks, max_size=2))


@settings(max_examples=60)
@given(st.lists(step, min_size=1, max_size=5))
def test_any_input_leaves_a_sound_covariance(steps) -> None:
    registration = Registration(CONFIG)
    for k, (heard, known, references) in enumerate(steps):
        registration.step(float(k), heard, known, references)
    p = registration.covariance
    if len(p):
        prior = np.concatenate([registration.estimate(name).prior_sigma for name in registration.sensors])
        assert np.isfinite(p).all() and np.array_equal(p, p.T)
        assert np.linalg.eigvalsh(p / np.outer(prior + 1e-9, prior + 1e-9)).min() > -1e-9
        assert (np.sqrt(p.diagonal()) <= prior * (1 + 1e-9)).all()
        assert (prior[:10] <= prior_sigma(CONFIG)).all()
    for name in registration.sensors:
        assert np.isfinite(registration.estimate(name).value).all()


@settings(max_examples=40)
@given(st.lists(st.lists(scans, max_size=3), min_size=1, max_size=5))
def test_a_network_takes_any_scans(steps) -> None:
    network = RadarNetwork(RadarNetworkConfig(registration=CONFIG), NearestTracker())
    for k, heard in enumerate(steps):
        _, events = network.step(float(k), heard)
        assert all(isinstance(event, str) and event for event in events)
    assert set(network.status(9.0)) == set(network.registration.sensors)


@given(scans.filter(lambda scan: np.isfinite(scan.t) and np.isfinite(scan.sensor_position).all()))
def test_a_radar_without_biases_keeps_its_plots(scan: Scan) -> None:
    after = Registration(CONFIG).correct(scan, inflate=False)
    kept = ~(scan.z[:, 0] <= 0.0)
    assert np.array_equal(after.z[:, [0, 2, 3]], scan.z[kept][:, [0, 2, 3]], equal_nan=True)
    turned, finite = after.z[:, 1] - scan.z[kept][:, 1], np.isfinite(after.z[:, 1])
    assert (np.abs(after.z[finite, 1]) <= math.pi).all()
    assert (np.abs(np.sin(0.5 * turned[finite])) < 1e-6).all() or np.abs(scan.z[kept][finite, 1]).max() > 1e6
