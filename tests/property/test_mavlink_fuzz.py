"""The link to an autopilot under loss, repetition, delay and reordering, and under nonsense."""

import math
import random

import numpy as np
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from tests.mavlink_loop import FRAME, KINDS, PLANE, T0, Loop, sidestep
from wideberth.links.mavlink.autopilot import Autopilot
from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import same_mission
from wideberth.links.mavlink.wire import Wire

UNDERSTOOD = (
    "ADSB", "ALT", "ATTI", "COMMAND_ACK", "EKF", "EST", "GLOBAL", "GPS", "HEART", "HOME", "LOCAL", "MISSION", "OPEN",
    "PARAM_VALUE", "SYSTEM_T", "TERR", "TIMESYNC", "VFR",
)  # fmt: skip

NO_SHRINKING = (Phase.explicit, Phase.reuse, Phase.generate)  # each flight takes a second

channels = st.fixed_dictionaries(
    {
        "loss": st.floats(0.0, 0.3),
        "repeats": st.floats(0.0, 0.3),
        "delay": st.floats(0.0, 0.3),
        "jitter": st.floats(0.0, 0.3),
    }
)


@settings(max_examples=8, phases=NO_SHRINKING)
@given(
    seed=st.integers(0, 2**32),
    kind=st.sampled_from(KINDS),
    method=st.sampled_from(["guided", "mission"]),
    channel=channels,
)
def test_a_bad_channel_costs_time_but_neither_mission_nor_mode(seed, kind, method, channel) -> None:
    loop = Loop(kind, {"method": method}, seed=seed, **channel)
    before = list(loop.vehicle.mission.items)
    assert loop.run(60.0, lambda x: x.link.mission() is not None and x.link.state == "monitoring"), loop.events
    loop.run(3.0)
    loop.wanted = sidestep(loop.t, loop.seen())
    loop.run(25.0)
    loop.wanted = None
    assert loop.run(90.0, lambda x: x.link.state == "monitoring" and not x.link._mission.is_altered), loop.events
    loop.run(3.0)
    assert same_mission(loop.vehicle.mission.items, before, home_is_item_0=kind.home_is_item_0), loop.events
    assert loop.vehicle.mode == kind.mission_mode
    assert not any("somebody else" in e or "another ground station" in e for e in loop.events), loop.events
    own = loop.seen()
    assert loop.t - own.t < 3.0
    # The link's frame may be about another origin: the first position, where home came late.
    assert loop.link.frame is not None
    place = FRAME.to_ned(*loop.link.frame.to_geodetic(own.position))
    assert np.linalg.norm(place - loop.position) < (loop.t - own.t + 0.5) * 1.6 * loop.speed


@settings(max_examples=8, phases=NO_SHRINKING)
@given(seed=st.integers(0, 2**32), kind=st.sampled_from(KINDS), channel=channels, when=st.floats(0.0, 12.0))
def test_the_pilot_wins_over_a_bad_channel(seed, kind, channel, when) -> None:
    loop = Loop(kind, seed=seed, **channel)
    assert loop.run(60.0, lambda x: x.link.mission() is not None and x.link.state == "monitoring"), loop.events
    loop.wanted = sidestep(loop.t, loop.seen())
    loop.run(when)
    loop.vehicle.set_mode(kind.loiter_mode)
    loop.run(6.0)  # his switch is seen within a few heartbeats
    changes = len(loop.vehicle.mode_changes)
    if loop.vehicle.mode != kind.loiter_mode:
        # A command already on its way came after his switch; he switches again.
        loop.vehicle.set_mode(kind.loiter_mode)
        loop.run(6.0)
        changes = len(loop.vehicle.mode_changes)
    loop.run(15.0)
    assert loop.vehicle.mode == kind.loiter_mode, loop.vehicle.mode_changes
    assert len(loop.vehicle.mode_changes) == changes
    assert loop.link.state in ("pilot", "no link")


def test_a_million_random_bytes_leave_the_link_working() -> None:
    loop = Loop(PLANE)
    loop.run(5.0)
    noise = random.Random(1)
    for _ in range(1000):
        loop.link.receive(noise.randbytes(1000), loop.t)
    loop.run(5.0)
    assert loop.link.state == "monitoring"
    assert loop.t - loop.seen().t < 0.3
    assert loop.link.counters["bytes"] > 1_000_000
    assert loop.link.counters["not a frame"] > 1000


def _value(draw: random.Random, kind: str):
    if kind in ("float", "double"):
        return draw.choice([0.0, math.nan, math.inf, -math.inf, 1e30, -1.0, draw.uniform(-1e7, 1e7)])
    if kind == "char":
        return bytes([draw.randrange(256)])
    bits = int(kind.removeprefix("u").removeprefix("int").removesuffix("_t"))
    low, high = (0, 2**bits - 1) if kind[0] == "u" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return draw.choice([low, high, 0, 1, draw.randint(low, high), draw.randint(max(low, -5), 20)])


def _nonsense(draw: random.Random, message):
    values: list = []
    orders = message.ordered_fieldnames
    for name, kind in zip(message.fieldnames, message.fieldtypes, strict=True):
        size = message.array_lengths[orders.index(name)]
        kind = kind.removesuffix("_mavlink_version")
        if kind == "char" and size > 0:
            values.append(draw.randbytes(size))
        elif size > 0:
            values.append([_value(draw, kind) for _ in range(size)])
        else:
            values.append(_value(draw, kind))
    return message(*values)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32))
def test_frames_full_of_nonsense_raise_nothing(seed) -> None:
    """All messages of the dialect, with a right checksum and whatever in them, from the autopilot itself."""
    draw = random.Random(seed)
    link = Autopilot(MavlinkConfig(command=True), FRAME if seed % 2 else None)
    sender = Wire(1, 1)
    t = T0
    sender.send(mavlink.MAVLink_heartbeat_message(2, draw.choice([3, 12, 0]), 209, 3, 4, 3), t)
    kinds = list(mavlink.mavlink_map.values())
    known = [k for k in kinds if k.msgname.startswith(UNDERSTOOD)]
    for _ in range(150):
        try:
            sender.send(_nonsense(draw, draw.choice(known if draw.random() < 0.8 else kinds)), t)
        except (TypeError, ValueError):
            continue
        link.receive(sender.take(), t)
        t += draw.choice([0.01, 0.05, 1.0])
        own = link.ownship(t)
        if own is not None:
            assert np.all(np.isfinite(own.position)) and own.t <= t
        link.outgoing(t)
        link.mission()
        link.health(t)
        link.reports(t)
        link.events()
