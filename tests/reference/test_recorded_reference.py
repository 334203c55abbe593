"""Recorded traffic from the real recording: faults found, positions near the reports, velocities consistent."""

import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest

from wideberth.frames import LocalFrame
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.simulation.recorded import RecordedTraffic
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

RECORDING = (
    Path(__file__).resolve().parents[2].parent / "shared" / "data" / "adsb" / "trajectories_213_aircraft.json.gz"
)
FRAME = LocalFrame(math.radians(48.7), math.radians(2.3))


def value(row: dict[str, float | None], name: str) -> float:
    found = row[name]
    return math.nan if found is None else found


@pytest.fixture(scope="module")
def reports() -> list[AdsbReport]:
    if not RECORDING.exists():
        pytest.skip(f"recording absent: {RECORDING.name}")
    with gzip.open(RECORDING) as file:
        rows = json.load(file)
    made = []
    for row in rows:
        speed, track = value(row, "groundspeed") * KNOT, math.radians(value(row, "track"))
        made.append(
            AdsbReport(
                row["timestamp"] / 1e3,
                row["icao24"],
                math.radians(row["latitude"]),
                math.radians(row["longitude"]),
                value(row, "altitude") * FOOT,
                math.nan,
                speed * math.cos(track),
                speed * math.sin(track),
                value(row, "vertical_rate") * FOOT_PER_MINUTE,
                bool(row["onground"]),
            )
        )
    return made


@pytest.fixture(scope="module")
def traffic(reports: list[AdsbReport]) -> RecordedTraffic:
    return RecordedTraffic(reports, FRAME)


def test_faults_are_found(traffic: RecordedTraffic) -> None:
    assert len(traffic.ids) == 213
    # Counted beforehand over the whole file: 15,645 repeated positions and 89 spikes by a stricter rule.
    assert 15_000 < traffic.counters["repeated positions"] < 16_500
    assert 85 <= traffic.counters["altitude spikes"] <= 135


def test_positions_stay_near_the_new_reports(traffic: RecordedTraffic, reports: list[AdsbReport]) -> None:
    index = {name: i for i, name in enumerate(traffic.ids)}
    distances = []
    last: dict[str, tuple[float, float]] = {}
    for r in reports:
        place = (r.latitude, r.longitude)
        if not r.on_ground and r.address in index and last.get(r.address) != place and int(r.t) % 11 == 0:
            truth = traffic.truth(r.t)
            if r.address in truth.ids:
                raw = FRAME.to_ned(r.latitude, r.longitude, 0.0)
                distances.append(math.dist(truth.positions[truth.ids.index(r.address)][:2], raw[:2]))
        last[r.address] = place
    assert len(distances) > 15_000
    assert np.quantile(distances, 0.5) < 12.0
    assert np.quantile(distances, 0.999) < 20.0 + 1e-3


def test_altitudes_have_no_spikes_and_velocities_fit_the_positions(traffic: RecordedTraffic) -> None:
    states = traffic.truth_many(np.arange(traffic.t_start, traffic.t_end))
    step = np.diff(states, axis=0)
    middle = (states[1:] + states[:-1]) / 2
    assert np.nanmax(np.abs(step[..., 2])) < 50.0
    low = middle[..., 2] > -2000.0
    error = np.hypot(step[..., 0] - middle[..., 3], step[..., 1] - middle[..., 4])[low]
    error = error[np.isfinite(error)]
    assert len(error) > 20_000
    assert np.quantile(error, 0.5) < 6.0 and np.quantile(error, 0.9) < 20.0
