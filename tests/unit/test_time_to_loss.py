import numpy as np
import pytest

from wideberth.analysis.time_to_loss import SCENARIOS, time_to_distance, times_to_loss
from wideberth.units import FOOT, KNOT, NAUTICAL_MILE


def test_time_is_the_way_over_the_closing_speed():
    assert time_to_distance(10_000.0, 1000.0, 90.0) == pytest.approx(100.0)


def test_arguments_broadcast():
    times = time_to_distance(10_000.0, [[1000.0], [4000.0]], [100.0, 50.0, 25.0])
    np.testing.assert_allclose(times, [[90.0, 180.0, 360.0], [60.0, 120.0, 240.0]])


def test_aircraft_that_do_not_close_never_lose_separation():
    np.testing.assert_array_equal(time_to_distance(10_000.0, 1000.0, [0.0, -5.0, 1.0]), [np.inf, np.inf, 9000.0])


@pytest.mark.parametrize(
    "arguments",
    [
        (np.nan, 1000.0, 1.0),
        (np.inf, 1000.0, 1.0),
        (-1.0, 1000.0, 1.0),
        (0.0, 1000.0, 1.0),
        (10_000.0, 0.0, 1.0),
        (10_000.0, -1.0, 1.0),
        (10_000.0, [1000.0, np.nan], 1.0),
        (10_000.0, 1000.0, np.nan),
        (10_000.0, 1000.0, [1.0, np.inf]),
        (10_000.0, 10_000.0, 1.0),
        (10_000.0, [1000.0, 20_000.0], 1.0),
    ],
)
def test_values_without_meaning_are_refused(arguments):
    with pytest.raises(ValueError, match=r"must be"):
        time_to_distance(*arguments)


def test_head_on_adds_the_maximum_speeds_and_overtaking_takes_the_cruise_speed_off():
    times = times_to_loss(40.0, 30.0, 60.0, detection_range=10_000.0, separation=1000.0, collision=400.0)
    assert SCENARIOS == ("head-on", "overtaking")
    np.testing.assert_allclose(times.closing_speed, [100.0, 30.0])
    np.testing.assert_allclose(times.to_loss_of_separation, [90.0, 300.0])
    np.testing.assert_allclose(times.to_collision, [96.0, 320.0])


def test_a_table_of_intruders_and_ownships():
    times = times_to_loss(
        [22.0, 41.0], [15.0, 31.0], [[536.0], [22.0]], detection_range=18_520.0, separation=1219.2, collision=500.0
    )
    assert times.to_loss_of_separation.shape == times.to_collision.shape == (2, 2, 2)
    assert times.to_collision[0, 1, 0] == pytest.approx(31.23, abs=0.01)
    assert times.closing_speed[1, 1, 1] == -9.0
    assert times.to_loss_of_separation[1, 1, 1] == times.to_collision[1, 1, 1] == np.inf


def test_ranges_broadcast_with_the_aircraft():
    times = times_to_loss(
        22.0, 15.0, 65.0, detection_range=[18_520.0, 37_040.0], separation=1219.2, collision=[500.0, 152.4]
    )
    np.testing.assert_allclose(times.to_loss_of_separation[:, 0], [17_300.8 / 87.0, 35_820.8 / 87.0])
    np.testing.assert_allclose(times.to_collision[:, 1], [18_020.0 / 50.0, 36_887.6 / 50.0])


def test_speeds_must_not_be_negative():
    for speeds in ((-1.0, 10.0, 20.0), (10.0, -1.0, 20.0), (10.0, 10.0, -1.0), (np.nan, 10.0, 20.0)):
        with pytest.raises(ValueError, match="speed must be finite and not negative"):
            times_to_loss(*speeds, detection_range=10_000.0, separation=1000.0, collision=500.0)


# ADS-B paper, figure 3, Cessna SkyHawk (126 kt) and RQ-11B Raven (43 kt): speeds in whole m/s, collision at 500 m.
@pytest.mark.parametrize(
    ("scenario", "loss", "touch"), [("head-on", 198.9, 207.1), ("overtaking", 346.0, 360.4)], ids=SCENARIOS
)
def test_one_intruder_of_figure_3(scenario, loss, touch):
    times = times_to_loss(
        round(43 * KNOT),
        15.0,
        round(126 * KNOT),
        detection_range=10 * NAUTICAL_MILE,
        separation=4000 * FOOT,
        collision=500.0,
    )
    k = SCENARIOS.index(scenario)
    assert times.to_loss_of_separation[k] == pytest.approx(loss, abs=0.05)
    assert times.to_collision[k] == pytest.approx(touch, abs=0.05)
