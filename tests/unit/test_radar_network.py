"""Radars as cells: one identity across a handover, and radars that move, fall silent or go blind."""

import dataclasses
import math

import numpy as np
import pytest

from tests.made_radars import CELL, PLACES, cells, crossing, fly, sites_with, wandering
from tests.nearest_tracker import NearestTracker
from wideberth.tracking.config import RadarNetworkConfig
from wideberth.tracking.radar_network import RadarNetwork
from wideberth.types import FloatArray, Scan, TrackStatus

CONFIG = RadarNetworkConfig()
THREE_DEGREES = math.radians(3.0)


def test_registration_keeps_one_identity_across_a_handover() -> None:
    """Two radars 600 m apart, one off by 3 deg, three aircraft through both cells, in each of five seeds."""
    switches, duplicates, seen, nees = 0, 0, 0, []
    for seed in range(5):
        sites, scene = cells(THREE_DEGREES), crossing(seed)
        plain = fly(sites, *scene, seed, config=None)
        network = fly(sites, *scene, seed, config=CONFIG)
        assert plain.duplicates > 0.3 * plain.seen
        assert [len(ids) for ids in network.ids] == [1, 1, 1]
        assert network.rms < 0.9 * plain.rms
        switches += sum(len(ids) - 1 for ids in plain.ids)
        duplicates, seen = duplicates + network.duplicates, seen + network.seen
        nees += network.nees
    assert switches >= 10
    assert duplicates < 0.01 * seen
    # Not too little covariance; too much, as the noise of the plots has the biases in it while they are not known.
    assert 0.3 < np.mean(nees) / 3 < 1.3


def test_without_a_bias_registration_does_no_harm() -> None:
    for seed in range(2):
        sites, scene = cells(0.0), crossing(seed)
        plain, network = fly(sites, *scene, seed, config=None), fly(sites, *scene, seed, config=CONFIG)
        assert [len(ids) for ids in network.ids] == [1, 1, 1]
        # While the biases are not known they cost some accuracy.
        assert network.rms < 1.3 * plain.rms
        assert network.said("ALARM") == [] and network.said("no longer fits") == []


def test_handovers_and_biases_are_said() -> None:
    flown = fly(cells(math.radians(7.5)), *crossing(0), 0, config=CONFIG)
    network = flown.network
    assert network is not None
    assert [event for _, event in flown.events[:2]] == ["radar west joins the network", "radar east joins the network"]
    for ids in flown.ids:
        assert any(f"track {ids[0]} handed over from radar" in event for _, event in flown.events)
    assert network.counters["handover"] == len(flown.said("handed over")) >= 3
    east = [
        event for _, event in flown.events if event.startswith("radar east: azimuth off by") and "corrected" in event
    ]
    assert abs(float(east[-1].split()[5]) - 7.5) < 2.0
    assert network.serving(flown.ids[0][0]) == "east"


def test_coverage_is_that_of_the_cells() -> None:
    flown = fly(cells(0.0), *crossing(0, 5.0), 0, config=CONFIG)
    network = flown.network
    assert network is not None
    high = np.array([0.0, 0.0, -100.0])
    assert network.covering(high) == ("west", "east")
    assert network.covering(high + PLACES[1]) == ("east", "west")
    assert network.covering(high - PLACES[1]) == ("west",)
    assert network.covering(high * 0 + [2000.0, 0.0, -100.0]) == ()
    assert network.serving("no such track") is None


def test_an_aircraft_that_leaves_all_cells_is_said() -> None:
    """The third flies east at 28 m/s and leaves the eastern cell, 1500 m away, before 90 s."""
    flown = fly(cells(0.0), *crossing(0, 90.0), 0, config=CONFIG)
    said = flown.said(f"track {flown.ids[2][0]} is outside of all radars, last seen by radar east")
    assert len(said) == 1 and 76.0 < said[0] < 84.0


