"""Why well clear was lost: one made flight for each cause."""

import numpy as np
import pytest

from experiments.loss_causes import Flight, FlightLog

TIMES = np.arange(0.0, 91.0)
LOSS = 90.0


def flight(heading=180.0, climb=0.0, first_seen=0, updates=None, others=(), least_bad=False):
    """An aircraft, flown by course (deg) and climb rate (m/s) of each second, that is lost sight of never."""
    speed = 40.0
    course = np.radians(np.broadcast_to(heading, TIMES.shape))
    velocity = np.stack([speed * np.cos(course), speed * np.sin(course), -np.broadcast_to(climb, TIMES.shape)], axis=1)
    track = np.cumsum(velocity, axis=0)
    states = np.hstack([track - track[-1] + [100.0, 0.0, -500.0], velocity])
    own = np.tile([0.0, 0.0, -500.0, 0.0, 0.0, 0.0], (len(TIMES), 1))
    log = FlightLog()
    for k, t in enumerate(TIMES):
        log.times.append(float(t))
        log.own.append(own[k])
        known = {} if k < first_seen else {"a": float(t if updates is None else updates(t))}
        log.updates.append(known)
        log.alerted.append(frozenset(known))
        log.avoided.append(frozenset(known))
        log.least_bad.append(least_bad and k > 80)
    crowd = [np.tile([*place, 0.0, 0.0, 0.0], (len(TIMES), 1)) for place in others]
    names = ("a", *(f"other{k}" for k in range(len(others))))
    return Flight(log, names, TIMES, own, np.stack([states, *crowd], axis=1))


def ramp(change, start, seconds):
    """A value that goes from 0 to `change` in some seconds from `start`."""
    return change * np.clip((TIMES - start) / seconds, 0.0, 1.0)


@pytest.mark.parametrize(
    ("made", "cause"),
    [
        ({}, "none of the known causes"),
        ({"first_seen": 1000}, "never seen before the loss"),
        ({"first_seen": 80}, "first seen only 10 s before"),
        ({"updates": lambda t: min(t, 75.0)}, "its last position was up to 15 s old"),
        ({"heading": 180.0 + ramp(80.0, 65.0, 20.0)}, "it turned 80 deg in the 60 s before"),
        ({"climb": ramp(5.0, 65.0, 10.0)}, "its climb rate changed by 980 ft/min in the 60 s before"),
        ({"others": ([2000.0, 0.0, -500.0], [9000.0, 0.0, -500.0])}, "1 more aircraft within 3 nmi"),
        ({"least_bad": True}, "every path was blocked for a time"),
    ],
)
def test_each_cause_is_named_and_no_other(made, cause):
    causes = flight(**made).diagnose("a", LOSS)["causes"]
    assert len(causes) == 1 and causes[0].startswith(cause)


def test_a_turn_that_hardly_leads_away_is_no_cause():
    wiggle = 180.0 + ramp(40.0, 86.0, 3.0)
    assert flight(heading=wiggle).diagnose("a", LOSS)["causes"] == ["none of the known causes"]


def test_causes_come_together_the_likeliest_first():
    facts = flight(heading=180.0 + ramp(80.0, 65.0, 20.0), first_seen=80, least_bad=True).diagnose("a", LOSS)
    assert [cause.split()[0] for cause in facts["causes"]] == ["first", "it", "every"]
    assert facts["seen_s_before"] == facts["alerted_s_before"] == facts["avoided_s_before"] == 10.0
    assert facts["oldest_position_s"] == 0.0
