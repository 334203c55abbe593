"""The score of tracks: cases by hand, each definition by itself."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, norm

from tests.made_tracks import made_table, made_truth, table_of
from wideberth.evaluation.tracking_metrics import score_run, summarise
from wideberth.sensors.radar.plot_file import PlotTruth

N = 200
T = 0.1 * np.arange(N)


def straight(*starts, velocity=(1.0, 0.0, 0.0), ownship=-1, visible=None):
    """Targets that fly north at 1 m/s from their starts (north, east)."""
    start = np.array([[north, east, -100.0] for north, east in starts])
    moved = T[:, None, None] * np.array(velocity)
    position = start[None] + moved
    return PlotTruth(
        position,
        np.broadcast_to(np.array(velocity), position.shape).copy(),
        np.ones(position.shape[:2], dtype=np.bool_) if visible is None else visible,
        ownship,
    )


def follow(truth, target, track, scans, off=(0.0, 0.0, 0.0)):
    """Rows of a track that follows a target at a distance."""
    return [(k, track, np.concatenate([truth.position[k, target] + off, truth.velocity[k, target]])) for k in scans]


def summary_of(truth, rows, **kwargs):
    return summarise([score_run(table_of(rows, **kwargs), truth, T)])


def test_perfect_tracks():
    truth = straight((0, 0), (0, 300))
    m = summary_of(truth, follow(truth, 0, 1, range(N)) + follow(truth, 1, 2, range(N)))
    for key in ("ospa_m", "gospa_m", "first_confirmed_s", "latency_s", "rmse_position_m", "rmse_velocity_mps"):
        assert m[key] == 0.0, key
    for key in ("never_confirmed", "false_tracks", "identity_switches", "missed_fraction", "nees_per_dof"):
        assert m[key] == 0.0, key
    assert (m["tracks"], m["track_purity"], m["coverage_95_horizontal"]) == (2, 1.0, 1.0)
    assert m["nis_per_dof"] is None and m["ownship_identified"] is None


def test_no_tracks_at_all():
    m = summary_of(straight((0, 0), (0, 300)), [])
    assert m["ospa_m"] == m["ospa_cardinality_m"] == 50.0
    assert m["gospa_m"] == pytest.approx(50.0)
    assert (m["never_confirmed"], m["missed_fraction"], m["tracks"]) == (2, 1.0, 0)
    assert m["first_confirmed_s"] is m["rmse_position_m"] is m["track_purity"] is m["nees_per_dof"] is None


def test_distances_count_after_ten_seconds():
    truth = straight((0, 0))
    m = summary_of(truth, follow(truth, 0, 1, range(N), off=(3.0, 4.0, 0.0)))
    assert m["ospa_m"] == m["ospa_localisation_m"] == m["rmse_position_m"] == pytest.approx(5.0)
    late = summary_of(truth, follow(truth, 0, 1, range(100, N)))
    assert (late["ospa_m"], late["missed_fraction"], late["first_confirmed_s"]) == (0.0, 0.0, pytest.approx(10.0))
    # Two of the hundred scans after 10 s without a track.
    assert summary_of(truth, follow(truth, 0, 1, range(102, N)))["ospa_m"] == pytest.approx(1.0)


def test_a_truth_counts_only_while_visible():
    visible = np.ones((N, 2), dtype=np.bool_)
    visible[150:, 1] = False
    visible[:30, 1] = False
    truth = straight((0, 0), (0, 300), visible=visible)
    one, two = follow(truth, 0, 1, range(5, N)), follow(truth, 1, 2, range(35, 150))
    m = summary_of(truth, one + two)
    assert (m["ospa_m"], m["missed_fraction"]) == (0.0, 0.0)
    assert m["first_confirmed_s"] == pytest.approx((0.5 + 3.5) / 2)
    assert m["latency_s"] == pytest.approx(0.5)
    # Carried on over 50 of the 100 scans that count, it is one too many.
    assert summary_of(truth, one + follow(truth, 1, 2, range(35, N)))["ospa_cardinality_m"] == pytest.approx(
        0.5 * 50 / math.sqrt(2)
    )


def test_the_first_confirmed_track_is_within_the_cutoff():
    truth = straight((0, 0))
    rows = follow(truth, 0, 1, range(20), off=(51.0, 0, 0)) + follow(truth, 0, 1, range(20, N), off=(49.0, 0, 0))
    assert summary_of(truth, rows)["first_confirmed_s"] == pytest.approx(2.0)


def test_a_false_track_is_unassigned_in_more_than_half_of_its_scans():
    truth = straight((0, 0))
    good = follow(truth, 0, 1, range(N))
    assert summary_of(truth, good + follow(truth, 0, 2, range(50, 60), off=(200, 0, 0)))["false_tracks"] == 1
    # Another one that is near is too many, but the target has only one.
    assert summary_of(truth, good + follow(truth, 0, 2, range(50, 60), off=(5, 0, 0)))["false_tracks"] == 1
    alone, far = follow(truth, 0, 2, range(50)), follow(truth, 0, 2, range(50, 100), off=(200, 0, 0))
    assert summary_of(truth, alone + far)["false_tracks"] == 0
    assert summary_of(truth, alone[1:] + far)["false_tracks"] == 1


def test_a_switch_is_another_track_once_the_old_one_is_gone():
    truth = straight((0, 0), (0, 300))
    other = follow(truth, 1, 9, range(N))
    first, second = follow(truth, 0, 1, range(100)), follow(truth, 0, 2, range(110, N))
    assert summary_of(truth, first + second + other)["identity_switches"] == 1
    # The same track again is none, nor is a second one while the first one lives, nor one that is not near.
    assert summary_of(truth, first + follow(truth, 0, 1, range(110, N)) + other)["identity_switches"] == 0
    assert summary_of(truth, first + follow(truth, 0, 2, range(50, 100)) + other)["identity_switches"] == 0
    far = follow(truth, 0, 2, range(110, N), off=(30, 0, 0))
    assert summary_of(truth, first + far + other)["identity_switches"] == 0
    m = summary_of(truth, follow(truth, 0, 1, range(120)) + follow(truth, 0, 2, range(100, N), off=(0, 1, 0)) + other)
    assert m["identity_switches"] == 1


def test_tracks_that_change_places_are_two_switches_and_impure():
    truth = straight((0, 0), (0, 300))
    rows = (
        follow(truth, 0, 1, range(100)) + follow(truth, 1, 1, range(100, N))
        + follow(truth, 1, 2, range(100)) + follow(truth, 0, 2, range(100, N))
    )  # fmt: skip
    m = summary_of(truth, rows)
    assert (m["identity_switches"], m["track_purity"]) == (2, 0.5)
    assert (m["ospa_m"], m["false_tracks"]) == (0.0, 0)


def test_a_scan_in_which_the_assignment_exchanges_two_near_tracks_is_no_switch():
    truth = straight((0, 0), (0, 2))
    rows = [row for row in follow(truth, 0, 1, range(N)) + follow(truth, 1, 2, range(N)) if row[0] != 150]
    rows += follow(truth, 0, 2, [150]) + follow(truth, 1, 1, [150])
    run = score_run(table_of(rows), truth, T)
    assert run.switches.sum() == 0
    assert run.pairs.scan[~run.pairs.own].tolist() == [150, 150]
    assert summarise([run])["track_purity"] == pytest.approx(1 - 2 / (2 * N))


def test_the_ownship_and_who_is_taken_for_it():
    truth = straight((0, 0), (0, 300), ownship=0)
    rows = follow(truth, 0, 1, range(N)) + follow(truth, 1, 2, range(N))
    m = summary_of(truth, rows, ownship=(1,))
    assert (m["ownship_identified"], m["intruder_taken_for_ownship_scans"]) == (1.0, 0)
    m = summary_of(truth, rows, ownship=(2,))
    assert (m["ownship_identified"], m["intruder_taken_for_ownship_scans"]) == (0.0, N)


def test_errors_and_covariances_by_hand():
    truth = straight((0, 0))
    rows = [
        (k, 1, np.concatenate([truth.position[k, 0] + [3, 0, 0], truth.velocity[k, 0] + [0, 2, 0]])) for k in range(N)
    ]
    P = np.eye(9)
    P[0, 0], P[4, 4] = 2.0, 0.5
    m = summary_of(truth, rows, P=P)
    assert (m["rmse_position_m"], m["rmse_velocity_mps"]) == (pytest.approx(3.0), pytest.approx(2.0))
    assert m["nees_per_dof"] == pytest.approx((9 / 2 + 4 / 0.5) / 6)
    # 4.5 is inside both 95 % points, 5.99 and 7.81; 6.5 only inside the second.
    assert (m["coverage_95_horizontal"], m["coverage_95_position"]) == (1.0, 1.0)
    P[0, 0] = 9 / 6.5
    m = summary_of(truth, rows, P=P)
    assert (m["coverage_95_horizontal"], m["coverage_95_position"]) == (0.0, 1.0)


@pytest.mark.parametrize("value", [-1.0, 0.0, math.nan])
def test_covariances_that_are_none_are_counted(value):
    truth = straight((0, 0))
    P = np.eye(9)
    P[1, 1] = value
    m = summary_of(truth, follow(truth, 0, 1, range(N)), P=P)
    assert (m["unsound_covariances"], m["nees_per_dof"]) == (100, None)


def test_honest_covariances_look_honest():
    truth = made_truth(1000)
    runs = [score_run(made_table(truth, np.random.default_rng(seed)), truth, 0.1 * np.arange(1000)) for seed in (1, 2)]
    m = summarise(runs)
    pairs = sum(int((run.pairs.settled & run.pairs.own).sum()) for run in runs)
    assert pairs == 2 * (900 + 800)
    # Two-sided at 99.9 %, for these seeds.
    low, high = chi2.ppf([0.0005, 0.9995], 6 * pairs) / (6 * pairs)
    assert low < m["nees_per_dof"] < high
    half = norm.ppf(0.9995) * math.sqrt(0.95 * 0.05 / pairs)
    assert abs(m["coverage_95_horizontal"] - 0.95) < half
    assert abs(m["coverage_95_position"] - 0.95) < half


def test_nis_is_of_all_updates():
    truth = straight((0, 0))
    table = replace(table_of(follow(truth, 0, 1, range(N))), nis=np.array([3.0, 6.0]), nis_dof=np.array([3.0, 3.0]))
    assert summarise([score_run(table, truth, T)])["nis_per_dof"] == pytest.approx(1.5)


def test_runs_together_count_sums_and_means():
    truth = straight((0, 0))
    near = score_run(table_of(follow(truth, 0, 1, range(N), off=(1, 0, 0))), truth, T)
    far = score_run(table_of(follow(truth, 0, 7, range(10, N), off=(7, 0, 0))), truth, T)
    m = summarise([near, far])
    assert (m["runs"], m["tracks"], m["scans"]) == (2, 2, 2 * N)
    assert m["ospa_m"] == pytest.approx(4.0)
    assert m["rmse_position_m"] == pytest.approx(5.0)
    assert m["first_confirmed_s"] == pytest.approx(0.5)
    with pytest.raises(ValueError, match="runs must not be empty"):
        summarise([])


def test_one_track_cannot_be_two():
    truth = straight((0, 0))
    with pytest.raises(ValueError, match="track_id must not occur twice"):
        score_run(table_of(follow(truth, 0, 1, [3, 3])), truth, T)
    with pytest.raises(ValueError, match="x is not finite: track 1 in scan 3"):
        score_run(table_of([(3, 1, [math.nan])]), truth, T)
    with pytest.raises(ValueError, match="scan must be from 0 to 199, got 200 to 200"):
        score_run(table_of([(200, 1, [0.0])]), truth, T)


def test_a_table_of_wrong_shape_is_refused():
    table = table_of([(3, 1, [0.0])])
    with pytest.raises(ValueError, match=r"P must have shape \(1, 9, 9\), got \(1, 6, 6\)"):
        replace(table, P=np.zeros((1, 6, 6)))
    with pytest.raises(ValueError, match="scan must not decrease"):
        replace(table_of([(3, 1, [0.0]), (4, 1, [0.0])]), scan=np.array([4, 3], dtype=np.int32))
