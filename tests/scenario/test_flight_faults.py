"""A flight whose links fail: nothing stops it, it never says clear without knowing, and it recovers."""

import math

import numpy as np
import pytest

from tests.live_fakes import MISSION, SPEED, HandClock, radar_datagram, scenario, telemetry
from wideberth.assembly import build_pipeline
from wideberth.config import build_scenario
from wideberth.errors import InputError
from wideberth.evaluation.replay_check import replay
from wideberth.live.clock import LiveClock
from wideberth.live.flight_steps import FlightSteps
from wideberth.recording import Recorder, read_recording
from wideberth.types import AlertLevel

STEP = 0.1
HEAD_ON = (530.0, 10.0, -200.0, -17.0, 0.0, 0.0)
FAR_AWAY = (2500.0, 1000.0, -200.0, 17.0, 0.0, 0.0)


class Scene:
    """An ownship on its straight mission, one aircraft, and a radar on the ground: all exact, until a link fails."""

    def __init__(self, out, target=HEAD_ON, **changes):
        self.hand = HandClock()
        self.clock = LiveClock(*self.hand.both)
        self.sent = []
        self.steps = FlightSteps(scenario(**changes), out, self._send, self.clock)
        self.target = np.array(target)
        self.start = self.clock.now()
        self.sequence = 0
        self.snapshots = []
        self.events = []
        self.rng = np.random.default_rng(8)
        self.telemetry_t = self.radar_t = -math.inf  # of the last that got through, by its content

    def _send(self, data):
        self.sent.append(data)
        return True

    @property
    def elapsed(self):
        return self.clock.now() - self.start

    def run(self, seconds, *, own=True, radar=True, gps=True, radar_clock=0.0, wire=lambda packets: packets):
        """Fly on; `wire` may drop, repeat and reorder a step's packets: (queue, time of arrival, data, content)."""
        first = len(self.snapshots)
        for _ in range(round(seconds / STEP)):
            self.hand.advance(STEP)
            t, e = self.clock.now(), self.elapsed
            packets = []
            if own:
                t_own = t if gps else self.telemetry_t
                line = telemetry(t_own, (-400.0 + SPEED * e, 0.0, -200.0), (SPEED, 0.0, 0.0), mission=MISSION)
                packets.append((self.steps.queue, t, line, ("own", t_own)))
            if radar:
                at = self.target.copy()
                at[:3] += e * at[3:]
                data = radar_datagram(self.sequence, t + radar_clock - 0.02, [at])
                packets.append((self.steps.queues["radar"], t, data, ("radar", t - 0.02)))
            self.sequence += 1
            for queue, arrived, data, (what, content) in wire(packets):
                queue.put(arrived, data)
                if what == "own":
                    self.telemetry_t = max(self.telemetry_t, content)
                elif what == "radar" and not radar_clock:
                    self.radar_t = max(self.radar_t, content)
            self.steps.place({})
            snapshot = self.steps.step(t)
            self.events += self.steps.take_events()
            self._check(t, snapshot)
            self.snapshots.append(snapshot)
        return self.snapshots[first:]

    def _check(self, t, snapshot):
        """The promise: clear is only said of a sky that is watched, by an ownship that knows where it is."""
        status = self.steps.status(0)
        if snapshot is None:
            assert status["state"] == "unknown" and status["why"].startswith("waiting for")
        elif snapshot.alert_state == AlertLevel.CLEAR:
            assert t - self.telemetry_t <= 0.6 and t - self.radar_t <= 1.1
            assert status["why"] == ""
        elif snapshot.alert_state == AlertLevel.UNKNOWN:
            assert status["why"]

    def recovery(self, since):
        """Time from `since` (snapshots) until the state is known again for good, s."""
        states = [s.alert_state for s in self.snapshots[since:]]
        unknown = [k for k, state in enumerate(states) if state == AlertLevel.UNKNOWN]
        assert states[-1] != AlertLevel.UNKNOWN
        return (unknown[-1] + 1) * STEP if unknown else 0.0

    def finish(self):
        """Every decision of the recording can be made again, bit for bit."""
        summary = self.steps.summary(0, {})
        self.steps.close(summary)
        recorded = read_recording(self.steps.recording)
        assert recorded.complete and recorded.live and recorded.summary["live"] == summary["live"]
        pipeline = build_pipeline(build_scenario(recorded.scenario), lambda: 0.0, live=True)
        result = replay(recorded, pipeline)
        assert result.identical, result
        return summary


