"""The local-level planner as a part: tracks in, a maneuver with its reason out."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance import decision_kernels as dk
from wideberth.avoidance import graph_kernels as gk
from wideberth.avoidance import kernels as rk
from wideberth.avoidance import planner_kernels as pk
from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.keep_out.volumes import keep_out_arrays
from wideberth.avoidance.maps import MAPS
from wideberth.avoidance.wording import describe_maneuver
from wideberth.types import Maneuver, Mission, Ownship, Threat, Track, TrackStatus
from wideberth.vehicles import kernels as vk

FloatArray = NDArray[np.float64]
_HELD_MAX = 256  # aircraft that a maneuver can be for
_EPSILON = 1e-6  # s, so that a period of 1 s is met by ten steps of 0.1 s


class LocalLevelPlanner:
    """Local-level planner with commitment (ADS-B paper, "Self-separation and collision avoidance").

    Parameters
    ----------
    config : LocalLevelConfig
    vehicle : ndarray
        Parameters of the ownship's point mass (`vehicles.kernels`): its limits shape the map.
    """

    Config = LocalLevelConfig

    def __init__(self, config: LocalLevelConfig, vehicle: FloatArray) -> None:
        self._config = config
        self._settings = settings_of(config, vehicle)
        self._memory = new_memory(config, vehicle)
        self._keys: dict[str, int] = {}
        self._t_decided = -math.inf
        self._maneuver: Maneuver | None = None

    def decide(
        self, t: float, ownship: Ownship, tracks: Sequence[Track], threats: Sequence[Threat], mission: Mission
    ) -> tuple[Maneuver | None, tuple[str, ...]]:
        """Decide what to fly; between decisions the maneuver stays as it is.

        Parameters
        ----------
        t : float
            Now, s.
        ownship : Ownship
        tracks : sequence of Track
        threats : sequence of Threat
            One for every track; used for the words only.
        mission : Mission

        Returns
        -------
        maneuver : Maneuver or None
            None: fly the mission.
        events : tuple of str
            What was decided, in words.
        """
        if t - self._t_decided < self._config.decision_period_s - _EPSILON:
            return self._maneuver, ()
        self._t_decided = t
        others = [track for track in tracks if not track.is_ownship]
        finite = _finite(others)
        usable = list(itertools.compress(others, finite))
        lame = tuple(
            f"track {track.label} is not finite: it cannot be avoided" for track in itertools.compress(others, ~finite)
        )
        m = len(usable)
        x = ground_state(ownship)
        first = np.full(m, math.inf)
        if self._maneuver is None:
            # Only a maneuver remembers aircraft by their numbers; in clutter new tracks come all the time.
            self._keys.clear()
        action = pk.plan(
            t,
            # Copies, as a read-only or strided array would be another type, compiled anew in flight.
            np.array(ownship.position, float),
            np.array(ownship.velocity, float),
            x[5],
            np.array([track.position for track in usable]).reshape(m, 3),
            np.array([track.velocity for track in usable]).reshape(m, 3),
            np.array([track.acceleration for track in usable]).reshape(m, 3),
            np.array([track.covariance for track in usable]).reshape(m, 9, 9),
            np.array([self._keys.setdefault(track.id, len(self._keys)) for track in usable], np.int64),
            np.array([track.status is TrackStatus.TENTATIVE for track in usable], np.bool_),
            mission.waypoints,
            mission.speeds,
            mission.index,
            self._settings,
            self._memory,
            first,
        )
        if action == dk.MISSION or action == dk.RETURN:
            self._maneuver = None
            return None, (*lame, *(("clear of traffic: return to the mission",) if action == dk.RETURN else ()))
        if action == dk.NEW:
            order = sorted(np.flatnonzero(first < math.inf), key=lambda i: (first[i], usable[i].id))
            self._maneuver = self._describe(t, x, [usable[i] for i in order], threats)
            return self._maneuver, (*lame, self._maneuver.reason)
        return self._maneuver, lame

    def _describe(self, t: float, x: FloatArray, involved: Sequence[Track], threats: Sequence[Threat]) -> Maneuver:
        n = int(self._memory.plan[dk.N_POINTS])
        points, times = self._memory.points[:n].copy(), self._memory.times[:n].copy()
        least_bad = self._memory.plan[dk.LEAST_BAD] > 0.0
        ids = tuple(track.id for track in involved)
        if not ids and self._maneuver is not None:
            ids = self._maneuver.threat_ids
        by_id = {threat.track_id: threat for threat in threats}
        first = involved[0] if involved else None
        committed = self._memory.path[: gk.COMMITTED_RINGS]
        courses = [float(rk.wrap(self._memory.labels[node, gk.COURSE] - x[4])) for node in committed]
        reason = describe_maneuver(
            label=first.label if first else None,
            threat=by_id.get(first.id) if first else None,
            others=max(0, len(involved) - 1),
            course_change=max(courses, key=abs),
            height_change=max((float(x[2] - point[2]) for point in points[1 : len(committed) + 1]), key=abs),
            least_bad=least_bad,
        )
        return Maneuver(
            t=t,
            waypoints=points[1:],
            times=times[1:],
            reason=reason,
            valid_until=float(times[-1]),
            threat_ids=ids,
            least_bad=least_bad,
        )


def _finite(tracks: Sequence[Track]) -> NDArray[np.bool_]:
    """Return for each track whether all of its numbers are finite."""
    if not tracks:
        return np.zeros(0, bool)
    # A sum is finite only where all its terms are; one call for all tracks is what makes it cheap.
    states = np.array([[track.position, track.velocity, track.acceleration] for track in tracks])
    covariances = np.array([track.covariance for track in tracks])
    return np.asarray(np.isfinite(states.sum(axis=(1, 2)) + covariances.sum(axis=(1, 2))))


def ground_state(ownship: Ownship) -> FloatArray:
    """Return the ownship as a point-mass state (7,) with ground speed and course for airspeed and heading."""
    vn, ve, vd = ownship.velocity
    attitude = ownship.attitude
    bank = math.atan2(attitude[2, 1], attitude[2, 2])
    return np.array([*ownship.position, math.hypot(vn, ve), math.atan2(ve, vn), bank, -vd])


def settings_of(config: LocalLevelConfig, vehicle: FloatArray) -> dk.Settings:
    """Return what the kernels need of a configuration and the parameters of the ownship's point mass."""
    map_ = MAPS[config.map]()
    ring_start, ring_steps, headings, heights = map_.arrays(config.grid_step_s)
    risk = risk_array(config)
    keep_outs = keep_out_arrays(config.keep_out, config.keep_out_margin_m)
    return dk.Settings(
        vehicle=vehicle,
        free=dk.free_of_capture(vehicle),
        geometry=map_.geometry,
        ring_start=ring_start,
        ring_steps=ring_steps,
        headings=headings,
        heights=heights,
        risk=risk,
        search_risk=printed_risk_array(config) if map_.geometry == gk.RINGS else risk,
        goal_weights=np.array([config.weight_goal, config.weight_goal_vertical]),
        policy=policy_array(config, float(ring_steps.sum()) * config.grid_step_s),
        trigger=trigger_array(config),
        volumes=keep_outs.volumes,
        vertices=keep_outs.vertices,
    )


