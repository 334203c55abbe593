"""Aircraft closer to each other than the errors of their reports: identities are put right once they part, and stay."""

import os

import numpy as np
import pytest

from tests.fusion_scene import STEP, Scene, follow
from wideberth.simulation.radar_plots import radar_plots

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="thousands of scans: minutes without the compiler"
)
PLACE = np.array([[400.0, -300.0, -150.0], [400.0, -285.0, -150.0]])
SPEED = np.array([[-8.0, 12.0, 0.0]] * 2)
PARTS_S = 20.0


def parting(seed: int, equipped: tuple[int, ...], seconds: float = 35.0) -> Scene:
    """Two aircraft 15 m apart that from 20 s on turn away from each other, within 5 s to 8 m/s sideways each."""
    scene = Scene(PLACE, SPEED, seconds, equipped, seed)
    side = np.clip((scene.t - PARTS_S) / 5.0, 0.0, 1.0)[:, None] * 8.0 * np.array([12.0, 8.0, 0.0]) / np.hypot(12, 8)
    scene.speeds = scene.speeds + np.stack([-side, side], axis=1)
    travelled = np.cumsum(STEP * scene.speeds[:-1], axis=0)
    scene.truth = PLACE + np.concatenate([np.zeros((1, 2, 3)), travelled])
    rng = np.random.default_rng(seed)
    scene.plots, _ = radar_plots(rng, scene.truth, scene.speeds, detection_probability=0.9, range_max=1500.0)
    return scene


def is_right(log, scene, k, who):
    """Whether the radar's track that has the identity of an aircraft is nearer to it than to the other."""
    for track in log.confirmed(k):
        if "radar" in track.sources and track.info.callsign == f"CALL{who}":
            return bool(np.argmin(np.linalg.norm(scene.truth[k] - track.position, axis=1)) == who)
    return False


@pytest.mark.parametrize("equipped", [(0, 1), (0,)])
@pytest.mark.parametrize("seed", range(6))
def test_identities_are_right_soon_after_a_formation_parts_and_do_not_swing(equipped, seed):
    scene = parting(seed, equipped)
    log = follow(scene)
    for who in equipped:
        assert all(is_right(log, scene, k, who) for k in range(round((PARTS_S + 10.0) / STEP), len(scene.t)))
    # A wrong one is put right once, and a right one is left.
    assert len(log.told("is no longer")) <= len(equipped)
    assert len({x.id for x in log.confirmed(-1)}) == 2


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_swapped_in_a_crossing(seed):
    """Two with ADS-B cross at 30 m, at the same time."""
    place = np.array([[300.0, -250.0, -150.0], [-250.0, 270.0, -150.0]])
    scene = Scene(place, np.array([[-15.0, 14.0, 0], [15.0, -14.0, 0]]), 35.0, (0, 1), seed)
    log = follow(scene)
    assert not log.told("is no longer")
    assert all(is_right(log, scene, k, who) for who in (0, 1) for k in range(80, len(scene.t)))
