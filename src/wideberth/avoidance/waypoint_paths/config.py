"""Configuration of the A* and chain planners, with the thesis's tables 4.4 and 5.2 as presets."""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from wideberth.avoidance.keep_out.config import KeepOut
from wideberth.part_config import PartConfig

# Thesis tables 4.4 and 5.2, with the volumes, thresholds and grids of their scenarios. What they leave open has the
# defaults below.
PRESETS: dict[str, dict[str, Any]] = {
    "table_4_4": {
        "separation_radius_m": 153.0,
        "separation_height_m": 61.0,
        "detection_distance_m": 800.0,
        "detection_time_s": 25.0,
        "cell_m": 100.0,
        "cell_height_m": 50.0,
        "constant_altitude": False,
        "costs": {"k_dist": 100.0, "k_alt": 559.0, "k_max": 1e6, "varrho": 2.3, "k_r": 500.0},
        "forces": {
            "k": 2.5,
            "k_sh": 200.0,
            "k_sv": 200.0,
            "kappa": 2.5,
            "b": 4.0,
            "theta_max_deg": 45.0,
            "limit_gain": 20.0,
            "gamma_max_deg": 30.0,
            "f_max": 20.0,
            "delta_1": 2.3,
            "delta_2": 2.639,
        },
    },
    "table_5_2": {
        "separation_radius_m": 10.0,
        "separation_height_m": 10.0,
        "detection_distance_m": 100.0,
        "detection_time_s": 10.0,
        "cell_m": 10.0,
        "cell_height_m": 5.0,
        "constant_altitude": True,
        "altitude_min_m": 0.0,
        "costs": {"k_dist": 10.0, "k_alt": 56.0, "k_max": 1e8, "varrho": 4.0, "k_r": 1000.0, "k_cpa": 5.0},
        "forces": {
            "k": 1.0,
            "k_sh": 10.0,
            "k_sv": 0.0,
            "kappa": 2.0,
            "b": 2.0,
            "theta_max_deg": 45.0,
            "limit_gain": 20.0,
            "gamma_max_deg": 30.0,
            "f_max": 50.0,
            "delta_1": 4.0,
            "delta_2": 2.639,
        },
    },
}


class AStarCosts(PartConfig):
    """Costs of an edge of the grid (thesis 4.4, article eqs. 11-13; errata, "A*/chain planner").

    Attributes
    ----------
    k_dist : float
        Of a level step of one cell (c_d).
    k_alt : float
        Of a step one cell ahead and one level up or down (c_d).
    k_max : float
        Of an edge inside a collision cylinder, by the share of its time (c_t).
    k_r, varrho : float
        At the edge of the cylinder, falling to zero at varrho times its radius (c_t).
    k_n : float
        Of being one cell (level) off the straight line to the goal (c_n).
    k_cpa : float
        Of a closest point of approach at 1 m in 1 s (c_cpa, eq. 4.15).
    k_v : float
        Of flying the intruder's way, per (m/s)^2 at 1 s (c_v, eq. 4.16).
    k_left : float
        Of an eighth of a turn to the left: among equals, turn right.
    """

    k_dist: float = Field(100.0, gt=0)
    k_alt: float = Field(559.0, gt=0)
    k_max: float = Field(1e6, ge=0)
    k_r: float = Field(500.0, ge=0)
    varrho: float = Field(2.3, gt=1)
    k_n: float = Field(1.0, ge=0)
    k_cpa: float = Field(500.0, ge=0)
    k_v: float = Field(0.05, ge=0)
    k_left: float = Field(1.0, ge=0)


class ChainForces(PartConfig):
    """Forces on the unit masses of the chain (thesis 4.4; errata, "A*/chain planner").

    Attributes
    ----------
    k, b : float
        Spring and damper of a link.
    rest_length_m : float, optional
        Length of a link at rest; the cell by default.
    kappa : float
        Straightens the chain.
    k_sh, k_sv : float
        Push away from an intruder, horizontally and vertically.
    k_b : float
        Push behind an intruder (F_b, eq. 4.17).
    delta_1, delta_2 : float
        Reach of all three, in radii and half-heights of the collision cylinder.
    f_max : float
        Most of them together.
    theta_max_deg, gamma_max_deg, limit_gain : float
        Turn and slope beyond which a mass is pushed back, and how hard a radian (lambda).
    step_s, settled_mps, steps_max : float
        Integration: its step, the speed at which the chain has settled, and the most steps.
    """

    k: float = Field(2.5, ge=0)
    b: float = Field(4.0, ge=0)
    rest_length_m: float | None = Field(None, gt=0)
    kappa: float = Field(2.5, ge=0)
    k_sh: float = Field(200.0, ge=0)
    k_sv: float = Field(200.0, ge=0)
    k_b: float = Field(25.0, ge=0)
    delta_1: float = Field(2.3, gt=1)
    delta_2: float = Field(2.639, gt=1)
    f_max: float = Field(20.0, ge=0)
    theta_max_deg: float = Field(45.0, gt=0, le=180)
    gamma_max_deg: float = Field(30.0, gt=0, lt=90)
    limit_gain: float = Field(20.0, ge=0)
    step_s: float = Field(0.05, gt=0, le=0.2)
    settled_mps: float = Field(0.05, gt=0)
    steps_max: int = Field(400, ge=1, le=10_000)