def new_memory(config: LocalLevelConfig, vehicle: FloatArray) -> dk.Memory:
    """Return the memory of a planner that has decided nothing yet."""
    map_ = MAPS[config.map]()
    rings, nodes = len(map_.rings), map_.node_count - 1
    steps = int(map_.arrays(config.grid_step_s)[1].sum())
    return dk.Memory(
        plan=np.zeros(dk.N_PLAN),
        points=np.zeros((rings + 2, 3)),
        speeds=np.zeros(rings + 2),
        times=np.zeros(rings + 2),
        held=np.zeros(1 + _HELD_MAX, np.int64),
        limits=limits_array(config, vehicle),
        states=np.zeros((dk.STRIDE * steps + 1, 7)),
        labels=np.zeros((nodes, gk.N_LABEL)),
        parent=np.zeros(nodes, np.int64),
        path=np.zeros(rings, np.int64),
        met=np.zeros((3, rk.N_MET)),
    )


def trigger_array(config: LocalLevelConfig) -> FloatArray:
    """Return the rules of the detection that begins a maneuver: the boundary must be crossed now."""
    return np.array(
        [
            config.trigger_radius_m,
            config.trigger_half_height_m,
            config.trigger_tau_s,
            config.trigger_collision_radius_m,
            config.trigger_collision_half_height_m,
            config.trigger_sigmas,
            config.trigger_sigmas,
            1e-3,
        ]
    )


def printed_risk_array(config: LocalLevelConfig) -> FloatArray:
    """Return the risk parameters that leave the paper's two costs: eq. (2), and the sum of the reciprocal distances.

    Instead of infinity an edge inside the collision volume costs so much that it is taken only where all are blocked.
    """
    risk = np.zeros(rk.N_RISK)
    risk[rk.HARD_RADIUS], risk[rk.HARD_HEIGHT] = config.hard_radius_m, config.hard_half_height_m
    risk[rk.INNER_RADIUS] = risk[rk.INNER_HEIGHT] = 1.0
    risk[rk.OUTER_RADIUS] = risk[rk.OUTER_HEIGHT] = 1.0
    risk[rk.WEIGHT_HARD] = 1e6
    # A unit sphere makes the scaled distance one in metres; the weight is then the one at the outer volume's edge.
    risk[rk.WEIGHT_NEAR] = config.weight_near * config.outer_radius_m
    risk[rk.FLOOR], risk[rk.CEILING] = config.altitude_min_m, config.altitude_max_m
    return risk


