"""ASTERIX and UAT as inputs of a flight, from their bytes to decisions and back out of the recording."""

import numpy as np
import pytest

from tests.live_fakes import FRAME, MISSION, SPEED, HandClock, scenario, telemetry
from wideberth.assembly import build_pipeline
from wideberth.config import build_scenario
from wideberth.evaluation.replay_check import replay
from wideberth.live.clock import LiveClock
from wideberth.live.flight_steps import FlightSteps
from wideberth.live.senders import TrafficPackets
from wideberth.recording import read_recording
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import AlertLevel, SourceInfo

STEP = 0.1
ORIGIN = {"lat_deg": 40.25, "lon_deg": -111.65}
HEAD_ON, ABOVE = (900.0, 10.0, -200.0, -17.0, 0.0, 0.0), (300.0, 500.0, -600.0, 0.0, -12.0, 0.0)
RADAR = {"range_max_m": 3000.0, "range_sigma_m": 8.0, "detection_ranges_m": [0.0, 3000.0],
         "detection_probabilities": [0.95, 0.95]}  # fmt: skip


def report(t, number, state, frame):
    latitude, longitude, altitude = (float(x) for x in frame.to_geodetic(state[:3]))
    return AdsbReport(
        t, f"{0xA10000 + number:06x}", latitude, longitude, pressure_altitude=altitude,
        velocity_north=state[3], velocity_east=state[4], climb_rate=-state[5],
        info=SourceInfo(callsign=f"UAT{number}", nic=8, nacp=9, nacv=2, sil=3),
    )  # fmt: skip


class Flown:
    """A flight on its straight mission with one more input, to which `packets(t, seconds, frame)` go."""

    def __init__(self, out, name, packets, mission=MISSION, **settings):
        self.hand = HandClock()
        self.clock = LiveClock(*self.hand.both)
        part = {"kind": name, "name": name, **settings}
        autopilot = {"kind": "tests.live_fakes:FakeAutopilot", "connection": "udp:127.0.0.1:0", "command": True}
        self.steps = FlightSteps(
            scenario(inputs=[part], autopilot=autopilot, origin=ORIGIN), out, lambda _: True, self.clock
        )
        self.mission = {} if mission is None else {"mission": mission}
        self.name, self.packets, self.snapshots = name, packets, []

    def run(self, seconds, *, silent=False):
        first = len(self.snapshots)
        for _ in range(round(seconds / STEP)):
            self.hand.advance(STEP)
            t = self.clock.now()
            e = t - 1_700_000_000.0
            line = telemetry(t, (-400.0 + SPEED * e, 0.0, -200.0), (SPEED, 0.0, 0.0), **self.mission)
            self.steps.queue.put(t, line)
            self.steps.place({})
            if not silent:
                for data in self.packets(t - 0.02, e - 0.02, FRAME):
                    self.steps.queues[self.name].put(t, data)
            self.snapshots.append(self.steps.step(t))
        return [s for s in self.snapshots[first:] if s is not None]

    def finish(self):
        summary = self.steps.summary(0, {})
        self.steps.close(summary)
        recorded = read_recording(self.steps.recording)
        pipeline = build_pipeline(build_scenario(recorded.scenario), lambda: 0.0, live=True)
        assert replay(recorded, pipeline).identical
        return summary["live"]["inputs"][self.name]


def state_at(state, seconds):
    now = np.array(state)
    now[:3] += seconds * now[3:]
    return now


def test_uat_is_avoided_and_its_silence_is_told(tmp_path):
    encoder = TrafficPackets("uat")

    def packets(t, seconds, frame):
        which = {0: HEAD_ON, 5: ABOVE}.get(round(seconds / STEP) % 10)
        return [] if which is None else encoder.encode(
            [report(t, int(which is ABOVE), state_at(which, seconds), frame)], t
        )  # fmt: skip

    flown = Flown(tmp_path, "uat", packets, connect="127.0.0.1:1", silent_after_s=3.0)
    seen = flown.run(25.0)
    labels = {track.label for track in seen[-1].tracks}
    assert labels == {"UAT0", "UAT1"}
    assert max(s.alert_state for s in seen) >= AlertLevel.CORRECTIVE
    assert any(s.maneuver is not None and "UAT0" in s.maneuver.reason for s in seen)
    quiet = flown.run(6.0, silent=True)
    assert AlertLevel.CLEAR not in {s.alert_state for s in quiet[35:]}
    assert quiet[-1].sensors["uat"].state.startswith("silent")
    counters = flown.finish()
    assert counters["state vectors"] >= 45


def test_without_a_mission_threats_are_told_and_nothing_is_commanded(tmp_path):
    encoder = TrafficPackets("uat")
    late = (1200.0, 10.0, -200.0, -17.0, 0.0, 0.0)

    def packets(t, seconds, frame):
        return encoder.encode([report(t, 0, state_at(late, seconds), frame)], t) if seconds % 1 < STEP else []

    flown = Flown(tmp_path, "uat", packets, mission=None, connect="127.0.0.1:1", silent_after_s=3.0)
    assert flown.run(9.0) == []
    assert flown.steps.status(0)["why"] == "waiting for the mission"
    first = flown.run(3.0)[-1]
    status = flown.steps.status(0)
    assert first.alert_state == AlertLevel.UNKNOWN and status["why"].startswith("the autopilot has no mission")
    assert status["mission"] is None and status["tracks"] == 1
    seen = flown.run(25.0)
    assert max(s.alert_state for s in seen) == AlertLevel.WARNING
    assert AlertLevel.CLEAR not in {s.alert_state for s in seen}
    assert any(s.maneuver is not None for s in seen)
    assert all(maneuver is None for _, maneuver in flown.steps.autopilot.flown)
    # Once there is one it is flown.
    flown.mission = {"mission": MISSION}
    flown.run(1.0)
    assert flown.steps.status(0)["mission"] == {"index": 1, "waypoints": 2}
    flown.finish()


@pytest.mark.parametrize("carries", ["plots", "reports"])
def test_asterix_is_avoided_and_its_silence_is_told(tmp_path, carries):
    encode = pytest.importorskip("wideberth.links.asterix.encode", reason="needs libasterix")
    pytest.importorskip("asterix", reason="ASTERIX needs libasterix (pip install 'wideberth[links]')")
    encoder = encode.AsterixEncoder(0, 7)

    def packets(t, seconds, frame):
        states = [state_at(state, seconds) for state in (HEAD_ON, ABOVE)]
        if carries == "reports":
            return [encoder.adsb([report(t, k, s, frame) for k, s in enumerate(states)])] if seconds % 1 < STEP else []
        rows = []
        for state in states:
            p, v = state[:3], state[3:]
            r = float(np.linalg.norm(p))
            rows.append([r, np.arctan2(p[1], p[0]), np.arcsin(-p[2] / r), p @ v / r])
        return [encoder.plots(t, np.array(rows))]

    flown = Flown(
        tmp_path, "asterix", packets, listen="0", carries=carries, scan="packet", silent_after_s=3.0,
        units=[RADAR] if carries == "plots" else [],
    )  # fmt: skip
    seen = flown.run(25.0)
    assert sum(not track.is_ownship for track in seen[-1].tracks) == 2
    assert max(s.alert_state for s in seen) >= AlertLevel.CORRECTIVE
    assert any(s.maneuver is not None for s in seen)
    quiet = flown.run(6.0, silent=True)
    assert AlertLevel.CLEAR not in {s.alert_state for s in quiet[35:]}
    assert all(h.state != "ok" for name, h in quiet[-1].sensors.items() if name.startswith("asterix"))
    assert flown.finish()
