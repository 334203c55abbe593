"""Which tracks are avoided."""

import numpy as np
import pytest

from wideberth.avoidance.sound_tracks import SoundTracks
from wideberth.types import Track, TrackStatus


def track(status, sigma, speed=12.0):
    p = np.diag([25.0] * 3 + [sigma**2] * 3 + [1.0] * 3)
    return Track(
        "7", 0.0, np.array([100.0, 0.0, -200.0]), np.array([speed, 0.0, 0.0]), np.zeros(3), p, status, 0.0, 0.9
    )


@pytest.mark.parametrize(
    ("status", "sigma", "speed", "used"),
    [
        (TrackStatus.COASTING, 28.0, 12.0, False),
        (TrackStatus.COASTING, 3.0, 12.0, True),
        # What is seen is avoided, however little is known of its motion; so is what is fast, wherever it goes.
        (TrackStatus.CONFIRMED, 28.0, 12.0, True),
        (TrackStatus.COASTING, 28.0, 45.0, True),
    ],
)
def test_what_was_lost_before_its_motion_was_known_leads_nowhere(status, sigma, speed, used):
    tracks = SoundTracks(10.0, tentative=False)
    found, events = tracks.step(0.0, [track(status, sigma, speed)])
    assert [(one.id, sound) for one, sound in found] == ([("7", True)] if used else [])
    assert tracks.counters["motion_unknown"] == (not used) and events == []
