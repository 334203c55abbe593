"""Stone Soup's trackers on the plots of a ground radar: GNN or JPDA with an EKF, starts from several plots.

Each is set up as its own tutorials do, with a constant-velocity model and the noise, detection probability and clutter
density that the plots were made with.
"""

import datetime
import math
import time
from typing import Any, NamedTuple

import numpy as np
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.dataassociator.probability import JPDA
from stonesoup.deleter.error import CovarianceBasedDeleter
from stonesoup.deleter.multi import CompositeDeleter
from stonesoup.deleter.time import UpdateTimeStepsDeleter
from stonesoup.functions import gm_reduce_single
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.initiator.simple import MultiMeasurementInitiator
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.nonlinear import CartesianToElevationBearingRange
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import ExtendedKalmanPredictor
from stonesoup.types.array import StateVectors
from stonesoup.types.detection import Detection
from stonesoup.types.state import GaussianState
from stonesoup.types.update import GaussianStateUpdate
from stonesoup.updater.kalman import ExtendedKalmanUpdater

from wideberth.plots import Plots
from wideberth.types import FloatArray

ACCELERATION_NOISE = 0.01
"""Spectral density, m2/s3: the value that did best on straight aircraft among 1e-4 ... 1."""

GATE, MIN_POINTS, MISSED_SCANS = 4.0, 4, 8
SPEED_SIGMA = 15.0
_POSITION = [0, 2, 4]
_VELOCITY = [1, 3, 5]
_EPOCH = datetime.datetime(2000, 1, 1, tzinfo=datetime.UTC)


class Row(NamedTuple):
    """A confirmed track in a scan: NED position and velocity."""

    scan: int
    track: str
    state: FloatArray


def track(plots: Plots, kind: str, clutter_density: float, scans: int) -> tuple[list[Row], float]:
    """Run Stone Soup over the first scans of a radar at the origin.

    Parameters
    ----------
    plots : Plots
    kind : str
        ``"gnn"`` or ``"jpda"``.
    clutter_density : float
        False plots a scan by volume of the measurement space, 1/(rad2 m).
    scans : int

    Returns
    -------
    rows : list of Row
    cpu_s : float
        CPU time a scan, s.
    """
    # Elevation, bearing, range; bearings count counter-clockwise from the x axis: x north, y west.
    measured = CartesianToElevationBearingRange(
        ndim_state=6, mapping=_POSITION, noise_covar=np.diag([plots.sigma[2], plots.sigma[1], plots.sigma[0]]) ** 2
    )
    model = CombinedLinearGaussianTransitionModel([ConstantVelocity(ACCELERATION_NOISE)] * 3)
    predictor, updater = ExtendedKalmanPredictor(model), ExtendedKalmanUpdater(measured)
    nearest = GNNWith2DAssignment(DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=GATE))
    starts = MultiMeasurementInitiator(
        prior_state=GaussianState(np.zeros((6, 1)), np.diag([0.0, SPEED_SIGMA**2] * 3), timestamp=_EPOCH),
        measurement_model=measured,
        deleter=UpdateTimeStepsDeleter(MISSED_SCANS),
        data_associator=nearest,
        updater=updater,
        min_points=MIN_POINTS,
    )
    deleter = CompositeDeleter(
        [UpdateTimeStepsDeleter(MISSED_SCANS), CovarianceBasedDeleter(1e4, mapping=_POSITION)], intersect=False
    )
    associator = nearest
    if kind == "jpda":
        associator = JPDA(
            PDAHypothesiser(predictor, updater, clutter_density, plots.detection_probability, prob_gate=0.999)
        )
    detections = [_detections(plots, scan, measured) for scan in range(scans)]
    tracks: set[Any] = set()
    rows: list[Row] = []
    start = time.process_time()
    for scan, (now, seen) in enumerate(detections):
        used = set()
        for one, result in associator.associate(tracks, seen, now).items():
            used |= _update(one, result, updater, kind)
        tracks -= deleter.delete_tracks(tracks)
        tracks |= starts.initiate(seen - used, now)
        rows.extend(_row(scan, one) for one in tracks)
    return rows, (time.process_time() - start) / scans


def _detections(plots: Plots, scan: int, measured: Any) -> tuple[datetime.datetime, set[Any]]:
    now = _EPOCH + datetime.timedelta(seconds=float(plots.t[scan]))
    rows = plots.z[plots.first[scan] : plots.first[scan + 1]]
    return now, {
        Detection(np.array([[elevation], [-azimuth], [distance]]), timestamp=now, measurement_model=measured)
        for distance, azimuth, elevation in rows[:, :3].tolist()
    }


def _update(one: Any, result: Any, updater: Any, kind: str) -> set[Any]:
    """Give a track its state after a scan; return the plots that are its own."""
    if kind == "gnn":
        if not result:
            one.append(result.prediction)
            return set()
        one.append(updater.update(result))
        return {result.measurement}
    states, weights, used = [], [], set()
    for hypothesis in result:
        weights.append(float(hypothesis.probability))
        if hypothesis:
            states.append(updater.update(hypothesis))
            used.add(hypothesis.measurement)
        else:
            states.append(hypothesis.prediction)
    mean, covariance = gm_reduce_single(
        StateVectors([state.state_vector for state in states]),
        np.stack([state.covar for state in states], axis=2),
        np.array(weights),
    )
    if not used:
        one.append(result[0].prediction)
        return used
    one.append(GaussianStateUpdate(mean, covariance, result, result[0].prediction.timestamp))
    return used


def _row(scan: int, one: Any) -> Row:
    x = np.asarray(one.state_vector, dtype=np.float64)[:, 0]
    # North, west, up to north, east, down.
    state = np.concatenate([x[_POSITION], x[_VELOCITY]]) * np.array([1.0, -1.0, -1.0] * 2)
    return Row(scan, one.id, state)


def clutter_density(plots: Plots, false_plots: float) -> float:
    """Return the density of false plots that are uniform in range and in all directions above the horizon."""
    return false_plots / (plots.range_max * 2.0 * math.pi * 0.5 * math.pi)