def wander(seconds: float = 80.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    t = np.arange(0.0, seconds + 0.1, 0.25)
    positions, velocities = wandering(t, 5, 4)
    return t, positions, velocities


NO_BIAS = np.zeros(10)
MOVED = np.array([30.0, 0.0, 0.12, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_of_three_radars_the_one_that_was_moved_is_named() -> None:
    sites = sites_with([NO_BIAS] * 3)
    sites[1] = dataclasses.replace(sites[1], changes=((40.0, MOVED),))
    flown = fly(sites, *wander(), 1, config=CONFIG)
    assert len(flown.said("no longer fits")) == 1
    assert 40.0 < flown.said("radar east no longer fits: moved or turned?")[0] < 60.0
    network = flown.network
    assert network is not None
    estimate = network.registration.estimate("east")
    assert (np.abs((estimate.value - MOVED)[[0, 2, 3]]) < 4.0 * estimate.sigma[[0, 2, 3]]).all()
    assert len(flown.said("radar east: ALARM, azimuth off by 6.")) == 1
    assert network.status(80.0)["east"].state == "alarm"
    assert network.status(80.0)["west"].state == "ok"


def test_of_two_radars_neither_is_named_alone() -> None:
    sites = sites_with([NO_BIAS] * 2)
    sites[1] = dataclasses.replace(sites[1], changes=((40.0, MOVED),))
    flown = fly(sites, *wander(60.0), 1, config=CONFIG)
    assert len(flown.said("radar west or radar east no longer fits")) == 1
    assert [len(ids) for ids in flown.ids] == [1] * 4


def test_silent_and_blind_radars_are_said_and_the_tracks_live() -> None:
    sites = sites_with([NO_BIAS] * 3)
    sites[1] = dataclasses.replace(sites[1], silent=((20.0, 40.0),))
    sites[2] = dataclasses.replace(sites[2], blind=((30.0, 50.0),))
    flown = fly(sites, *wander(55.0), 1, config=CONFIG)
    network = flown.network
    assert network is not None
    (silent,), (back,) = flown.said("radar east is silent for"), flown.said("radar east is back after 2")
    (blind,), (again,) = flown.said("radar north is blind"), flown.said("radar north sees aircraft again")
    assert 24.0 < silent < 27.0 and 40.0 <= back < 41.5 and 30.0 < blind < 36.0 and 50.0 <= again < 52.0
    assert [len(ids) for ids in flown.ids] == [1] * 4
    assert network.counters["radar silent"] == network.counters["radar blind"] == 1
    assert {name: state.state for name, state in network.status(55.0).items()} == dict.fromkeys(
        network.status(55.0), "ok"
    )


def test_a_silent_radar_covers_nothing() -> None:
    sites = cells(0.0, silent=((5.0, 99.0),))
    flown = fly(sites, *crossing(0, 15.0), 0, config=CONFIG)
    network = flown.network
    assert network is not None
    assert network.status(15.0)["east"].state == "silent"
    assert network.status(15.0)["east"].age == pytest.approx(10.0, abs=1.0)
    assert network.covering(np.array([0.0, 300.0, -100.0])) == ("west",)


def test_a_radar_that_says_it_was_moved_starts_again_and_the_tracks_live() -> None:
    """East stands 50 m farther north from 30 s on, and says so; its azimuth is off by another amount."""
    sites = sites_with([NO_BIAS] * 3)
    before = dataclasses.replace(sites[1], silent=((30.0, 99.0),))
    turned = NO_BIAS.copy()
    turned[2] = 0.05
    after = dataclasses.replace(
        sites[1], name="moved", position=PLACES[1] + [50.0, 0.0, 0.0], bias=turned, silent=((-1.0, 30.0),)
    )

    def same_name(t: float, scans: list[Scan]) -> list[Scan]:
        return [dataclasses.replace(scan, sensor=scan.sensor.replace("moved", "east")) for scan in scans]

    flown = fly([sites[0], before, sites[2], after], *wander(70.0), 1, config=CONFIG, change=same_name)
    assert len(flown.said("radar east: its pose has changed by 50.0 m and 0.0 deg, its biases start again")) == 1
    network = flown.network
    assert network is not None
    estimate = network.registration.estimate("east")
    assert abs(estimate.value[2] - 0.05) < 4.0 * estimate.sigma[2] < 0.04
    assert flown.said("no longer fits") == []
    assert [len(ids) for ids in flown.ids] == [1] * 4


def test_bad_scans_are_said_and_do_not_reach_the_tracker() -> None:
    network = RadarNetwork(CONFIG, NearestTracker())
    z, noise = np.array([[500.0, 0.1, 0.2, 0.0]]), np.diag([9.0, 1e-4, 1e-4, 1.0])[None]
    good = Scan(1.0, 1.0, "west", "radar", z, noise, np.ones(1), detection=CELL)
    bad = dataclasses.replace(good, sensor="east", sensor_attitude=np.full((3, 3), math.nan))
    tracks, events = network.step(1.0, [bad, good])
    assert events == (
        "radar east: a scan whose time or pose is not finite is not used",
        "radar west joins the network",
    )
    assert len(tracks) == 1 and tracks[0].status == TrackStatus.TENTATIVE
    assert network.counters == {"scan: time or pose not finite": 1}
    with pytest.raises(ValueError, match="time nan is not finite"):
        network.step(math.nan, [])


def test_other_scans_reach_the_tracker_as_they_are() -> None:
    seen: list[Scan] = []

    class Recorder:
        def step(self, t, scans):
            seen.extend(scans)
            return (), ("said by the tracker",)

    other = Scan(1.0, 1.0, "receiver", "adsb", np.zeros((0, 6)), np.zeros((0, 6, 6)), np.zeros(0))
    tracks, events = RadarNetwork(CONFIG, Recorder()).step(1.0, [other])
    assert tracks == () and events == ("said by the tracker",) and seen == [other] and seen[0] is other


def test_a_radar_alone_is_not_made_noisier() -> None:
    """What nobody disagrees with is added to the tracks, not to the plots."""
    raw: list[Scan] = []

    class Recorder(NearestTracker):
        def step(self, t, scans):
            raw.extend(scans)
            return super().step(t, scans)

    network = RadarNetwork(CONFIG, Recorder())
    z, noise = np.array([[500.0, 0.1, 0.2, 0.0]]), np.diag([9.0, 1e-4, 1e-4, 1.0])[None]
    for k in range(8):
        t = 0.5 * k
        tracks, _ = network.step(t, [Scan(t, t, "west", "radar", z, noise, np.full(1, t), detection=CELL)])
    assert all(np.array_equal(scan.R, noise) for scan in raw)
    left = network.registration.position_covariance("west", tracks[0].position, tracks[0].velocity)
    # 3 deg at 500 m across, 20 m along.
    assert np.sqrt(np.linalg.eigvalsh(left)) == pytest.approx([13.1, 20.0, 25.6], rel=0.05)
    assert (tracks[0].covariance[:3, :3].diagonal() > left.diagonal()).all()
