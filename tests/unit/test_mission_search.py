"""Search of missions that run into recorded traffic."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.naive import mission_search as naive
from wideberth.cli.main import app
from wideberth.conflict.well_clear import PRESETS, violation
from wideberth.evaluation.mission_kernels import meetings
from wideberth.evaluation.mission_search import (
    FoundMission,
    SampledTraffic,
    SearchSettings,
    heard_times,
    search_missions,
)
from wideberth.evaluation.mission_set import write_mission_file
from wideberth.frames import LocalFrame
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.simulation.mission import read_mission_file
from wideberth.simulation.recorded import RecordedTraffic
from wideberth.units import FOOT, KNOT

T0 = 1_700_000_000.0
FRAME = LocalFrame(math.radians(48.0), math.radians(2.0))
SETTINGS = SearchSettings(min_aircraft=2, min_losses=2, duration_min=120.0, duration_max=240.0, max_tries=6000)


def straight(address: str, start: list[float], velocity: list[float], t: np.ndarray) -> list[AdsbReport]:
    """Reports, one at each time after T0, of an aircraft in straight flight (north, east, up)."""
    p, v = np.array(start), np.array(velocity)
    reports = []
    for at in t:
        n, e, up = p + v * at
        lat, lon, _ = FRAME.to_geodetic(np.array([n, e, -up]))
        reports.append(
            AdsbReport(
                T0 + float(at),
                address,
                float(lat),
                float(lon),
                pressure_altitude=float(up),
                velocity_north=float(v[0]),
                velocity_east=float(v[1]),
                climb_rate=float(v[2]),
            )
        )
    return reports


def busy_sky(seed: int = 1) -> list[AdsbReport]:
    rng = np.random.default_rng(seed)
    reports = []
    for k in range(12):
        course = rng.uniform(0, 2 * math.pi)
        velocity = 60.0 * np.array([math.cos(course), math.sin(course), 0.0])
        middle = np.array([*rng.normal(size=2) * 2500.0, rng.uniform(650.0, 850.0)])
        reports += straight(f"a0000{k:x}", list(middle - velocity * 300.0), list(velocity), np.arange(0.0, 601.0, 1.0))
    return sorted(reports, key=lambda r: r.t)


@pytest.fixture(scope="module")
def reports() -> list[AdsbReport]:
    return busy_sky()


@pytest.fixture(scope="module")
def traffic(reports: list[AdsbReport]) -> SampledTraffic:
    return SampledTraffic(reports, SETTINGS)


@pytest.fixture(scope="module")
def found(traffic: SampledTraffic) -> list[FoundMission]:
    return search_missions(traffic, SETTINGS, 4, 3, outside=2).missions


def test_kernel_agrees_with_its_twin() -> None:
    rng = np.random.default_rng(4)
    m, k = 60, 9
    t = np.arange(m)[:, None, None]
    p, v = rng.normal(size=(1, k, 3)) * [2500, 2500, 200] + [0, 0, -900], rng.normal(size=(1, k, 3)) * [60, 60, 4]
    states = np.concatenate([p + v * (t - 30), np.broadcast_to(v, (m, k, 3))], axis=2)
    states[20:40, 2] = np.nan
    volumes = [(PRESETS["sarp"], False), (PRESETS["sarp"], True), (PRESETS["do365_buffered"], False)]
    array = np.array([[w.dthr, w.zthr, w.tthr, w.tcoa] for w, _ in volumes])
    start, velocity = np.array([-1200.0, 0.0, -900.0]), np.array([41.0, 0.0, 0.0])
    t_cross, t_loss = np.empty(k), np.empty((k, 3))
    filtered = np.array([f for _, f in volumes])
    inside = meetings(
        states, 0, m, 1.0, start, velocity, array, filtered, 3704.0, 300.0, 1000.0, t_cross, t_loss
    )  # fmt: skip
    expected = naive.meetings(states, 1.0, start, velocity, volumes, 3704.0, 300.0, 1000.0)
    np.testing.assert_array_equal(t_cross, expected[0])
    np.testing.assert_array_equal(t_loss, expected[1])
    assert inside == expected[2]
    assert 1 < np.isfinite(t_loss[:, 0]).sum() < k
    assert np.isfinite(t_loss[:, 1]).sum() <= np.isfinite(t_loss[:, 0]).sum()


@pytest.mark.compiled
def test_missions_do_what_they_promise(reports: list[AdsbReport], found: list[FoundMission]) -> None:
    assert sum(m.passes for m in found) == 4
    for mission in found:
        frame = LocalFrame(float(mission.waypoints[0, 0]), float(mission.waypoints[0, 1]))
        traffic = RecordedTraffic(reports, frame, SETTINGS.max_gap)
        ends = frame.to_ned(*mission.waypoints.T)
        velocity = (ends[1] - ends[0]) / mission.duration
        assert float(np.linalg.norm(velocity)) == pytest.approx(mission.speed, rel=1e-4)
        losses: dict[bool, dict[str, float]] = {False: {}, True: {}}
        crossed = set()
        for t in np.arange(0.0, mission.duration + 0.5):
            truth = traffic.truth(mission.t_start + t)
            own = ends[0] + velocity * t
            for i, address in enumerate(truth.ids):
                s = truth.positions[i] - own
                if math.hypot(s[0], s[1]) <= SETTINGS.cross_radius and abs(s[2]) <= SETTINGS.cross_height:
                    crossed.add(address)
                for narrow, own_losses in losses.items():
                    if violation(
                        PRESETS["sarp"], own, velocity, truth.positions[i], truth.velocities[i], miss_filter=narrow
                    ):
                        own_losses.setdefault(address, float(t))
        assert len(crossed) >= SETTINGS.min_aircraft
        assert len(losses[True]) >= SETTINGS.min_losses
        for address, t_loss in mission.losses("sarp").items():
            assert losses[False][address] == pytest.approx(t_loss, abs=1.0)
        assert mission.quiet == (min(losses[False].values()) >= 60.0)
        assert SETTINGS.altitude_min - 1 <= mission.waypoints[0, 2] <= SETTINGS.altitude_max + 1
        assert SETTINGS.duration_min <= mission.duration <= SETTINGS.duration_max


@pytest.mark.compiled
def test_same_seed_same_missions_and_another_seed_others(traffic: SampledTraffic, found: list[FoundMission]) -> None:
    again = search_missions(traffic, SETTINGS, 4, 3, outside=2).missions
    assert [m.t_start for m in again] == [m.t_start for m in found]
    for a, b in zip(again, found, strict=True):
        np.testing.assert_array_equal(a.waypoints, b.waypoints)
        assert a.meetings == b.meetings or a.losses("sarp") == b.losses("sarp")
    other = search_missions(traffic, SETTINGS, 4, 4).missions
    assert [m.t_start for m in other] != [m.t_start for m in found[: len(other)]]


@pytest.mark.compiled
def test_missions_differ_from_each_other(found: list[FoundMission]) -> None:
    for i, a in enumerate(found):
        for b in found[:i]:
            times = {k: b.t_start + t for k, t in b.losses("sarp").items()}
            own = {k: a.t_start + t for k, t in a.losses("sarp").items()}
            shared = sum(k in times and abs(t - times[k]) <= 60 for k, t in own.items())
            assert shared <= 0.5 * min(len(own), len(times))


def test_search_ends_and_says_why() -> None:
    lonely = straight("a00001", [0.0, 0.0, 700.0], [60.0, 0.0, 0.0], np.arange(0.0, 600.0))
    settings = replace(SETTINGS, max_tries=200)
    result = search_missions(SampledTraffic(lonely, settings), settings, 1, 0)
    assert result.missions == []
    assert result.tries == 200
    assert sum(result.rejected.values()) == 200
    assert result.rejected["too few aircraft crossed"] > 0


def frozen(reports: list[AdsbReport], address: str, t_from: float, t_to: float) -> list[AdsbReport]:
    """Repeat the last position before `t_from` until `t_to`, as receivers do that have lost an aircraft."""
    last: AdsbReport | None = None
    out = []
    for r in reports:
        if r.address == address:
            if t_from < r.t < t_to and last is not None:
                r = replace(r, latitude=last.latitude, longitude=last.longitude)
            else:
                last = r
        out.append(r)
    return out


def test_frozen_positions_are_not_heard(reports: list[AdsbReport]) -> None:
    times = heard_times(frozen(reports, "a00000", T0 + 100, T0 + 140))["a00000"]
    assert not ((times > T0 + 101) & (times < T0 + 140)).any()
    assert len(times) == pytest.approx(601 - 39, abs=2)


def test_aircraft_frozen_before_its_loss_fails_the_filter(reports: list[AdsbReport], traffic: SampledTraffic) -> None:
    first = search_missions(traffic, SETTINGS, 1, 3)
    mission = first.missions[0]
    address, t_loss = next(iter(mission.losses("sarp").items()))
    t = mission.t_start + t_loss
    # Stale at the time by which it must have been seen, back shortly before the loss.
    changed = SampledTraffic(frozen(reports, address, t - 34, t - 22), SETTINGS)
    again = search_missions(changed, replace(SETTINGS, max_tries=first.tries), 1, 3, outside=first.tries)
    same = next(m for m in again.missions if m.t_start == mission.t_start and address in m.losses("sarp"))
    assert mission.passes
    assert not same.passes
    assert [m.address for m in same.meetings if not m.seen] == [address]


@pytest.mark.compiled
def test_late_appearance_fails_the_filter() -> None:
    # Nothing is heard of any aircraft until 20 s before it gets near the middle.
    t = np.arange(280.0, 601.0)
    late = []
    for k, course in enumerate((0.0, 1.5, 3.0, 4.5)):
        velocity = 60.0 * np.array([math.cos(course), math.sin(course), 0.0])
        late += straight(f"b0000{k}", list(np.array([0.0, 50.0 * k, 700.0]) - velocity * 300.0), list(velocity), t)
    early = straight("c00000", [-30_000.0, 0.0, 700.0], [100.0, 0.0, 0.0], np.arange(0.0, 601.0))
    settings = replace(SETTINGS, max_tries=800)
    result = search_missions(SampledTraffic(early + late, settings), settings, 3, 1, outside=3)
    assert result.missions
    for mission in result.missions:
        for meeting in mission.meetings:
            if meeting.address.startswith("b") and "sarp" in meeting.losses:
                heard_for = min(mission.t_start + meeting.losses["sarp"] - (T0 + 280), meeting.losses["sarp"])
                assert meeting.seen == (heard_for >= settings.seen_time)


@pytest.mark.compiled
def test_mission_file_is_read_back(tmp_path: Path, found: list[FoundMission]) -> None:
    path = tmp_path / "m.csv"
    write_mission_file(path, found[0])
    mission, messages = read_mission_file(path)
    assert messages == ()
    assert mission.start_time_s == found[0].t_start
    assert mission.waypoints[1].lat_deg == pytest.approx(math.degrees(found[0].waypoints[1, 0]), abs=1e-7)
    assert mission.waypoints[1].speed_mps == pytest.approx(80 * KNOT, abs=1e-4)


@pytest.mark.parametrize(
    "bad",
    [{"volume": "dome"}, {"speed": 0.0}, {"altitude_min": math.nan}, {"duration_min": 900.0}, {"altitude_min": 2000.0}],
)
def test_bad_settings_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError):
        replace(SETTINGS, **bad)  # type: ignore[arg-type]


def test_sky_without_low_aircraft_is_refused() -> None:
    high = straight("a00001", [0.0, 0.0, 9000.0], [200.0, 0.0, 0.0], np.arange(0.0, 60.0))
    with pytest.raises(ValueError, match="no aircraft between"):
        SampledTraffic(high, SETTINGS)
    with pytest.raises(ValueError, match="no aircraft in the air"):
        SampledTraffic([], SETTINGS)


def test_aircraft_on_the_other_side_of_the_earth_do_not_appear_here(reports: list[AdsbReport]) -> None:
    antipodes = [
        replace(r, address="d00000", latitude=-r.latitude, longitude=r.longitude - math.pi)
        for r in reports
        if r.address == "a00000"
    ]
    assert "d00000" not in SampledTraffic(reports + antipodes, SETTINGS).ids


def trajectory_file(path: Path, reports: list[AdsbReport]) -> Path:
    rows = [
        {
            "timestamp": round(r.t * 1000),
            "icao24": r.address,
            "latitude": math.degrees(r.latitude),
            "longitude": math.degrees(r.longitude),
            "altitude": r.pressure_altitude / FOOT,
            "groundspeed": math.hypot(r.velocity_north, r.velocity_east) / KNOT,
            "track": math.degrees(math.atan2(r.velocity_east, r.velocity_north)) % 360.0,
            "vertical_rate": 0.0,
            "onground": False,
        }
        for r in reports
    ]
    path.write_text(json.dumps(rows))
    return path


@pytest.mark.compiled
def test_command_writes_missions_and_index(tmp_path: Path, reports: list[AdsbReport]) -> None:
    source = trajectory_file(tmp_path / "sky.json", reports)
    options = [
        "--count",
        "2",
        "--seed",
        "9",
        "--min-aircraft",
        "2",
        "--min-losses",
        "2",
        "--duration-min-s",
        "120",
        "--duration-max-s",
        "240",
    ]
    outcome = CliRunner().invoke(app, ["missions", str(source), "--out", str(tmp_path / "out"), *options])
    assert outcome.exit_code == 0, outcome.output
    index = json.loads((tmp_path / "out" / "missions.json").read_text())
    assert len(index["missions"]) == 2
    for entry in index["missions"]:
        assert entry["filter"]["passed"]
        assert entry["losses"]["sarp_miss_filter"] >= 2
        assert entry["aircraft_crossed"] >= 2
        mission, _ = read_mission_file(tmp_path / "out" / entry["file"])
        assert mission.start_time_s == entry["start_time_s"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["absent.json"], "absent.json"),
        (["beast://localhost:9"], "live"),
        (["{sky}", "--volume", "dome"], "volume is 'dome'"),
        (["{sky}", "--speed-mps", "nan"], "speed"),
        (["{sky}", "--altitude-min-m", "9000", "--altitude-max-m", "9500"], "no aircraft between"),
    ],
)
def test_command_refuses_in_one_line(
    tmp_path: Path, reports: list[AdsbReport], arguments: list[str], message: str
) -> None:
    sky = trajectory_file(tmp_path / "sky.json", reports[:300])
    arguments = [a.replace("{sky}", str(sky)) for a in arguments]
    outcome = CliRunner().invoke(app, ["missions", *arguments, "--out", str(tmp_path / "out")])
    assert outcome.exit_code == 2
    assert message in outcome.output
    assert "Traceback" not in outcome.output


def test_command_says_when_there_is_nothing(tmp_path: Path, reports: list[AdsbReport]) -> None:
    sky = trajectory_file(tmp_path / "sky.json", [r for r in reports if r.address == "a00000"])
    outcome = CliRunner().invoke(
        app, ["missions", str(sky), "--out", str(tmp_path / "out"), "--max-tries", "50", "--count", "1"]
    )
    assert outcome.exit_code == 1
    assert "only 0 of 1" in outcome.output