def risk_array(config: LocalLevelConfig) -> FloatArray:
    """Return the risk parameters of `kernels` for judging flown paths and for the default map."""
    risk = np.zeros(rk.N_RISK)
    risk[rk.HARD_RADIUS], risk[rk.HARD_HEIGHT] = config.hard_radius_m, config.hard_half_height_m
    risk[rk.INNER_RADIUS] = config.buffer * config.inner_radius_m
    risk[rk.INNER_HEIGHT] = config.buffer * config.inner_half_height_m
    risk[rk.OUTER_RADIUS] = config.buffer * config.outer_radius_m
    risk[rk.OUTER_HEIGHT] = config.buffer * config.outer_half_height_m
    risk[rk.OUTER_TAU] = config.buffer * config.outer_tau_s
    risk[rk.SIGMAS], risk[rk.SIGMA_CAP] = config.sigmas, config.sigma_cap
    risk[rk.GROWTH_H], risk[rk.GROWTH_V] = config.growth_horizontal_mps, config.growth_vertical_mps
    risk[rk.GROWTH_TIME] = config.growth_time_s
    risk[rk.WEIGHT_HARD], risk[rk.WEIGHT_INNER] = config.weight_hard, config.weight_inner
    risk[rk.WEIGHT_OUTER], risk[rk.WEIGHT_NEAR] = config.weight_outer, config.weight_near
    risk[rk.FLOOR], risk[rk.CEILING] = config.altitude_min_m, config.altitude_max_m
    risk[rk.TURN_SIGNIFICANCE] = config.turn_significance
    risk[rk.TURN_RATE_MIN] = math.radians(config.turn_rate_min_deg_s)
    risk[rk.TURN_RATE_MAX] = math.radians(config.turn_rate_max_deg_s)
    risk[rk.TURN_TIME], risk[rk.TURN_WEIGHT] = config.turn_time_s, config.turn_belief
    risk[rk.BEYOND] = config.beyond_s
    return risk


def limits_array(config: LocalLevelConfig, vehicle: FloatArray) -> FloatArray:
    """Return the limits of `graph_kernels` from the vehicle's, less the share kept in reserve."""
    limits = np.zeros(gk.N_LIMITS)
    speed = 0.5 * (vehicle[vk.P_SPEED_MIN] + vehicle[vk.P_SPEED_MAX])
    limits[gk.SPEED], limits[gk.SPEED_MAX] = speed, vehicle[vk.P_SPEED_MAX]
    limits[gk.TURN_RATE] = vk.GRAVITY * math.tan(config.bank_share * vehicle[vk.P_BANK_MAX]) / vehicle[vk.P_SPEED_MAX]
    limits[gk.CLIMB_MAX] = config.climb_share * vehicle[vk.P_CLIMB_MAX]
    limits[gk.SINK_MAX] = config.climb_share * vehicle[vk.P_SINK_MAX]
    limits[gk.CLIMB_ACCELERATION] = vehicle[vk.P_VERTICAL_ACCEL_MAX]
    limits[gk.TURN_DELAY] = config.turn_delay_s
    limits[gk.COST_TURN], limits[gk.COST_CLIMB] = config.weight_turn, config.weight_climb
    limits[gk.COST_REVERSAL], limits[gk.COST_LEFT] = config.weight_reversal, config.weight_left
    limits[gk.HEADING_REACH] = math.radians(130.0)
    return limits


def policy_array(config: LocalLevelConfig, horizon: float) -> FloatArray:
    """Return the policy of `decision_kernels`; `horizon` is how far the map reaches, s."""
    policy = np.zeros(dk.N_POLICY)
    policy[dk.DT], policy[dk.TRIGGER] = config.grid_step_s, config.trigger_lookahead_s
    policy[dk.HOLD], policy[dk.CLEAR_TIME] = config.hold_s, config.clear_s
    policy[dk.SWITCH_RATIO], policy[dk.SWITCH_GAIN] = config.switch_ratio, config.switch_gain
    policy[dk.RETURN_MARGIN] = min(rk.MARGIN_MAX, max(1.0, config.return_buffer / config.buffer))
    policy[dk.KEEP_MARGIN] = config.keep_buffer / config.buffer
    policy[dk.RENEW], policy[dk.ESCAPE] = config.renew_s, config.escape_s
    policy[dk.SETTLE] = config.settle_s
    policy[dk.TRIGGER_NOW] = config.trigger_now_s
    policy[dk.TRIGGER_KIND] = dk.ON_DETECTION if config.trigger == "detection" else dk.ON_PATH
    policy[dk.HORIZON], policy[dk.TENTATIVE] = horizon, config.tentative_s
    return policy
