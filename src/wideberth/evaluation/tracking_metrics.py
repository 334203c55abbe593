"""What tracks of radar plots are scored by, against the truth: distances, identity, accuracy, honest covariances.

A truth counts only while it is visible to the radar. In each scan tracks and truths are paired by the assignment of
OSPA and GOSPA; a track is *assigned* to a truth where they are a pair nearer than the cut-off.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth.evaluation.set_distances import assigned, distances, gospa_of, ospa_of
from wideberth.sensors.radar.plot_file import PlotTruth
from wideberth.tracking.track_table import TrackTable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

CUTOFF = 50.0  # m
ORDER = 2.0
SETTLE = 10.0  # s; distances and errors count from here on
SWITCH_WITHIN = 20.0  # m
# 95 % points of chi-square with two and three degrees of freedom.
_ELLIPSE_95, _ELLIPSOID_95 = 5.991464547107979, 7.814727903251178


class ScanScores(NamedTuple):
    """Each scan's distances, shape (n_scans,): OSPA and GOSPA with their parts, and how many there were."""

    ospa: FloatArray
    ospa_localisation: FloatArray
    ospa_cardinality: FloatArray
    gospa: FloatArray
    gospa_localisation: FloatArray
    gospa_missed: FloatArray
    gospa_false: FloatArray
    truths: IntArray
    tracks: IntArray


class Pairs(NamedTuple):
    """Assigned pairs, in order of scan.

    `row` is the track's row in its table; `error` (n, 6) is estimate minus truth of position and velocity; `nees`
    (n,), of those, and `ellipse` and `ellipsoid` (n,), of horizontal position and of position, are quadratic forms of
    the error with the inverse of its covariance, NaN where that is not positive definite. `settled` (n,) tells the
    pairs after the time to settle, and `own` (n,) those whose target does not go by another track: where two aircraft
    cross at one place the cheapest assignment may exchange them for a scan, which says nothing of the covariance.
    """

    row: IntArray
    scan: IntArray
    target: IntArray
    error: FloatArray
    nees: FloatArray
    ellipse: FloatArray
    ellipsoid: FloatArray
    settled: BoolArray
    own: BoolArray


@dataclass(frozen=True, slots=True)
class RunScore:
    """The score of one run.

    Attributes
    ----------
    t : ndarray, shape (n_scans,)
        Time of each scan, s.
    settled : ndarray of bool, shape (n_scans,)
        The scans after the time to settle.
    scans : ScanScores
    pairs : Pairs
    first_confirmed : ndarray, shape (n_targets,)
        Time from scan 0 to the first scan with an assigned track, s; NaN for a target that never had one.
    first_visible : ndarray, shape (n_targets,)
        Time from scan 0 to the first scan in which it is visible, s; NaN for one that never is.
    tracks, false_tracks : int
        Tracks in all, and those that are unassigned in more than half of their scans.
    switches : ndarray of int64, shape (n_targets,)
        How often another track took over: one is within `SWITCH_WITHIN` while the old one is not within the cut-off.
    pure_scans : int
        Sum over tracks of the scans in which they are assigned to the target that they are assigned to most.
    ownship_scans, ownship_found, mistaken : int
        Of the pairs that are `Pairs.own`: those of the ownship, those of them whose track is marked as the ownship's,
        and those of other aircraft whose track is marked as the ownship's.
    nis, nis_dof : float
        Sums over the tracker's updates of the normalised innovation squared and of its degrees of freedom.
    """

    t: FloatArray
    settled: BoolArray
    scans: ScanScores
    pairs: Pairs
    first_confirmed: FloatArray
    first_visible: FloatArray
    tracks: int
    false_tracks: int
    switches: IntArray
    pure_scans: int
    ownship_scans: int
    ownship_found: int
    mistaken: int
    nis: float
    nis_dof: float