class AStarConfig(PartConfig):
    """A* in space and time and the waypoint control function around it (thesis 4.4).

    Attributes
    ----------
    preset : str
        The table of the thesis from which the values come that are not given here.
    separation_radius_m, separation_height_m : float
        Collision cylinder about an intruder: radius d_s and full height h_s.
    plan_margin, trigger_margin : float
        The cylinder is so much larger for the search, and for what counts as a conflict.
    plan_sigmas, plan_sigma_cap, plan_height_sigma_cap : float
        Paths also keep clear by so many standard deviations of where the intruder will be as it passes (in
        `decide_by_s` seconds if it goes away now), at most by so much of the cylinder's radius and half-height: what is
        learned on the way then seldom closes the path. The second of four searches keeps half of it, the last two none.
    sigmas, sigma_cap : float
        Standard deviations of a track's position that widen the cylinder, and at most so much of it.
    detection_distance_m, detection_height_m, detection_time_s : float
        A conflict counts where the intruder is this near now, or the cylinder is entered this soon (d_th, tau_th).
    detections_needed : int
        N_col: so many consecutive detections begin a maneuver, or replace it.
    known_share, decide_by_s : float
        An entry later than `decide_by_s` counts only once its place is known within this share of the cylinder's radius
        and half-height (one standard deviation): the velocities of young tracks are too poor to choose a side by. For
        one that is avoided already it is `urgent_s` instead.
    decision_period_s : float
        Time between decisions.
    settle_s, urgent_s : float
        A new maneuver is not replaced for so long, unless a cylinder is entered within `urgent_s`.
    replace_share : float
        A maneuver flagged as the least bad is replaced by a path of another sense that is not free only if that is in
        cylinders for at most so much of the time.
    return_after_s : float
        A maneuver ends early once the straight way back to the mission has been free for so long.
    cell_m, cell_height_m : float
        Least size of a cell, and the size of a level. Cells grow where the ownship cannot turn within one, levels
        shrink where it cannot climb one within a cell.
    reach_cells, aside_cells, levels : int
        How far the grid goes ahead, to either side, and up and down.
    time_bin : float
        Width of a bin of arrival times, in times of a level step.
    expansions_max, distances_max : int
        Nodes of the searches for one goal, and looks at intruders of one search; then the best path so far is taken.
    work_max : int
        Most work of one decision: its searches, chains, refinements and judgements together, in looks at an intruder
        from a place, some 20 ns each. They take shares of what is left (`work`, `path_planner`), and stop where they
        are.
    length_ratio_max : float
        A path longer than so many times the direct way is searched again with a tenth of k_r, then with none, and the
        first that is free and shorter is taken. During a maneuver a longer one is replaced by a much shorter one.
    intruders_max : int
        Only so many are looked at, the soonest ones.
    constant_altitude : bool
        Plan in one level, and leave heights out of it: everybody is taken as at the ownship's altitude (thesis 5.3).
    turn_hypothesis, climb_hypothesis_mps : bool, float
        Also expect that a turn seen now goes on for `turn_time_s`; that an intruder begins to climb or sink so fast.
    climb_sigmas, doubt_share : float
        Paths also keep clear of a climb rate so many standard deviations higher and lower, while the height in
        `decide_by_s` seconds is not known within `doubt_share` of the half-height. They are
        no conflict that begins a maneuver.
    climb_significance : float
        Paths also keep clear of an intruder that flies level, as long as its climb rate is not so many standard
        deviations: young tracks are farther off than they say, and most aircraft fly level. No conflict either.
    level_hypothesis : bool
        Also expect that an intruder that climbs or sinks levels off: climb rates are the least that tracks know.
    turn_significance, turn_time_s : float
        Standard deviations of lateral acceleration that make a turn believed.
    tentative : bool
        Avoid tentative tracks too.
    ghost_s : float
        A lost aircraft, or one whose track is not finite, is avoided for so long where it would be.
    altitude_min_m, altitude_max_m : float
        No maneuver goes below or above.
    keep_out : list
        Volumes that no maneuver enters: tables with kind "polygon" or "cylinder".
    keep_out_margin_m : float
        Horizontal distance kept from them.
    bank_share, climb_share : float
        Share of the vehicle's bank, climb and sink that plans use.
    """

    preset: Literal["table_4_4", "table_5_2"] = "table_4_4"
    separation_radius_m: float = Field(gt=0)
    separation_height_m: float = Field(gt=0)
    plan_margin: float = Field(0.13, ge=0, le=1)
    trigger_margin: float = Field(0.05, ge=0, le=1)
    plan_sigmas: float = Field(1.5, ge=0, le=6)
    plan_sigma_cap: float = Field(0.3, ge=0, le=3)
    plan_height_sigma_cap: float = Field(1.0, ge=0, le=3)
    sigmas: float = Field(0.0, ge=0, le=6)
    sigma_cap: float = Field(0.5, ge=0, le=3)
    detection_distance_m: float = Field(gt=0)
    detection_height_m: float = Field(300.0, gt=0)
    detection_time_s: float = Field(gt=0)
    detections_needed: int = Field(3, ge=1, le=100)
    known_share: float = Field(0.45, gt=0, le=100)
    decide_by_s: float = Field(12.0, ge=0)
    decision_period_s: float = Field(0.1, gt=0, le=10)
    settle_s: float = Field(5.0, ge=0)
    urgent_s: float = Field(10.0, ge=0)
    replace_share: float = Field(0.5, gt=0, le=1)
    return_after_s: float = Field(2.0, ge=0)
    cell_m: float = Field(gt=0)
    cell_height_m: float = Field(gt=0)
    reach_cells: int = Field(16, ge=2, le=60)
    aside_cells: int = Field(8, ge=1, le=60)
    levels: int = Field(3, ge=1, le=10)
    time_bin: float = Field(0.5, gt=0, le=10)
    expansions_max: int = Field(1000, ge=10, le=100_000)
    distances_max: int = Field(150_000, ge=1000, le=100_000_000)
    length_ratio_max: float = Field(1.25, ge=1)
    work_max: int = Field(450_000, ge=50_000, le=1_000_000_000)
    intruders_max: int = Field(32, ge=1, le=1000)
    constant_altitude: bool
    turn_hypothesis: bool = True
    climb_hypothesis_mps: float = Field(0.0, ge=0, le=50)
    climb_sigmas: float = Field(1.5, ge=0, le=6)
    doubt_share: float = Field(0.7, gt=0, le=100)
    climb_significance: float = Field(4.0, ge=0)
    level_hypothesis: bool = False
    turn_significance: float = Field(1.5, ge=0)
    turn_time_s: float = Field(8.0, ge=0)
    tentative: bool = False
    ghost_s: float = Field(10.0, ge=0)
    altitude_min_m: float = 50.0
    altitude_max_m: float = 3000.0
    keep_out: tuple[KeepOut, ...] = ()
    keep_out_margin_m: float = Field(10.0, ge=0)
    bank_share: float = Field(0.8, gt=0, le=1)
    climb_share: float = Field(0.95, gt=0, le=1)
    costs: AStarCosts
    forces: ChainForces

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, given: Any) -> Any:
        """Fill in the preset's values where none are given."""
        if not isinstance(given, dict):
            return given
        preset = PRESETS.get(given.get("preset", "table_4_4"))
        if preset is None:
            return given  # the field's own check names those that there are
        filled = {**preset, **given}
        for table in ("costs", "forces"):
            own = given.get(table, {})
            if isinstance(own, dict):
                filled[table] = {**preset[table], **own}
        return filled

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.altitude_max_m <= self.altitude_min_m:
            raise ValueError("altitude_max_m must be above altitude_min_m")
        if self.trigger_margin > self.plan_margin:
            raise ValueError("trigger_margin must not exceed plan_margin: plans would be conflicts at once")
        return self


class AStarChainConfig(AStarConfig):
    """The same with the chain, which smooths the path of A* and follows the traffic at re-plans."""
