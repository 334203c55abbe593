"""A thousand close passes of an intruder and the ownship before a ground radar: who is taken as the ownship.

Filters err as they say they do, and slowly, as in `tests.made_passes`; rates are stated with 99 % confidence.
"""

import math
import os
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binomtest

from tests.made_passes import KINDS, P_D, SIGMA, Passes, PrintedRule, fly, make_passes
from wideberth.tracking.config import OwnshipConfig
from wideberth.tracking.ownship import ownship_test, telemetry_covariance

WITHOUT_COMPILER = os.environ.get("NUMBA_DISABLE_JIT") == "1"
COUNT = len(KINDS) * (1 if WITHOUT_COMPILER else 150)
THROUGHOUT, FOR_A_WHILE = KINDS.index("formation throughout"), KINDS.index("formation for a while")
TABLE_4_5 = PrintedRule(2.5 * SIGMA, np.array([20.0, 20.0, 20.0, 10.0, 10.0, 10.0]), 50, 0.2)
MANEUVER = np.full(3, 0.5)  # m2/s3: the formations begin and end with a change of velocity


class Flown(NamedTuple):
    passes: Passes
    flagged: NDArray[np.int64]
    rule: NDArray[np.int64]
    nees: NDArray[np.float64]


def fly_all(passes: Passes, nearest: bool) -> Flown:
    config = OwnshipConfig()
    test, covariance = ownship_test(config), telemetry_covariance(config)
    done = [
        fly(
            passes.truth[i],
            passes.telemetry[i],
            covariance,
            passes.noise[i],
            passes.detected[i],
            passes.first[i],
            MANEUVER,
            SIGMA,
            nearest,
            test,
            TABLE_4_5,
        )
        for i in range(len(passes.kind))
    ]
    return Flown(passes, *(np.array([d[k] for d in done]) for k in range(3)))


@pytest.fixture(scope="module")
def flown() -> Flown:
    return fly_all(make_passes(COUNT, 1), nearest=False)


def test_the_filters_err_as_they_say(flown: Flown) -> None:
    straight = flown.passes.kind != FOR_A_WHILE
    for aircraft in range(2):
        # Noise for maneuvers that do not come: below 6, but not far below.
        assert 2.0 < np.nanmean(flown.nees[straight, 50:, aircraft]) < 6.5


def test_no_intruder_is_ever_taken_as_the_ownship(flown: Flown) -> None:
    taken = (flown.flagged == 1).any(axis=1)
    assert taken.sum() == 0, (flown.passes.kind[taken], flown.passes.miss[taken])


@pytest.mark.skipif(WITHOUT_COMPILER, reason="too few passes for a rate")
def test_the_ownship_is_found_within_seconds_and_kept(flown: Flown) -> None:
    # In formation from the start, neither track may be told from the other at first; everybody else flies apart.
    flagged = flown.flagged[flown.passes.kind != THROUGHOUT]
    n = len(flagged)
    seen = np.array([row[np.argmax(row != -2) :] for row in flagged], dtype=object)
    within = {s: sum(bool((row[: 10 * s] == 0).any()) for row in seen) for s in (2, 5)}
    assert binomtest(within[2], n).proportion_ci(0.99).low > 0.93
    assert binomtest(within[5], n).proportion_ci(0.99).low > 0.98
    kept = np.array([(row[30:] == 0).mean() for row in seen])
    assert kept.mean() >= 0.99
    # From the moment it is found.
    after = np.array([(row[np.argmax(row == 0) :] == 0).mean() for row in seen if (row == 0).any()])
    assert after.mean() >= 0.998


@pytest.mark.skipif(WITHOUT_COMPILER, reason="too few passes for a rate")
def test_the_printed_rule_takes_intruders_as_the_ownship(flown: Flown) -> None:
    """Why it is not the default: with the gates of table 4.5, and blind to its own track with those of (3.10)."""
    by_plot, by_state = ((flown.rule & bit != 0).any(axis=1).mean() for bit in (2, 8))
    assert by_state > 0.15
    assert by_plot > 0.01
    assert (flown.rule[:, 50:] & 1 != 0).mean() < 0.75


def test_without_a_track_of_the_ownship_a_crossing_intruder_is_still_an_intruder() -> None:
    """The ownship hides from the radar: only who flies along with it cannot be told from it."""
    passes = make_passes(COUNT, 2)
    passes.detected[:, :, 0] = False
    taken = (fly_all(passes, nearest=False).flagged == 1).any(axis=1)
    apart = ~np.isin(passes.kind, [THROUGHOUT, FOR_A_WHILE])
    assert binomtest(int(taken[apart].sum()), int(apart.sum())).proportion_ci(0.99).low < 1e-3
    assert taken[apart].sum() <= 2
    assert (passes.miss[taken] < 15.0).all()


def test_plots_that_go_to_the_nearest_track() -> None:
    """Tracks of aircraft that fly together swap them: until they part, telemetry explains either."""
    passes = make_passes(COUNT, 3)
    flown = fly_all(passes, nearest=True)
    taken = (flown.flagged == 1).any(axis=1)
    assert not taken[~np.isin(passes.kind, [THROUGHOUT, FOR_A_WHILE])].any()
    # A swap cannot be seen while they fly a few metres apart.
    assert (passes.miss[taken] < 25.0).all()
    assert taken.mean() < 0.02


def test_the_passes_are_what_they_say() -> None:
    passes = make_passes(len(KINDS) * 3, 4)
    apart = np.linalg.norm(passes.truth[:, :, 0, :3] - passes.truth[:, :, 1, :3], axis=-1)
    assert np.allclose(apart.min(axis=1), passes.miss, rtol=0.02, atol=1.0)
    own = passes.truth[:, :, 0]
    assert np.allclose(np.diff(own[:, :, :3], axis=1) / 0.1, own[:, 1:, 3:], atol=1e-9)
    assert math.isclose(passes.detected.mean(), P_D, abs_tol=0.02)
