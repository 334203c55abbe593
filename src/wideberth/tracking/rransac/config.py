"""Settings of R-RANSAC and ER-RANSAC, with the tables of the thesis as presets."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Three = tuple[Positive, Positive, Positive]
Six = tuple[Positive, Positive, Positive, Positive, Positive, Positive]
Nine = tuple[Positive, Positive, Positive, Positive, Positive, Positive, Positive, Positive, Positive]
NineNoises = tuple[
    NotNegative,
    NotNegative,
    NotNegative,
    NotNegative,
    NotNegative,
    NotNegative,
    NotNegative,
    NotNegative,
    NotNegative,
]
_DEG = math.radians(1.0)
_FREE = 1e9


class RransacConfig(PartConfig):
    """R-RANSAC with a linear model (thesis 3.2.2, 3.2.4 and 4.2).

    A preset gives every other key its value; keys that are given besides change it. Thresholds and noises of states
    are in the order of the states, in SI units: position (north, east, down), velocity, acceleration; in two
    dimensions those of the vertical are not used, and with constant velocity those of the acceleration.

    Attributes
    ----------
    preset : {"thesis", "robust", "flight_test"}
        ``"thesis"``: table 4.5; ``"flight_test"``: table 5.3, two dimensions; ``"robust"``: what repairs the recipe
        (Mahalanobis gate, plot covariances, births from unused plots, 4 hits in 15 scans).
    seed : int
        Of the random subsets: drawn by (seed, scan, plot, trial), so that the same plots give the same tracks.
    model : {"constant_acceleration", "constant_velocity"}
    dimensions : {3, 2}
        2: all aircraft fly at `known_altitude_m`, and elevations are not used (thesis 5.3).
    known_altitude_m, altitude_sigma_m : float
        Altitude above the local origin, and what is answered as its uncertainty; in two dimensions only.
    azimuth : {"plane", "cone"}
        What the azimuth of a two-dimensional radar is: the angle in its horizontal plane, or the angle out of its
        vertical plane (5.1).
    window_scans, stored_tracks : int
        N and M.
    plots_per_scan_max : int
        Of more plots in a scan the nearest are kept for births; every plot may still update a track.
    range_sigma_m, azimuth_sigma_deg, elevation_sigma_deg : float
        Used where a scan does not say its standard deviations.
    gate : {"thresholds", "mahalanobis"}
        Whether a plot belongs to a track: each element within `gate_sigmas` standard deviations of the plot (3.10),
        or the Mahalanobis distance with the innovation covariance within `gate_mahalanobis`.
    gate_sigmas : tuple of float
        s of (3.11): range, azimuth, elevation; also that of the ownship test in range and angles.
    gate_mahalanobis : float
    update : {"pseudo_measurement", "tangent", "polar", "unscented"}
        Position with the fixed variance `pseudo_variance_m2` (4.9)-(4.13); position with the plot's own covariance
        along and across the line of sight; range and angles by an EKF (3.6)-(3.9); or range and angles by an unscented
        filter, which predicts through sigma points too.
    unscented_scaling : tuple of float
        alpha, beta and kappa of the sigma points.
    pseudo_variance_m2 : tuple of float
        R of table 4.5, north, east, down.
    weighting : {"mean", "nearest"}
        w_ij, which the thesis does not print: the mean of all inliers, or one plot to one track.
    process_noise_per_s : tuple of float
        What the variance of each state grows by in a second: Q of the tables over their step of 0.1 s.
    noise_density : tuple of float
        Spectral density of the white noise on the highest derivative, north, east, down: m2/s3 (of the acceleration)
        with constant velocity, m2/s5 (of the jerk) with constant acceleration.
    ransac_iterations : int
        l.
    hypothesis_sigmas : tuple of float
        s of tau_R (3.46): range, azimuth, elevation.
    stop_ratio, consensus_ratio : float
        gamma, which ends the search, and tau_CS, which a hypothesis needs, as shares of N; 0: any.
    births_from : {"all", "unassociated"}
        Which plots of the window a hypothesis is made of and supported by.
    speed_max_mps : float or None
        Plots that no aircraft this fast could join are not tried together; None, as printed: all are.
    covariance_inflation : float
        Of the covariance with which smoothing starts, whose plots it uses again.
    begin_ratio, end_ratio : float
        tau_rho: inlier ratio at which a track becomes good, and below which it is no longer (3.2.4).
    lifetime_scans : int or None
        tau_T: a good track has lived longer than this; None: no such condition.
    misses_max : int
        tau_CMD: a track dies after this many scans in a row without an inlier.
    merge_thresholds : tuple of float
        tau_x: two tracks whose states differ by less are one; the better supported stays.
    ownship_test : {"polar", "states", "chi_square"}
        Ratio of scans in which the telemetry is an inlier in range and angles (4.2), or in the states within
        `ownship_thresholds`; or the mean of the last normalised squared differences per degree of freedom.
    ownship_thresholds : tuple of float
    ownship_limit : float
        Ratio above which, or mean below which, a track is the ownship's.
    ownship_position_sigma_m, ownship_velocity_sigma_mps : float
        Of the telemetry; for the chi-square.
    report_in_sight_only : bool
        Whether a track is answered (as confirmed) and missed only where the radar could see it; out of sight it lasts
        `gap_max_s`.
    late_max_s, gap_max_s : float
        A scan older than the last is left out; one older by more than the first, or later by more than the second,
        starts the tracker anew.
    """

    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {}

    preset: Literal["thesis", "robust", "flight_test"] = "thesis"
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    model: Literal["constant_acceleration", "constant_velocity"] = "constant_acceleration"
    dimensions: Literal[2, 3] = 3
    known_altitude_m: float = 0.0
    altitude_sigma_m: NotNegative = 10.0
    azimuth: Literal["plane", "cone"] = "plane"
    window_scans: Annotated[int, Field(ge=3, le=1000)] = 50
    stored_tracks: Annotated[int, Field(ge=1, le=1000)] = 10
    plots_per_scan_max: Annotated[int, Field(ge=1, le=1000)] = 64
    range_sigma_m: Positive = 0.4
    azimuth_sigma_deg: Positive = 1.0
    elevation_sigma_deg: Positive = 1.0
    gate: Literal["thresholds", "mahalanobis"] = "thresholds"
    gate_sigmas: Three = (2.5, 2.5, 2.5)
    gate_mahalanobis: Positive = 4.0
    update: Literal["pseudo_measurement", "tangent", "polar", "unscented"] = "pseudo_measurement"
    unscented_scaling: tuple[Positive, NotNegative, NotNegative] = (0.5, 2.0, 0.0)
    pseudo_variance_m2: Three = (1e-2, 1e-2, 1e-2)
    weighting: Literal["mean", "nearest"] = "mean"
    process_noise_per_s: NineNoises = (1e-4, 1e-4, 1e-5, 1e-4, 1e-4, 1e-5, 1e-4, 1e-4, 1e-5)
    noise_density: tuple[NotNegative, NotNegative, NotNegative] = (0.0, 0.0, 0.0)
    ransac_iterations: Annotated[int, Field(ge=1, le=10_000)] = 100
    hypothesis_sigmas: Three = (2.5, 2.5, 2.5)
    stop_ratio: Annotated[float, Field(gt=0.0, le=1.0)] = 0.8
    consensus_ratio: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    births_from: Literal["all", "unassociated"] = "all"
    speed_max_mps: Positive | None = None
    covariance_inflation: Annotated[float, Field(ge=1.0)] = 1.0
    begin_ratio: Annotated[float, Field(ge=0.0, le=1.0)] = 0.6
    end_ratio: Annotated[float, Field(ge=0.0, le=1.0)] = 0.6
    lifetime_scans: Annotated[int, Field(ge=0)] | None = 40
    misses_max: Annotated[int, Field(ge=1)] = 15
    merge_thresholds: Nine = (10.0, 10.0, 10.0, 3.0, 3.0, 3.0, 1.0, 1.0, 1.0)
    ownship_test: Literal["polar", "states", "chi_square"] = "polar"
    ownship_thresholds: Six = (20.0, 20.0, 20.0, 10.0, 10.0, 10.0)
    ownship_limit: Positive = 0.2
    ownship_position_sigma_m: NotNegative = 1.0
    ownship_velocity_sigma_mps: NotNegative = 0.3
    report_in_sight_only: bool = False
    late_max_s: NotNegative = 1.0
    gap_max_s: Positive = 5.0

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, given: Any) -> Any:
        if not isinstance(given, Mapping):
            return given
        preset = given.get("preset", cls.model_fields["preset"].default)
        return {**cls.presets.get(preset, {}), **given} if isinstance(preset, str) else given

    @property
    def hears(self) -> frozenset[str]:
        """Which kinds of scan can be taken: a line array says where an aircraft is only with a known altitude."""
        return frozenset({"radar", "radar_cone"} if self.dimensions == 2 else {"radar"})

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.end_ratio > self.begin_ratio:
            raise ValueError(f"end_ratio {self.end_ratio:g} must not be above begin_ratio {self.begin_ratio:g}")
        if self.update == "unscented" and self.dimensions == 2:
            raise ValueError("update must not be unscented in two dimensions: a known altitude has no sigma points")
        if self.ownship_test != "chi_square" and self.ownship_limit >= 1.0:
            raise ValueError(f"ownship_limit {self.ownship_limit:g} is a ratio below 1 with this ownship_test")
        return self


_ROBUST_LIFE = {
    "gate": "mahalanobis",
    "gate_mahalanobis": 5.0,
    "update": "tangent",
    "weighting": "nearest",
    "process_noise_per_s": (0.0,) * 9,
    "window_scans": 15,
    "stored_tracks": 50,
    "ransac_iterations": 20,
    "hypothesis_sigmas": (4.0, 3.0, 3.0),
    "stop_ratio": 1.0,
    "consensus_ratio": 0.26,
    "births_from": "unassociated",
    "speed_max_mps": 100.0,
    "covariance_inflation": 100.0,
    "begin_ratio": 0.26,
    "end_ratio": 0.0,
    "lifetime_scans": None,
    "misses_max": 8,
    "ownship_test": "chi_square",
    "ownship_limit": 4.0,
    "report_in_sight_only": True,
}
_TABLE_4_5: Mapping[str, Any] = {}  # the defaults of the fields
_TABLE_5_3 = {
    "dimensions": 2,
    "azimuth": "cone",
    "stored_tracks": 20,
    "gate_sigmas": (1.0667, 4.0, 4.0),  # 0.4267 m and 4 deg
    "hypothesis_sigmas": (1.0667, 4.0, 4.0),
    "ransac_iterations": 5,
    "pseudo_variance_m2": (0.1, 0.1, 0.1),
    "process_noise_per_s": (1e-2, 1e-2, 0.0, 1.666e-2, 1.666e-2, 0.0, 2e-4, 2e-4, 0.0),
    "merge_thresholds": (5.0, 5.0, _FREE, 0.8, 0.8, _FREE, 1.0, 1.0, _FREE),
    "begin_ratio": 0.3,
    "end_ratio": 0.3,
    "lifetime_scans": 30,
    "misses_max": 40,
    "ownship_thresholds": (7.0, 7.0, _FREE, 0.8, 0.8, _FREE),
}
_ROBUST_LINEAR = {
    **_ROBUST_LIFE,
    "model": "constant_velocity",
    "noise_density": (1e-4, 1e-4, 1e-4),
    "merge_thresholds": (15.0, 15.0, 15.0, 5.0, 5.0, 5.0, _FREE, _FREE, _FREE),
}
RransacConfig.presets = {"thesis": _TABLE_4_5, "robust": _ROBUST_LINEAR, "flight_test": _TABLE_5_3}


class RransacArticleConfig(RransacConfig):
    """R-RANSAC with the six states, position and velocity, of the article (section III.B).

    The article prints this model (and calls it one of constant acceleration) but no parameters: those of the thesis.
    """

    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "thesis": {"model": "constant_velocity"},
        "robust": _ROBUST_LINEAR,
        "flight_test": {**_TABLE_5_3, "model": "constant_velocity"},
    }


_TABLES_3_3_TO_3_5 = {
    "window_scans": 150,
    "stored_tracks": 10,
    "gate_sigmas": (17.5, 3.5, 3.5),
    "begin_ratio": 0.4,
    "end_ratio": 0.3,
    "consensus_ratio": 0.3,
    "lifetime_scans": 20,
    "misses_max": 15,
    "process_noise_per_s": (1e-4, 1e-4, 1e-2, 1e-2, 1e-2, 5e-4, 9e-4, 1e-3, 1e-5),
    "merge_thresholds": (10.0, 10.0, 10.0, 3.0, 0.5 * _DEG, 0.5 * _DEG, 1.0, 0.3 * _DEG, 0.3 * _DEG),
    "ransac_iterations": 10,
    "stop_ratio": 0.8,
    "hypothesis_sigmas": (2.5, 2.5, 2.5),
    "update": "polar",
}
_ROBUST_TURNING = {
    **_ROBUST_LIFE,
    "hypothesis": "lower_order",
    "window_scans": 20,
    "consensus_ratio": 0.25,
    "begin_ratio": 0.25,
    "covariance_inflation": 4.0,
    "step_limits": (1000.0, 1000.0, 1000.0, 50.0, 1.0, 0.5, 2.0, 0.3, 0.3),
    "step_tolerance": 1e-3,
    "step_count_max": 12,
    "noise_density": (0.1, 1e-3, 3e-4),
    "rate_sigmas": (1.0, 8.0 * _DEG, 3.0 * _DEG),
    "merge_thresholds": (15.0, 15.0, 15.0, 5.0, 0.7, 0.7, _FREE, _FREE, _FREE),
}


class ErRransacConfig(RransacConfig):
    """ER-RANSAC: the turning model (3.48) with an EKF, and Gauss-Newton hypotheses (thesis 3.2.3, 3.3).

    Keys as of `RransacConfig`, in the states of the turning model: position (m), speed (m/s), course and flight path
    angle (rad), and their rates; `noise_density` is that of the rates' derivatives. `model` is not used.

    Attributes
    ----------
    preset : {"thesis", "robust"}
        ``"thesis"``: tables 3.3 to 3.5.
    hypothesis : {"turning", "linear", "lower_order"}
        What RANSAC fits: the turning model by Gauss-Newton; constant acceleration, turned into a turning state; or
        constant velocity, the rates set to zero (the two hybrids of thesis 6.2.2).
    step_limits : tuple of float
        tau_dx of (3.43), table 3.5.
    rate_sigmas : tuple of float or None
        Prior standard deviations of the rates about zero in the fit, m/s2, rad/s, rad/s; None, as printed: no prior.
    step_tolerance : float
        tau_GN.
    step_count_max : int
        l_GN.
    """

    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"thesis": _TABLES_3_3_TO_3_5, "robust": _ROBUST_TURNING}

    preset: Literal["thesis", "robust"] = "thesis"
    hypothesis: Literal["turning", "linear", "lower_order"] = "turning"
    step_limits: Nine = (1000.0, 1000.0, 1000.0, 50.0, 20 * _DEG, 5 * _DEG, 0.2, _DEG, _DEG)
    rate_sigmas: Three | None = None
    step_tolerance: Positive = 1e-10
    step_count_max: Annotated[int, Field(ge=1, le=1000)] = 30

    @model_validator(mode="after")
    def _three_dimensions(self) -> Self:
        if self.dimensions != 3:
            raise ValueError("dimensions must be 3: the turning model has no form for a known altitude")
        return self