def score_run(table: TrackTable, truth: PlotTruth, t: FloatArray, cutoff: float = CUTOFF) -> RunScore:
    """Return the score of a tracker's run.

    Parameters
    ----------
    table : TrackTable
        What the tracker answered.
    truth : PlotTruth
    t : ndarray, shape (n_scans,)
        Time of each scan, s.
    cutoff : float
        c of OSPA and GOSPA, m; pairs farther apart are none.

    Returns
    -------
    RunScore

    Raises
    ------
    ValueError
        If a row of the table is of no scan, is not finite, or two rows are the same track in the same scan.
    """
    n_scans, n_targets = truth.visible.shape
    _check(table, n_scans)
    first = np.searchsorted(table.scan, np.arange(n_scans + 1))
    scans = np.zeros((7, n_scans))
    owner = np.full(len(table), -1, dtype=np.int64)  # the target of each row
    row_of = np.full((n_scans, n_targets), -1, dtype=np.int64)  # the row of each target
    identity: list[int | None] = [None] * n_targets
    own_track = np.ones(len(table), dtype=np.bool_)
    switches = np.zeros(n_targets, dtype=np.int64)
    for k in range(n_scans):
        rows = np.arange(first[k], first[k + 1])
        targets = np.flatnonzero(truth.visible[k])
        d = distances(table.x[rows, :3], truth.position[k, targets])
        mine, theirs = assigned(d, cutoff, ORDER)
        scans[:3, k] = ospa_of(d, mine, theirs, cutoff, ORDER)
        scans[3:, k] = gospa_of(d, mine, theirs, cutoff, ORDER)
        owner[rows[mine]] = targets[theirs]
        row_of[k, targets[theirs]] = rows[mine]
        if len(rows):
            for j, target in enumerate(targets.tolist()):
                known = identity[target]
                identity[target] = _identity(known, d[:, j], table.track_id[rows], cutoff)
                switches[target] += known is not None and identity[target] != known
            for row, target in zip(rows[mine].tolist(), targets[theirs].tolist(), strict=True):
                own_track[row] = identity[target] in (None, table.track_id[row])
    after = t - t[0]
    settled = after >= SETTLE - 1e-9
    tracks, false_tracks, pure = _lives(table, owner)
    own = truth.ownship
    paired = (owner >= 0) & own_track
    ours = paired & (owner == own)
    return RunScore(
        t=t,
        settled=settled,
        scans=ScanScores(
            ospa=scans[0],
            ospa_localisation=scans[1],
            ospa_cardinality=scans[2],
            gospa=scans[3],
            gospa_localisation=scans[4],
            gospa_missed=scans[5],
            gospa_false=scans[6],
            truths=truth.visible.sum(axis=1).astype(np.int64),
            tracks=np.diff(first).astype(np.int64),
        ),
        pairs=_pairs(table, truth, owner, settled, own_track),
        first_confirmed=_first(row_of >= 0, after),
        first_visible=_first(truth.visible, after),
        tracks=tracks,
        false_tracks=false_tracks,
        switches=switches,
        pure_scans=pure,
        ownship_scans=int(ours.sum()),
        ownship_found=int((ours & table.is_ownship).sum()),
        mistaken=int((paired & ~ours & table.is_ownship).sum()),
        nis=float(np.sum(table.nis)),
        nis_dof=float(np.sum(table.nis_dof)),
    )


def summarise(runs: Sequence[RunScore]) -> dict[str, Any]:
    """Return the numbers of some runs over the same flights, together.

    Distances are means over the settled scans of all runs, errors are over their settled pairs, NEES and coverage
    over those of them in which the target does not go by another track, times are means over targets and runs, and
    counts are sums over runs. A number that there is nothing to make of is None.

    Parameters
    ----------
    runs : sequence of RunScore
        As `score_run` makes them; at least one.

    Returns
    -------
    dict
        Units stand in the keys.

    Raises
    ------
    ValueError
        If there is no run.
    """
    if not runs:
        raise ValueError("runs must not be empty")
    scans = {
        name: np.concatenate([getattr(run.scans, name)[run.settled] for run in runs]) for name in ScanScores._fields
    }
    error = np.concatenate([run.pairs.error[run.pairs.settled] for run in runs])
    forms = {
        name: np.concatenate([getattr(run.pairs, name)[run.pairs.settled & run.pairs.own] for run in runs])
        for name in ("nees", "ellipse", "ellipsoid")
    }
    sound = np.isfinite(forms["nees"])
    confirmed = np.concatenate([run.first_confirmed for run in runs])
    visible = np.concatenate([run.first_visible for run in runs])
    pairs = sum(len(run.pairs.row) for run in runs)
    own = sum(run.ownship_scans for run in runs)
    nis_dof = sum(run.nis_dof for run in runs)
    truths = int(scans["truths"].sum())
    return {
        "runs": len(runs),
        "scans": int(sum(len(run.t) for run in runs)),
        "ospa_m": _mean(scans["ospa"]),
        "ospa_localisation_m": _mean(scans["ospa_localisation"]),
        "ospa_cardinality_m": _mean(scans["ospa_cardinality"]),
        "gospa_m": _mean(scans["gospa"]),
        "gospa_localisation_m2": _mean(scans["gospa_localisation"]),
        "gospa_missed_m2": _mean(scans["gospa_missed"]),
        "gospa_false_m2": _mean(scans["gospa_false"]),
        "first_confirmed_s": _mean(confirmed[np.isfinite(confirmed)]),
        "latency_s": _mean((confirmed - visible)[np.isfinite(confirmed - visible)]),
        "never_confirmed": int((np.isnan(confirmed) & np.isfinite(visible)).sum()),
        "tracks": sum(run.tracks for run in runs),
        "false_tracks": sum(run.false_tracks for run in runs),
        "identity_switches": int(sum(run.switches.sum() for run in runs)),
        "track_purity": sum(run.pure_scans for run in runs) / pairs if pairs else None,
        "missed_fraction": 1 - len(error) / truths if truths else None,
        "rmse_position_m": _rms(error[:, :3]),
        "rmse_velocity_mps": _rms(error[:, 3:]),
        "nees_per_dof": _mean(forms["nees"][sound] / 6),
        "nis_per_dof": sum(run.nis for run in runs) / nis_dof if nis_dof else None,
        "coverage_95_horizontal": _mean(forms["ellipse"][sound] <= _ELLIPSE_95),
        "coverage_95_position": _mean(forms["ellipsoid"][sound] <= _ELLIPSOID_95),
        "unsound_covariances": int((~sound).sum()),
        "ownship_identified": sum(run.ownship_found for run in runs) / own if own else None,
        "intruder_taken_for_ownship_scans": sum(run.mistaken for run in runs),
    }