def levels(snapshots):
    return {s.alert_state for s in snapshots}


def test_before_telemetry_and_mission_everything_is_unknown(tmp_path):
    scene = Scene(tmp_path)
    assert scene.run(2.0, own=False) == [None] * 20
    assert scene.steps.status(0)["why"] == "waiting for telemetry and the mission"
    assert scene.steps.recording is None
    assert scene.run(5.0)[0] is not None
    summary = scene.finish()
    assert summary["live"]["world"] == {"packets before the first step": 20}


def test_a_cut_link_to_the_autopilot_is_unknown_and_recovers(tmp_path):
    scene = Scene(tmp_path, FAR_AWAY)
    assert scene.run(6.0)[-1].alert_state == AlertLevel.CLEAR
    cut = scene.run(10.0, own=False)
    assert levels(cut[6:]) == {AlertLevel.UNKNOWN}
    assert cut[-1].ownship.state == "no telemetry for 10 s"
    since = len(scene.snapshots)
    scene.run(5.0)
    assert scene.recovery(since) <= 0.2
    assert any("no telemetry" in event for event in scene.events)
    scene.finish()


def test_a_cut_link_to_the_radar_is_unknown_and_recovers(tmp_path):
    scene = Scene(tmp_path, FAR_AWAY)
    scene.run(6.0)
    cut = scene.run(10.0, radar=False)
    assert levels(cut[11:]) == {AlertLevel.UNKNOWN}
    assert cut[-1].sensors["radar"].state == "silent for 10 s"
    since = len(scene.snapshots)
    scene.run(8.0)
    # It watches again once it has been heard for a second: what it sees first is no track yet.
    assert 1.0 <= scene.recovery(since) <= 2.0
    scene.finish()


def test_position_without_gps_is_unknown_although_the_link_is_there(tmp_path):
    scene = Scene(tmp_path, FAR_AWAY)
    scene.run(6.0)
    lost = scene.run(5.0, gps=False)
    assert levels(lost[6:]) == {AlertLevel.UNKNOWN}
    since = len(scene.snapshots)
    scene.run(3.0)
    assert scene.recovery(since) <= 0.2
    scene.finish()


def test_loss_repeats_and_disorder_neither_stop_nor_hide(tmp_path):
    scene = Scene(tmp_path)
    held = []

    def wire(packets):
        out = [packet for packet in packets if scene.rng.random() > 0.3]
        out += [packet for packet in out if scene.rng.random() < 0.2]  # twice
        out += [held.pop() for _ in range(len(held)) if scene.rng.random() < 0.5]  # late, and behind newer ones
        held.extend(packet for packet in packets if scene.rng.random() < 0.2)
        scene.rng.shuffle(out)
        return [(queue, scene.clock.now(), data, what) for queue, _, data, what in out]

    scene.run(3.0)
    bad = scene.run(20.0, wire=wire)
    # The aircraft comes head-on all the time: it is lost sight of at no step.
    assert min(levels(bad[10:])) >= AlertLevel.CORRECTIVE
    summary = scene.finish()
    counters = summary["live"]["inputs"]["radar"]
    assert counters["packets lost"] > 10
    assert counters["sequence number repeated"] > 10 and counters["behind a newer packet"] > 5


@pytest.mark.parametrize("jump", [3.0, -3.0])
def test_a_jump_of_the_hosts_clock_changes_nothing_but_is_told(tmp_path, jump):
    scene = Scene(tmp_path, FAR_AWAY)
    scene.run(6.0)
    scene.hand.wall += jump
    after = scene.run(4.0)
    assert levels(after) == {AlertLevel.CLEAR}
    assert [e for e in scene.events if "clock" in e] == [
        f"the host's clock jumped by {jump:+.1f} s: live time goes on as before"
    ]
    assert np.diff([s.t for s in scene.snapshots if s is not None]).max() < 0.11
    told = [text for step in read_steps(scene) for text in step.told]
    assert any("jumped" in text for text in told)


