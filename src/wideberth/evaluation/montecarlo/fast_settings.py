"""From an experiment to the arrays of the fast tier."""

import math

import numpy as np

from wideberth.avoidance import decision_kernels as dk
from wideberth.avoidance import kernels as rk
from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.local_level import LocalLevelPlanner, new_memory, settings_of
from wideberth.conflict import alarm_kernels as ak
from wideberth.conflict.detection import DetectionRules
from wideberth.conflict.well_clear import PRESETS
from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import encounter_kernels as ek
from wideberth.evaluation.montecarlo import geometry_kernels as gk
from wideberth.evaluation.montecarlo import judge_kernels as jk
from wideberth.evaluation.montecarlo import sensing_kernels as sk
from wideberth.evaluation.montecarlo import separation_kernels as pk
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.sensors.adsb.accuracy import NORMAL_95_ONE_SIDED, measurement_covariance
from wideberth.sensors.adsb.config import AdsbErrorConfig
from wideberth.sensors.adsb.simulated import SimulatedAdsb, error_parameters
from wideberth.tracking import life_kernels as lk
from wideberth.tracking.adsb_aircraft import REJECT_MEMORY_SECONDS, SPEED_SIGMA_UNKNOWN, accuracy_of
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.filter_bank import transition_tables
from wideberth.types import FloatArray, SourceInfo
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT, NAUTICAL_MILE
from wideberth.vehicles import kernels as vk
from wideberth.vehicles.point_mass import PointMass, parameters

_PARTS = {"ownship": PointMass, "sensor": SimulatedAdsb, "tracker": AdsbKalmanTracker, "avoidance": LocalLevelPlanner}


def check_parts(experiment: Experiment) -> None:
    """Refuse an experiment whose parts the fast tier does not have, or whose ownship cannot fly.

    Raises
    ------
    InputError
    """
    for name, part in _PARTS.items():
        chosen = getattr(experiment.scenario, name)
        if chosen.target is not part:
            raise InputError(
                f"{name}.kind: the fast tier has no '{chosen.kind}'; fly its encounters with `run --encounter`"
            )
    vehicle = experiment.scenario.ownship.config
    speed = experiment.encounter.ownship_speed_kt * KNOT
    if not vehicle.speed_min_mps <= speed <= vehicle.speed_max_mps:
        raise InputError(
            f"encounter.ownship_speed_kt: {speed:.1f} m/s is not between the ownship's speed_min_mps"
            f" {vehicle.speed_min_mps:g} and speed_max_mps {vehicle.speed_max_mps:g}"
        )


def planner_memory(experiment: Experiment) -> dk.Memory:
    """Return the memory of a planner that has decided nothing yet."""
    config: LocalLevelConfig = experiment.scenario.avoidance.config
    return new_memory(config, parameters(experiment.scenario.ownship.config))


def run_settings(experiment: Experiment) -> ek.RunSettings:
    """Return what the kernels need of an experiment.

    Raises
    ------
    InputError
        If the fast tier does not have its parts.
    """
    check_parts(experiment)
    scenario, encounter = experiment.scenario, experiment.encounter
    altitude = encounter.ownship_altitude_m
    decision = scenario.avoidance.config.decision_period_s
    speed = encounter.ownship_speed_kt * KNOT
    vehicle = parameters(scenario.ownship.config)
    planner = settings_of(scenario.avoidance.config, vehicle)
    scoring = scoring_array(experiment)
    reach, reach_time = _reach(planner, scoring, float(vehicle[vk.P_SPEED_MAX]))
    return ek.RunSettings(
        geometry=geometry_array(experiment),
        sensing=_sensing(scenario.sensor.config, scenario.tracker.config),
        planner=planner,
        scoring=scoring,
        mission=np.array([[0.0, 0.0, -altitude], [mission_length(experiment), 0.0, -altitude]]),
        mission_speeds=np.full(2, speed),
        steps=round(encounter.duration_s / ek.STEP),
        decision_steps=max(1, math.ceil(decision / ek.STEP - 1e-5)),
        reach=reach,
        reach_time=reach_time,
    )


