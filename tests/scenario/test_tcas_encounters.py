"""Drones that meet an aircraft with TCAS: never on the same side, and no more alerts than by flying straight on."""

import numpy as np

from wideberth.avoidance.cas.complement import ComplementaryManeuver
from wideberth.conflict.tcas import TCAS_I
from wideberth.simulation.tcas_encounter import draw_tcas_encounter, fly_tcas_encounter
from wideberth.units import FOOT

ENCOUNTERS = 150
LINK_DELAY = 1.0


def test_the_maneuver_complements_and_does_not_annoy() -> None:
    rng = np.random.default_rng(20261129)
    alerts = np.zeros((2, 2), int)
    losses = np.zeros(2, int)
    for _ in range(ENCOUNTERS):
        own, intruder, duration, altitude = draw_tcas_encounter(rng)
        for k, maneuver in enumerate((None, ComplementaryManeuver())):
            flown = fly_tcas_encounter(own, intruder, duration, maneuver, altitude=altitude, link_delay=LINK_DELAY)
            alerts[k] += flown.traffic_advisories, flown.resolution_advisories
            losses[k] += flown.lost(500 * FOOT, 100 * FOOT)
            # From a second after the message on (decisions come once a second) the two are on different sides.
            same = flown.sides * flown.senses > 0
            known = np.convolve(flown.senses != 0, np.ones(9), "valid")[: len(same) - 8] == 9
            assert not np.any(same[8:] & known & (np.diff(flown.senses, prepend=0.0)[8:] == 0.0))
    print(f"traffic and resolution advisories: straight {alerts[0]}, avoiding {alerts[1]}")
    # Paired encounters: not one more in the sum, so that 5 % more is out of the question.
    assert alerts[0, 1] >= 20
    assert np.all(alerts[1] <= alerts[0])
    assert losses[1] == 0


def test_two_that_climb_alike_are_parted_by_the_advisory() -> None:
    # Level head-on, where the drone has begun to climb before it hears of the climb advisory.
    own = np.array([0.0, 0.0, -30.0, 40.0, 0.0, -2.0])
    intruder = np.array([4000.0, 0.0, 0.0, -110.0, 0.0, 0.0])
    slow = ComplementaryManeuver(radius=300.0, half_height=150.0, lookahead=20.0)
    flown = fly_tcas_encounter(own, intruder, 60.0, slow, altitude=1500.0)
    assert flown.resolution_advisories == 1
    assert set(flown.sides[flown.senses < 0]) <= {0.0, 1.0}
    assert not flown.lost(500 * FOOT, 100 * FOOT)


def test_an_aircraft_with_tcas_one_only_gets_traffic_advisories_and_fewer_when_avoided() -> None:
    rng, alerts = np.random.default_rng(5), np.zeros((2, 2), int)
    for _ in range(60):
        own, intruder, duration, altitude = draw_tcas_encounter(rng)
        for k, maneuver in enumerate((None, ComplementaryManeuver())):
            flown = fly_tcas_encounter(own, intruder, duration, maneuver, altitude=altitude, bands=TCAS_I)
            alerts[k] += flown.traffic_advisories, flown.resolution_advisories
            assert not flown.senses.any()
    print(f"traffic advisories of TCAS I: straight {alerts[0, 0]}, avoiding {alerts[1, 0]}")
    assert alerts[0, 0] >= 20 and alerts[1, 0] <= alerts[0, 0]
    assert not alerts[:, 1].any()


def test_turns_of_tcas_three_part_wider_those_that_climbing_alone_hardly_parts() -> None:
    rng, nearest = np.random.default_rng(7), []
    for _ in range(60):
        # Level and soon across the drone, which flies on: few seconds are left to climb or sink.
        seconds, height, course = rng.uniform(12.0, 20.0), rng.uniform(-30.0, 30.0), rng.uniform(0.5, 1.5) * np.pi
        velocity = 150.0 * np.array([np.cos(course), np.sin(course), 0.0])
        own = np.array([0.0, 0.0, 0.0, 40.0, 0.0, 0.0])
        intruder = np.concatenate([(own[3:] - velocity) * seconds + [0.0, 0.0, height], velocity])
        two, three = (
            fly_tcas_encounter(own, intruder, 60.0, None, altitude=1500.0, turns=turns) for turns in (False, True)
        )
        assert two.resolution_advisories >= 1 and two.turn_advisories == 0 and np.ptp(two.courses) < 1e-9
        # Up to 90 degrees a turn, at 3 degrees a second.
        turned = np.unwrap(three.courses)
        assert np.abs(np.diff(turned)).max() <= np.radians(3.0) * 0.25 + 1e-9
        assert np.ptp(turned) <= three.turn_advisories * np.pi / 2 + 1e-9
        if three.turn_advisories:
            nearest.append([np.hypot(flown.horizontal, flown.vertical).min() for flown in (two, three)])
    by_two, by_three = np.array(nearest).T
    print(f"{len(nearest)} turned; nearest, median: TCAS II {np.median(by_two):.0f} m, III {np.median(by_three):.0f} m")
    assert len(nearest) >= 20
    assert np.all(by_three > by_two - 1.0)
    assert np.median(by_three) > 2.0 * np.median(by_two)
    # A pilot who does not follow does not turn either.
    ignored = fly_tcas_encounter(own, intruder, 60.0, None, altitude=1500.0, turns=True, follows=False)
    assert np.ptp(ignored.courses) < 1e-9
