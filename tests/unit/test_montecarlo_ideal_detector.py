"""The ideal detector: geometry as the experiment says, the curve as by hand, the reference values."""

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from wideberth.evaluation.montecarlo.curves import ScoreHistogram
from wideberth.evaluation.montecarlo.experiment import load_experiment
from wideberth.evaluation.montecarlo.ideal_detector import draw_intruders, ideal_curve
from wideberth.units import FOOT, KNOT, NAUTICAL_MILE

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"


def experiment_of(name, *overrides):
    return load_experiment(EXPERIMENTS / f"{name}.toml", overrides)


@pytest.mark.parametrize(
    ("altitude", "expected"),
    [
        # ERRATA, "ADS-B paper": about 0.015 to 0.024 with noise filtered to 20 ft, 0.021 to 0.03 with a bias. Some
        # 37,000 events are drawn: at P_cd 0.999 the threshold, and so P_fa, is known to a few per cent.
        ("white", {0.99: (0.0158, 0.04), 0.995: (0.0188, 0.05), 0.999: (0.0243, 0.1)}),
        ("bias", {0.99: (0.0232, 0.03), 0.995: (0.0259, 0.04), 0.999: (0.0297, 0.1)}),
    ],
)
def test_reference_values(altitude, expected):
    ideal = ideal_curve(experiment_of("adsb_collision", f"errors.altitude={altitude}"), 2_000_000, 7)
    for p_cd, (p_fa, tolerance) in expected.items():
        assert ideal.curve.p_fa_at(p_cd) == pytest.approx(p_fa, rel=tolerance)
    # Of the intruders 1.9 % come within 500 ft and 100 ft.
    assert ideal.curve.events / ideal.samples == pytest.approx(0.0185, rel=0.03)
    assert ideal.position_sigma_m == pytest.approx(124 * FOOT, rel=2e-3)
    assert ideal.altitude_sigma_m == pytest.approx((20 if altitude == "white" else 75.9) * FOOT)


def test_an_error_that_starts_at_zero_is_no_error_of_position():
    stationary = ideal_curve(experiment_of("adsb_collision"), 200_000, 1)
    zero = ideal_curve(experiment_of("adsb_collision", "errors.start=zero"), 200_000, 1)
    assert zero.position_sigma_m == 0.0
    assert zero.curve.p_fa_at(0.99) < 0.5 * stationary.curve.p_fa_at(0.99)


def test_better_accuracy_gives_fewer_false_alarms():
    def p_fa(nacp):
        return ideal_curve(experiment_of("adsb_collision", f"sensor.nacp={nacp}"), 200_000, 1).curve.p_fa_at(0.99)

    assert p_fa(10) < p_fa(9) < p_fa(8) < p_fa(7)


def test_a_seed_is_a_curve():
    experiment = experiment_of("adsb_collision")
    assert ideal_curve(experiment, 150_000, 3).curve.points() == ideal_curve(experiment, 150_000, 3).curve.points()
    with pytest.raises(ValueError, match="at least 1"):
        ideal_curve(experiment, 0, 3)


@pytest.mark.parametrize("redraw", ["speed_and_heading", "heading"])
def test_intruders_start_on_the_circle_and_head_into_it(redraw):
    config = experiment_of("adsb_collision", f"encounter.redraw={redraw}").encounter
    position, velocity, height = draw_intruders(config, 40_000, np.random.default_rng(2))
    radius = 1.62 * NAUTICAL_MILE
    assert np.hypot(*position.T) == pytest.approx(radius)
    # The points in turn, the first straight ahead.
    assert position[0] == pytest.approx([radius, 0.0])
    assert position[5] == pytest.approx([0.0, radius], abs=1e-6)
    assert position[20] == pytest.approx(position[0])
    assert ((position * velocity).sum(axis=1) < 0).all()
    speed = np.hypot(velocity[:, 0] + 80 * KNOT, velocity[:, 1]) / KNOT
    assert speed.min() >= 39 - 1e-9 and speed.max() <= 250 + 1e-9
    # Uniform heights within +-160 ft; refused by chance once in a million.
    assert stats.kstest(height / FOOT, stats.uniform(-160, 320).cdf).pvalue > 1e-6
    ahead = speed[0::20]
    if redraw == "heading":
        # Ahead every speed can head into the circle, so that speeds stay uniform there.
        assert stats.kstest(ahead, stats.uniform(39, 211).cdf).pvalue > 1e-6
    # From behind only the faster ones come.
    assert speed[10::20].min() > 80.0


def test_heading_alone_keeps_speeds_uniform_and_both_favour_the_fast():
    def mean_speed(redraw):
        config = experiment_of("adsb_collision", f"encounter.redraw={redraw}").encounter
        position, velocity, _ = draw_intruders(config, 200_000, np.random.default_rng(3))
        # 18 degrees off the tail: of the slow hardly any heading leads into the circle.
        mine = np.arange(len(position)) % 20 == 9
        return np.hypot(velocity[mine, 0] + 80 * KNOT, velocity[mine, 1]).mean()

    assert mean_speed("speed_and_heading") > mean_speed("heading") + 5.0


def test_curve_of_scores_by_hand():
    rng = np.random.default_rng(4)
    scores, event = rng.exponential(2.0, 5000), rng.random(5000) < 0.2
    scores[event] *= 0.3
    scores[::50] = np.inf
    scores[::77] = np.nan
    histogram = ScoreHistogram()
    histogram.add(scores[:2000], event[:2000])
    rest = ScoreHistogram()
    rest.add(scores[2000:], event[2000:])
    histogram.merge(rest)
    curve = histogram.curve()
    assert (curve.events, curve.others) == (event.sum(), (~event).sum())
    finite = np.where(np.isnan(scores), np.inf, scores)
    for point in curve.points(25):
        assert point["p_cd"] == np.mean(finite[event] < point["threshold"])
        assert point["p_fa"] == np.mean(finite[~event] < point["threshold"])
    # 2 % are never detected.
    assert curve.p_fa_at(1.0) is None
    p_fa = curve.p_fa_at(0.9)
    threshold = np.sort(finite[event])[int(np.ceil(0.9 * event.sum())) - 1]
    assert p_fa == pytest.approx(np.mean(finite[~event] <= threshold), abs=2e-3)
    assert curve.correct[-1] == np.isfinite(finite[event]).sum()
    low, high = curve.p_fa_interval_at(0.9)
    assert low < p_fa < high


def test_scores_on_an_edge_are_no_alarm_there():
    histogram = ScoreHistogram()
    # 0.3 is the edge of a bin, not exactly in binary.
    histogram.add([0.3, 0.1 + 0.2, 1.0, -30.0, 500.0], [True] * 5)
    histogram.add([5.0], [False])
    curve = histogram.curve()
    at = {round(float(t), 3): int(c) for t, c in zip(curve.thresholds, curve.correct, strict=True)}
    assert (at[0.3], at[0.301], at[1.0], at[1.001], at[80.0]) == (1, 3, 3, 4, 4)


def test_nothing_has_no_curve():
    curve = ScoreHistogram().curve()
    assert curve.points() == [] and curve.p_fa_at(0.5) is None
    assert curve.p_fa_interval_at(0.5) is None