def _reach(planner: dk.Settings, scoring: FloatArray, own_speed: float) -> tuple[float, float]:
    """Return beyond which distance (m, and s of the intruder's flight) an intruder that moves away cannot matter.

    The planner's bound is that of `predict_intruders`, with the most that a volume is widened by; a tenth is added for
    what a track is wrong by.
    """
    risk, horizon = planner.risk, float(planner.policy[dk.HORIZON])
    widest = risk[rk.OUTER_RADIUS] * (1.0 + risk[rk.SIGMA_CAP]) + risk[rk.GROWTH_H] * risk[rk.GROWTH_TIME]
    tau = rk.MARGIN_MAX * risk[rk.OUTER_TAU]
    fixed = rk.MARGIN_MAX * widest + own_speed * (tau + horizon)
    sizes = scoring[jk.SIZES :]
    radii = (scoring[0], scoring[3], scoring[jk.OTHER_RULES + 3], sizes[pk.LOSS_DTHR], sizes[pk.RADIUS])
    scored = float(max(radii))
    return 1.1 * max(fixed, scored), 1.1 * (tau + horizon)


def mission_length(experiment: Experiment) -> float:
    """Return how far the ownship's mission leads north, m: farther than a run."""
    encounter = experiment.encounter
    return 2.0 * encounter.ownship_speed_kt * KNOT * encounter.duration_s + 50e3


def geometry_array(experiment: Experiment) -> FloatArray:
    """Return the parameters of `geometry_kernels`."""
    encounter = experiment.encounter
    geometry = np.zeros(gk.N_GEOMETRY)
    geometry[gk.RADIUS], geometry[gk.POINTS] = encounter.circle_nmi * NAUTICAL_MILE, encounter.points
    geometry[gk.OWN_SPEED] = encounter.ownship_speed_kt * KNOT
    geometry[gk.SPEED_MIN] = encounter.intruder_speed_min_kt * KNOT
    geometry[gk.SPEED_MAX] = encounter.intruder_speed_max_kt * KNOT
    geometry[gk.HEIGHT_OFFSET] = encounter.altitude_offset_ft * FOOT
    geometry[gk.REDRAW_SPEED] = float(encounter.redraw == "speed_and_heading")
    return geometry


def scoring_array(experiment: Experiment) -> FloatArray:
    """Return what encounters are judged by, as `judge_kernels` lays it out."""
    s = experiment.scoring

    def rules(radius: float, half_height: float) -> FloatArray:
        return DetectionRules(
            s.threshold_radius_m, s.threshold_half_height_m, s.tau_s, radius, half_height, s.lookahead_s, s.m1, s.m2
        ).array()

    loss, astm = PRESETS["sarp"], PRESETS["astm_f3442"]
    scoring = np.zeros(jk.N_SCORING)
    scoring[ak.RULES : ak.NOISE] = rules(s.volume_radius_m, s.volume_half_height_m)
    scoring[ak.NOISE : ak.EARLY] = (
        s.position_sigma_m,
        s.velocity_sigma_mps,
        s.altitude_sigma_m,
        s.climb_rate_sigma_mps,
    )
    scoring[ak.EARLY] = math.log10((s.early_alarm_probability or s.alarm_probability) / s.alarm_probability)
    scoring[ak.EARLY_TIME] = s.early_alarm_s
    scoring[jk.OTHER_RULES : jk.THRESHOLDS] = rules(s.other_radius_m, s.other_half_height_m)
    thresholds = scoring[jk.THRESHOLDS : jk.SIZES]
    thresholds[ak.SCALE], thresholds[ak.PAPER], thresholds[ak.TRACK] = 1.0, s.m1, s.m1
    thresholds[ak.PROBABILITY] = -math.log10(s.alarm_probability)
    sizes = scoring[jk.SIZES :]
    sizes[pk.RADIUS], sizes[pk.HALF_HEIGHT] = s.violation_radius_m, s.violation_half_height_m
    sizes[pk.AIRCRAFT_RADIUS], sizes[pk.AIRCRAFT_HALF_HEIGHT] = s.aircraft_radius_m, s.aircraft_half_height_m
    sizes[pk.LOSS_DTHR], sizes[pk.LOSS_ZTHR], sizes[pk.LOSS_TTHR] = loss.dthr, loss.zthr, loss.tthr
    sizes[pk.LOSS_TCOA] = loss.tcoa
    sizes[pk.ASTM_RADIUS], sizes[pk.ASTM_HALF_HEIGHT] = astm.dthr, astm.zthr
    return scoring


