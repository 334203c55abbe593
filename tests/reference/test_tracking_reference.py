"""The ADS-B tracker on recorded traffic of 213 aircraft, time stamps rounded to whole seconds."""

import gzip
import json
import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from wideberth.frames import LocalFrame
from wideberth.sensors.adsb.accuracy import measurement_covariance
from wideberth.sensors.adsb.config import AdsbNoiseConfig
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.types import Scan, SourceInfo, TrackStatus
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

FILE = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "adsb" / "trajectories_213_aircraft.json.gz"
pytestmark = pytest.mark.skipif(not FILE.exists(), reason="recorded traffic is not here")
AIRCRAFT = 24


@pytest.fixture(scope="module")
def flights() -> dict[str, NDArray[np.float64]]:
    """Rows of time, north, east, down, velocity north, east, down of some aircraft below 3000 m."""
    with gzip.open(FILE) as stream:
        rows: list[dict[str, Any]] = json.load(stream)
    frame = LocalFrame(math.radians(48.8), math.radians(2.3))
    by_address = defaultdict(list)
    for row in rows:
        if not row["onground"] and row["altitude"] is not None and row["altitude"] * FOOT < 3000.0:
            by_address[row["icao24"]].append(row)
    result = {}
    for address, own in sorted(by_address.items()):
        if len(own) < 300:
            continue
        own.sort(key=lambda row: row["timestamp"])
        names = ("timestamp", "latitude", "longitude", "altitude", "groundspeed", "track", "vertical_rate")
        t, lat, lon, alt, speed, course, climb = (
            np.array([math.nan if row[name] is None else row[name] for row in own], float) for name in names
        )
        p = frame.to_ned(np.radians(lat), np.radians(lon), alt * FOOT)
        v = np.stack([np.cos(np.radians(course)), np.sin(np.radians(course)), 0 * course], axis=1) * KNOT
        v = frame.velocity_to_ned(np.radians(lat), np.radians(lon), v * speed[:, None])
        v[:, 2] = -climb * FOOT_PER_MINUTE
        result[address] = np.column_stack([t / 1000.0, p, v])[:600]
        if len(result) == AIRCRAFT:
            break
    return result


def test_velocity_and_prediction(flights: dict[str, NDArray[np.float64]]) -> None:
    """Against the reported velocities, which the tracker does not use after the start, and later positions."""
    velocity, turning, ahead, rejected, frozen, taken = [], [], [], 0, 0, 0
    config = AdsbNoiseConfig()
    for address, rows in flights.items():
        tracker = AdsbKalmanTracker(AdsbKalmanConfig())
        moved = np.r_[True, np.any(np.diff(rows[:, 1:3], axis=0) != 0.0, axis=1)]
        course = np.unwrap(np.nan_to_num(np.arctan2(rows[:, 5], rows[:, 4])))
        for k, row in enumerate(rows):
            r = measurement_covariance([SourceInfo()], config, -row[None, 6])
            scan = Scan(row[0], row[0], "adsb", "adsb", row[None, 1:], r, row[None, 0], (address,))
            tracks, _ = tracker.step(row[0], [scan])
            if not tracks or tracks[0].status is not TrackStatus.CONFIRMED or k < 10 or not moved[k]:
                continue
            error = float(np.hypot(*(tracks[0].velocity - row[4:])[:2]))
            if math.isfinite(error):
                velocity.append(error)
                if 5 <= k < len(rows) - 5 and abs(course[k + 3] - course[k - 3]) > math.radians(6.0):
                    turning.append(error)
            later = np.searchsorted(rows[:, 0], row[0] + 20.0)
            if later < len(rows) and abs(rows[later, 0] - row[0] - 20.0) < 0.5 and moved[later]:
                ahead.append(float(np.hypot(*(tracks[0].position + 20.0 * tracks[0].velocity - rows[later, 1:4])[:2])))
        counters = tracker.counters
        rejected += counters.get("position outside the gate", 0)
        frozen += counters.get("position not new", 0)
        taken += counters["position accepted"]
        assert counters["reports"] == len(rows)
        assert counters.get("position not new", 0) >= np.sum(~moved) - 1
    assert np.median(velocity) < 4.0
    assert np.percentile(velocity, 95) < 12.0
    assert len(turning) > 200
    assert np.median(turning) < 6.0
    assert np.median(ahead) < 130.0
    assert rejected < 0.005 * taken
    assert frozen > 100
