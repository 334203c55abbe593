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
