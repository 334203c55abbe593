"""From checked settings to those that the kernels take."""

import math

import numpy as np

from wideberth.tracking.motion_kernels import CONSTANT_ACCELERATION, CONSTANT_VELOCITY, TURNING
from wideberth.tracking.rransac import state_kernels as state
from wideberth.tracking.rransac.config import ErRransacConfig, RransacConfig

_GATES = {"thresholds": state.BOX, "mahalanobis": state.MAHALANOBIS}
_UPDATES = {
    "polar": state.POLAR,
    "pseudo_measurement": state.PSEUDO,
    "tangent": state.TANGENT,
    "unscented": state.UNSCENTED,
}
_WEIGHTINGS = {"mean": state.MEAN, "nearest": state.NEAREST}
_OWN_TESTS = {"polar": state.OWN_POLAR, "states": state.OWN_STATES, "chi_square": state.OWN_CHI_SQUARE}
_MODELS = {
    "constant_velocity": (CONSTANT_VELOCITY, state.FIT_VELOCITY),
    "constant_acceleration": (CONSTANT_ACCELERATION, state.FIT_ACCELERATION),
}
_HYPOTHESES = {
    "turning": state.FIT_TURNING,
    "linear": state.FIT_ACCELERATION,
    "lower_order": state.FIT_VELOCITY,
}


def settings_of(c: RransacConfig) -> state.Settings:
    """Return the settings of the kernels.

    Parameters
    ----------
    c : RransacConfig

    Returns
    -------
    Settings
    """
    model, fit = _MODELS[c.model]
    limits, prior, tolerance, steps = np.full(9, np.inf), np.zeros(9), 1e-10, 30
    if isinstance(c, ErRransacConfig):
        model, fit = TURNING, _HYPOTHESES[c.hypothesis]
        limits, tolerance, steps = np.array(c.step_limits), c.step_tolerance, c.step_count_max
        if c.rate_sigmas is not None:
            prior[6:] = 1.0 / np.square(c.rate_sigmas)

    def scans(ratio: float) -> int:
        return math.ceil(ratio * c.window_scans - 1e-9)

    return state.Settings(
        model=model,
        fit=fit,
        dimensions=c.dimensions,
        altitude=c.known_altitude_m,
        altitude_variance=c.altitude_sigma_m**2,
        cone_azimuth=c.azimuth == "cone",
        seed=c.seed,
        window=c.window_scans,
        tracks=c.stored_tracks,
        plots=c.plots_per_scan_max,
        sigma=np.array([c.range_sigma_m, math.radians(c.azimuth_sigma_deg), math.radians(c.elevation_sigma_deg)]),
        gate=_GATES[c.gate],
        gate_box=np.array(c.gate_sigmas),
        gate_square=c.gate_mahalanobis**2,
        update=_UPDATES[c.update],
        scaling=np.array(c.unscented_scaling),
        weighting=_WEIGHTINGS[c.weighting],
        fixed_variance=np.array(c.pseudo_variance_m2),
        process_per_s=np.array(c.process_noise_per_s),
        spectral=np.array(c.noise_density),
        iterations=c.ransac_iterations,
        birth_box=np.array(c.hypothesis_sigmas),
        enough=scans(c.stop_ratio),
        consensus=scans(c.consensus_ratio),
        unassociated=c.births_from == "unassociated",
        speed_max=c.speed_max_mps or 0.0,
        inflation=c.covariance_inflation,
        begin=scans(c.begin_ratio),
        end=scans(c.end_ratio),
        lifetime=-1 if c.lifetime_scans is None else c.lifetime_scans,
        misses=c.misses_max,
        merge=np.array(c.merge_thresholds),
        own_test=_OWN_TESTS[c.ownship_test],
        own_box=np.array(c.ownship_thresholds),
        own_limit=c.ownship_limit,
        own_variance=np.square([c.ownship_position_sigma_m, c.ownship_velocity_sigma_mps]),
        visible_only=c.report_in_sight_only,
        gn_limits=limits,
        gn_prior=prior,
        gn_tolerance=tolerance,
        gn_iterations=steps,
        late=c.late_max_s,
        gap=c.gap_max_s,
    )