def _sensing(sensor: AdsbErrorConfig, tracker: AdsbKalmanConfig) -> sk.SensingSettings:
    info = SourceInfo(nacp=sensor.nacp, nacv=sensor.nacv, nic=sensor.nic, sil=sensor.sil, sda=sensor.sda)
    position_sigma, sigma_v, bound = accuracy_of(info, tracker)
    phi, q = transition_tables(tracker)
    noise = sensor.noise
    numbers = np.zeros(sk.N_SENSING)
    numbers[sk.INTERVAL], numbers[sk.JITTER] = sensor.interval_s, sensor.interval_jitter_s
    numbers[sk.STATIONARY] = float(sensor.start == "stationary")
    numbers[sk.DT], numbers[sk.LATENCY], numbers[sk.BOUND] = tracker.step_s, tracker.latency_sigma_s, bound
    numbers[sk.COAST_AFTER], numbers[sk.LOST_AFTER] = tracker.coast_after_s, tracker.lost_after_s
    numbers[sk.TENTATIVE_LOST_AFTER] = tracker.tentative_lost_after_s
    numbers[sk.CLIMB_REGIME] = noise.climb_rate_regime_ft_per_min * FOOT_PER_MINUTE
    numbers[sk.CLIMB_FRACTION_SIGMA] = noise.climb_rate_fraction_95 / NORMAL_95_ONE_SIDED
    numbers[sk.CLIMB_RESOLUTION_VARIANCE] = (noise.climb_rate_resolution_ft_per_min * FOOT_PER_MINUTE) ** 2 / 12.0
    track = np.zeros(lk.N_SETTINGS)
    track[lk.DT], track[lk.GATE] = tracker.step_s, tracker.gate_mahalanobis
    track[lk.TIME_SIGMA], track[lk.WHOLE_SECOND_SIGMA] = tracker.time_sigma_s, tracker.whole_second_sigma_s
    track[lk.VELOCITY_SIGMA] = math.hypot(sigma_v, tracker.initial_velocity_sigma_mps)
    track[lk.ACCELERATION_SIGMA] = tracker.initial_acceleration_sigma_mps2
    track[lk.JERK_SIGMA] = tracker.initial_jerk_sigma_mps3
    track[lk.SPEED_MAX], track[lk.HOVER_SPEED] = tracker.speed_max_mps, tracker.hover_speed_mps
    track[lk.CONFIRM], track[lk.RESTART_REJECTS] = tracker.confirm_positions, tracker.restart_rejects
    track[lk.REJECT_MEMORY], track[lk.UNKNOWN_SIGMA] = REJECT_MEMORY_SECONDS, SPEED_SIGMA_UNKNOWN
    track[lk.USE_VELOCITY] = float(tracker.use_reported_velocity)
    track[lk.START_REPORTED] = float(tracker.initialise_from_reported_velocity)
    return sk.SensingSettings(
        errors=error_parameters(sensor),
        numbers=numbers,
        variances=measurement_covariance((info,), noise, np.zeros(1))[0].diagonal()[None].copy(),
        phi=phi,
        q=q,
        bias=np.array([position_sigma**2, (tracker.altitude_bias_sigma_ft * FOOT) ** 2]),
        track=track,
    )
