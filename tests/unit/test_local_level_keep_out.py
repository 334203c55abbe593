"""The local-level planner and keep-out volumes."""

import numpy as np
import pytest

from tests.made_waypoint_runs import enters
from tests.unit.test_local_level import fly, head_on, maneuvers, planner
from wideberth.avoidance.keep_out.config import PolygonKeepOut


@pytest.mark.parametrize("name", ["flyable", "collision_38"])
def test_the_local_level_planner_keeps_out(name):
    """Where the maneuver would go is closed now: it goes elsewhere."""
    meeting = 40.0 if name == "flyable" else 13.0
    intruder = head_on(meeting)
    free, _ = fly(planner(map=name), [intruder], meeting + 20)
    aside = np.concatenate([maneuver.waypoints[:, 1] for _, maneuver in maneuvers(free)])
    farthest = aside[np.abs(aside).argmax()]
    assert abs(farthest) > 160.0
    near, far = 150.0 * np.sign(farthest), 9e3 * np.sign(farthest)
    fence = PolygonKeepOut(vertices_m=((-1e3, near), (2e4, near), (2e4, far), (-1e3, far)))
    steps, _ = fly(planner(map=name, keep_out=[fence], keep_out_margin_m=50.0), [intruder], meeting + 20)
    assert maneuvers(steps)
    for _, maneuver in maneuvers(steps):
        assert not enters(maneuver.waypoints, [fence])
    places = np.array([step.ownship.position for step in steps])
    assert not enters(places, [fence])


def test_the_local_level_planner_leaves_a_keep_out_it_is_in():
    fence = PolygonKeepOut(vertices_m=((-500.0, -500.0), (900.0, -500.0), (900.0, 500.0), (-500.0, 500.0)))
    steps, _ = fly(planner(keep_out=[fence]), [head_on(40.0)], 50)
    assert maneuvers(steps)
    assert not enters(np.array([steps[-1].ownship.position] * 2), [fence])