def _check(table: TrackTable, n_scans: int) -> None:
    if len(table) and (table.scan[0] < 0 or table.scan[-1] >= n_scans):
        raise ValueError(f"scan must be from 0 to {n_scans - 1}, got {table.scan.min()} to {table.scan.max()}")
    wrong = np.flatnonzero(~np.isfinite(table.x[:, :6]).all(axis=1))
    if len(wrong):
        row = wrong[0]
        raise ValueError(f"x is not finite: track {table.track_id[row]} in scan {table.scan[row]}")
    keys = np.stack([table.scan.astype(np.int64), table.track_id], axis=1)
    if len(np.unique(keys, axis=0)) != len(keys):
        raise ValueError("track_id must not occur twice in a scan")


def _identity(known: int | None, distance: FloatArray, ids: IntArray, cutoff: float) -> int | None:
    """Return which track a target goes by: the known one while it is near, else the nearest one near enough."""
    if known is not None and np.any((ids == known) & (distance < cutoff)):
        return known
    nearest = int(np.argmin(distance))
    return int(ids[nearest]) if distance[nearest] < SWITCH_WITHIN else known


def _lives(table: TrackTable, owner: IntArray) -> tuple[int, int, int]:
    """Return how many tracks there are, how many are false, and the scans in which they follow their main target."""
    _, track = np.unique(table.track_id, return_inverse=True)
    n = int(track.max(initial=-1)) + 1
    total, unassigned = np.bincount(track, minlength=n), np.bincount(track, weights=owner < 0, minlength=n)
    counts = np.zeros((n, int(owner.max(initial=-1)) + 1), dtype=np.int64)
    paired = owner >= 0
    np.add.at(counts, (track[paired], owner[paired]), 1)
    return n, int((unassigned > 0.5 * total).sum()), int(counts.max(axis=1, initial=0).sum())


def _pairs(table: TrackTable, truth: PlotTruth, owner: IntArray, settled: BoolArray, own_track: BoolArray) -> Pairs:
    row = np.flatnonzero(owner >= 0)
    scan, target = table.scan[row].astype(np.int64), owner[row]
    known = np.concatenate([truth.position[scan, target], truth.velocity[scan, target]], axis=1)
    error = table.x[row, :6] - known
    P = table.P[row, :6, :6]
    return Pairs(
        row=row,
        scan=scan,
        target=target,
        error=error,
        nees=_form(error, P),
        ellipse=_form(error[:, :2], P[:, :2, :2]),
        ellipsoid=_form(error[:, :3], P[:, :3, :3]),
        settled=settled[scan],
        own=own_track[row],
    )


def _form(error: FloatArray, P: FloatArray) -> FloatArray:
    """Return e' inv(P) e of each pair, NaN where P is not positive definite."""
    out = np.full(len(error), np.nan)
    P = 0.5 * (P + np.swapaxes(P, 1, 2))
    sound = np.flatnonzero(np.isfinite(P).all(axis=(1, 2)))
    sound = sound[np.linalg.eigvalsh(P[sound])[:, 0] > 0]
    if len(sound):
        out[sound] = np.einsum("ij,ij->i", error[sound], np.linalg.solve(P[sound], error[sound][:, :, None])[:, :, 0])
    return out


def _first(there: BoolArray, after: FloatArray) -> FloatArray:
    """Return the time of the first scan in which each target is there, NaN for none."""
    return np.where(there.any(axis=0), after[there.argmax(axis=0)], np.nan)


def _mean(values: NDArray[Any]) -> float | None:
    return float(np.mean(values)) if values.size else None


def _rms(errors: FloatArray) -> float | None:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1)))) if len(errors) else None