def read_steps(scene):
    scene.finish()
    return list(read_recording(scene.steps.recording).steps())


@pytest.mark.parametrize("jump", [3.0, -3.0])
def test_a_radars_clock_that_jumps_is_unknown_until_it_is_right_again(tmp_path, jump):
    scene = Scene(tmp_path, FAR_AWAY)
    scene.run(6.0)
    wrong = scene.run(5.0, radar_clock=jump)
    assert levels(wrong[11:]) == {AlertLevel.UNKNOWN}
    assert scene.steps.status(0)["inputs"]["radar"]["state"].startswith("all refused: time")
    since = len(scene.snapshots)
    scene.run(6.0)
    assert scene.recovery(since) <= 2.0
    scene.finish()


def test_a_mission_that_is_changed_in_flight_is_flown_and_replayed(tmp_path):
    scene = Scene(tmp_path, FAR_AWAY)
    scene.run(3.0)
    other = [[-400.0, 0.0, -200.0], [100.0, 50.0, -200.0], [900.0, 0.0, -200.0]]
    line = telemetry(scene.clock.now(), (-361.0, 0.0, -200.0), (SPEED, 0.0, 0.0), mission=other, index=2)

    def wire(packets):
        own, radar = packets
        return [(own[0], own[1], line, own[3]), radar]

    changed = scene.run(1.0, wire=wire)
    assert [s.mission_index for s in changed] == [2] * 10
    steps = read_steps(scene)
    assert sum(step.mission is not None for step in steps) == 1
    assert next(step.mission for step in steps if step.mission is not None).waypoints.tolist() == other


BYTES = 1_000_000


def test_random_bytes_on_every_link_do_nothing_but_count(tmp_path):
    more = [
        *scenario().resolved()["inputs"],
        {"kind": "beast", "connect": "127.0.0.1:1", "silent_after_s": 3600.0},
        {"kind": "sbs", "connect": "127.0.0.1:1", "silent_after_s": 3600.0},
        {"kind": "avr", "connect": "127.0.0.1:1", "silent_after_s": 3600.0},
    ]
    scene = Scene(tmp_path, inputs=more)
    links = 5
    sizes = iter(np.full(BYTES // 500 // links, 500))

    def wire(packets):
        for size in (next(sizes, None), next(sizes, None)):
            if size is None:
                break
            for queue in (scene.steps.queue, *scene.steps.queues.values()):
                queue.put(scene.clock.now(), scene.rng.bytes(size))
        # What follows garbage without an end of its own is lost with it: a new line ends it.
        scene.steps.queue.put(scene.clock.now(), b"\n")
        return packets

    scene.run(2.0)
    garbled = scene.run(20.0, wire=wire)
    assert next(sizes, None) is None
    conflict = [s for s in garbled[10:] if s is not None]
    assert min(max((t.level for t in s.threats), default=0) for s in conflict) >= AlertLevel.CORRECTIVE
    summary = scene.finish()
    assert summary["live"]["autopilot"]["garbage"] > 300
    assert summary["live"]["inputs"]["radar"]["not our packet"] == BYTES // 500 // links


def test_nothing_is_commanded_without_permission(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    advised = Scene(tmp_path / "a")
    advised.run(8.0)
    assert any(s is not None and s.maneuver is not None for s in advised.snapshots) and advised.sent == []
    autopilot = {**scenario().resolved()["autopilot"], "command": True}
    commanded = Scene(tmp_path / "b", autopilot=autopilot)
    commanded.run(8.0)
    assert any(b"fly" in data for data in commanded.sent)
    summary = commanded.finish()
    assert summary["live"]["command_ms"]["count"] > 0


def test_a_full_disk_stops_the_recording_and_not_the_flight(tmp_path, monkeypatch):
    scene = Scene(tmp_path)
    scene.run(3.0)

    def full(*_):
        raise InputError("cannot write the recording: No space left on device")

    monkeypatch.setattr(Recorder, "write", full)
    after = scene.run(5.0)
    assert all(s is not None for s in after) and scene.steps.status(0)["loop"]["recording"] is None
    assert any("nothing is recorded any more" in event for event in scene.events)
