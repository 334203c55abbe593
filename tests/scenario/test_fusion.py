"""One track from radar plots and ADS-B reports: identities, hand-over, dropouts, duplicates, ghosts."""

import os

import numpy as np
import pytest

from tests.fusion_scene import Scene, errors_of, follow, nearest

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="thousands of scans: minutes without the compiler"
)
NEAR, SLOW = np.array([[400.0, -300.0, -150.0]]), np.array([[-8.0, 12.0, 0.0]])


def numbers(log, begin):
    return {t.id for k in range(begin, len(log.tracks)) for t in log.confirmed(k)}


def test_plots_and_reports_feed_one_track_of_one_number() -> None:
    scene = Scene(NEAR, SLOW, 20.0, (0,))
    log = follow(scene)
    (track,) = log.confirmed(-1)
    assert set(track.sources) == {"radar", "adsb"} and track.info.callsign == "CALL0"
    assert len(numbers(log, 0)) == 1 and log.told(f"track {track.id} is A00000 (CALL0)")
    e, _ = errors_of(log, scene, 0, 100)
    assert np.sqrt((e[:, :3] ** 2).sum(axis=1).mean()) < 3.0


@pytest.mark.parametrize("equipped", [(0, 1), (0,)])
def test_formation_stays_two_tracks(equipped: tuple[int, ...]) -> None:
    place = np.array([[400.0, -300.0, -150.0], [400.0, -260.0, -150.0]])
    log = follow(Scene(place, np.repeat(SLOW, 2, axis=0), 25.0, equipped))
    last = log.confirmed(-1)
    assert len(last) == 2 and sum(t.info.callsign is not None for t in last) == len(equipped)


def test_hand_over_into_radar_range_and_out_keeps_the_number() -> None:
    log = follow(Scene(np.array([[-1800.0, 100.0, -150.0]]), np.array([[30.0, 0.0, 0.0]]), 120.0, (0,)))
    assert len(numbers(log, 0)) == 1 and max(len(log.confirmed(k)) for k in range(1200)) == 1
    assert log.told("goes on by its reports alone") and log.confirmed(-1)[0].sources == ("adsb",)


@pytest.mark.parametrize("silent", ["radar", "adsb"])
def test_either_sensor_may_fall_silent(silent: str) -> None:
    def works(t: float) -> bool:
        return not 10.0 < t < 40.0

    scene = Scene(NEAR, SLOW, 50.0, (0,))
    log = follow(scene, radar=works) if silent == "radar" else follow(scene, adsb=works)
    assert len(numbers(log, 50)) == 1 and all(len(log.confirmed(k)) == 1 for k in range(50, 500))


def test_one_address_of_two_aircraft_makes_two_tracks() -> None:
    place = np.array([[3000.0, -300.0, -150.0], [-3000.0, 4000.0, -350.0]])
    scene = Scene(place, np.array([[-40.0, 12, 0], [0, 50, 0]]), 20.0, (0, 1), addresses=("abcdef", "abcdef"))
    log = follow(scene)
    assert len(log.confirmed(-1)) == 2 and log.told("ABCDEF#2")


def test_a_ghost_is_kept_and_pulls_no_track() -> None:
    place = np.array([[400.0, -300.0, -150.0], [380.0, -250.0, -150.0]])
    scene = Scene(place, np.array([[-8.0, 12, 0], [-8, 6, 0]]), 25.0, (1,), echoes=(0,))
    log = follow(scene)
    assert len(log.confirmed(-1)) == 2 and log.told("is no longer A00001")
    track = nearest([t for t in log.confirmed(-1) if "radar" in t.sources], scene.truth[-1, 0])
    assert np.linalg.norm(track.position - scene.truth[-1, 0]) < 5.0 and track.info.callsign is None
