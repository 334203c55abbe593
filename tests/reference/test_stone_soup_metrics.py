"""OSPA and GOSPA against Stone Soup's."""

import datetime
from pathlib import Path

import numpy as np
import pytest

from tests.made_tracks import made_table
from wideberth.evaluation.set_distances import distances, gospa, ospa
from wideberth.evaluation.tracking_metrics import score_run
from wideberth.sensors.radar.plot_file import read_plot_file

peer = pytest.importorskip("stonesoup.metricgenerator.ospametric", reason="Stone Soup is not installed (extra 'test')")
State = pytest.importorskip("stonesoup.types.state").State
FOLDER = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "tracking"
NOW = datetime.datetime(2020, 1, 1)
TOLERANCE = 1e-9


def theirs(tracks, truths, cutoff=50.0, order=2.0):
    """Stone Soup's OSPA, and the parts of its GOSPA."""
    a, b = ([State(x[:, None], timestamp=NOW) for x in points] for points in (tracks, truths))
    distance = peer.OSPAMetric(c=cutoff, p=order).compute_OSPA_distance(a, b).value
    parts = peer.GOSPAMetric(c=cutoff, p=order).compute_gospa_metric(a, b)[0].value
    return float(distance), [float(parts[name]) for name in ("distance", "localisation", "missed", "false")]


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
def test_random_sets(order):
    rng = np.random.default_rng(11)
    differ = 0
    for _ in range(150):
        n, m = rng.integers(0, 7, 2)
        if n == m == 0:
            continue
        tracks, truths = rng.uniform(0, 120, (n, 3)), rng.uniform(0, 120, (m, 3))
        their_ospa, their_gospa = theirs(tracks, truths, order=order)
        ours = ospa(tracks, truths, order=order).distance
        assert ospa(tracks, truths, order=order, assign_by="distance").distance == pytest.approx(
            their_ospa, abs=TOLERANCE
        )
        np.testing.assert_allclose(gospa(tracks, truths, order=order), their_gospa, rtol=1e-12, atol=TOLERANCE)
        # They sum distances to assign, and powers to measure: never less than the least.
        assert ours <= their_ospa + TOLERANCE
        differ += their_ospa - ours > TOLERANCE
    assert differ <= 10
    assert order != 1.0 or differ == 0


@pytest.mark.parametrize("name", ["bench_3", "bench_5", "bench_man", "bench_onboard"])
def test_scans_of_made_tracks(name):
    path = FOLDER / f"{name}.npz"
    if not path.exists():
        pytest.skip(f"no recorded plots at {path}")
    file = read_plot_file(path)
    truth = file.truth
    assert truth is not None
    table = made_table(truth, np.random.default_rng(3))
    scores = score_run(table, truth, file.t).scans
    closest = [np.min(distances(p[v], p[v]) + 1e9 * np.eye(v.sum())) for p, v in zip(
        truth.position, truth.visible, strict=True
    )]  # fmt: skip
    # The scans in which aircraft are nearest to each other, where assignments could differ, and some of the others.
    for k in {*np.argsort(closest)[:25].tolist(), *range(0, len(file.t), 25)}:
        x = table.x[table.scan == k, :3]
        their_ospa, their_gospa = theirs(x, truth.position[k, truth.visible[k]])
        assert scores.ospa[k] == pytest.approx(their_ospa, abs=TOLERANCE)
        mine = [getattr(scores, f"gospa{part}")[k] for part in ("", "_localisation", "_missed", "_false")]
        np.testing.assert_allclose(mine, their_gospa, rtol=1e-12, atol=TOLERANCE)
