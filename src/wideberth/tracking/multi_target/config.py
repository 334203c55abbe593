"""Settings of the multi-target tracker."""

from pydantic import Field

from wideberth.part_config import PartConfig
from wideberth.tracking.config import OwnshipConfig


class ReportsConfig(PartConfig):
    """What the default tracker makes of ADS-B reports, and how it finds out whose they are.

    Attributes
    ----------
    assumed_nacp : int
        Used where an aircraft has not said its own.
    altitude_bias_sigma_m : float
        Slowly varying part of the altitude error; R has the white part. 23.1 m are the paper's 75.9 ft.
    latency_s, latency_sigma_s : float
        Uncompensated latency expected of an aircraft, and its spread: DO-260B allows 0.6 s.
    time_sigma_s, whole_second_sigma_s : float
        Uncertainty of the time of validity, and of time stamps that are whole seconds, which are taken as rounded.
    gate_mahalanobis : float
        Largest Mahalanobis distance of position, altitude, climb rate and velocity, each by itself.
    initial_velocity_sigma_mps : float
        Added to that of a reported velocity at the start of a track.
    speed_sigma_mps, climb_sigma_mps : float
        Spread of each horizontal component of an unknown velocity, and of an unknown climb rate.
    speed_max_mps : float
        Fastest aircraft that is believed.
    hover_speed_mps : float
        A repeated position is no new position, unless the reported speed is below this.
    confirm_positions : int
        Positions that confirm a track, and after which it is compared with the tracks of radars.
    link_gate : float
        Normalised distance squared (6 degrees of freedom) below which a radar's track may be the aircraft's.
    split_gate : float
        The same above which its track is not the aircraft's.
    lead_odds : float
        Logarithm of the odds by which the best radar track must be better than the next one.
    wait_reports : int
        Reports after which the best one is taken all the same.
    split_reports : int
        Reports in a row that must deny a track's identity.
    late_max_s : float
        Reports later than this are rejected.
    coast_after_s : float
        A track that only reports feed is coasting after this long without a position.
    lost_after_s, tentative_lost_after_s : float
        A track (a tentative one) that only reports feed is dropped after this long without a position; a radar's track
        loses the address.
    ownship_radius_m : float
        `traffic_radius_m` of the ownship's test for aircraft that only reports tell of.
    ownship_broadcasts : bool
        Whether the ownship has ADS-B Out, which it may hear back. If it has not, no aircraft that only reports tell of
        is ever taken for it. (14 CFR 107.53 forbids it to small unmanned aircraft.)
    ownship_address : str or None
        Its 24-bit address, six hexadecimal digits: then no other aircraft that reports is taken for it. Better than
        `ownship_broadcasts` alone, with which an aircraft that flies along with the ownship may be.
    addresses_max : int
        Users of addresses that are kept at most; of more, reports are left out and counted.
    """

    assumed_nacp: int = Field(default=8, ge=0, le=11)
    altitude_bias_sigma_m: float = Field(default=23.1, ge=0.0)
    latency_s: float = Field(default=0.3, ge=0.0, le=2.0)
    latency_sigma_s: float = Field(default=0.3, ge=0.0, le=2.0)
    time_sigma_s: float = Field(default=0.06, ge=0.0)
    whole_second_sigma_s: float = Field(default=0.289, ge=0.0)
    gate_mahalanobis: float = Field(default=5.0, gt=0.0)
    initial_velocity_sigma_mps: float = Field(default=2.0, ge=0.0)
    speed_sigma_mps: float = Field(default=120.0, gt=0.0)
    climb_sigma_mps: float = Field(default=8.0, gt=0.0)
    speed_max_mps: float = Field(default=350.0, gt=0.0)
    hover_speed_mps: float = Field(default=1.5, ge=0.0)
    confirm_positions: int = Field(default=3, ge=2)
    link_gate: float = Field(default=22.5, gt=0.0)
    split_gate: float = Field(default=35.0, gt=0.0)
    lead_odds: float = Field(default=4.6, ge=0.0)
    wait_reports: int = Field(default=8, ge=0)
    split_reports: int = Field(default=3, ge=1)
    late_max_s: float = Field(default=3.0, ge=0.0)
    coast_after_s: float = Field(default=3.0, gt=0.0)
    lost_after_s: float = Field(default=60.0, gt=0.0)
    tentative_lost_after_s: float = Field(default=15.0, gt=0.0)
    ownship_radius_m: float = Field(default=250.0, gt=0.0)
    ownship_broadcasts: bool = False
    ownship_address: str | None = Field(default=None, pattern="^[0-9a-fA-F]{6}$")
    addresses_max: int = Field(default=12_000, ge=1)


class MultiTargetConfig(PartConfig):
    """The default radar tracker. The defaults are meant for every scene: sensors say themselves how well they see.

    Odds are natural logarithms of odds. "Scans" are of one sensor; with more sensors there are as many times more.

    Attributes
    ----------
    straight_noise_m2_per_s3 : float
        Spectral density of the acceleration of an aircraft that flies straight.
    straight_s : float
        How long straight flight lasts on average, before the tracker has seen how often aircraft maneuver here.
    gentle_acceleration_mps2, hard_acceleration_mps2 : float
        Spread of each component of the acceleration at the beginning of a gentle and of a hard maneuver.
    gentle_jerk_m2_per_s5, hard_jerk_m2_per_s5 : float
        Spectral density of the jerk in them.
    gentle_s, hard_s : float
        How long they last on average.
    maneuver_share : float
        Probability of each of the two at birth.
    least_mix : float
        Hypotheses do not take over from one another what is less likely than this.
    least_report : float
        Hypotheses less likely than this are left out of the reported state and covariance.
    survival_s : float
        How long aircraft stay on average.
    gate : float
        Largest normalised distance squared of a plot from a track.
    event_limit : int
        Clusters of tracks with more joint events than this are shared out approximately.
    birth_per_scan : float
        New aircraft expected in a scan.
    window_scans, pair_scans : int
        Scans in which a new track may have its plots, and in which the nearest older plot must lie.
    window_plots : int
        Plots that no track explains which are kept of a scan; of more, every so many-th.
    consensus_budget : int
        Pairs of plots that are fitted in a scan at most.
    speed_max_mps, speed_sigma_mps : float
        Fastest aircraft, and spread of each component of the velocity before it is known.
    least_hits, confirm_hits : int
        Plots that a tentative and a confirmed track need.
    tentative_odds, confirm_odds, drop_tentative_odds, drop_confirmed_odds : float
        Of existence: where a track begins, is confirmed, and is dropped.
    existence_max : float
        No track is surer than this.
    coast_after_s : float
        A confirmed track without a plot for this long is coasting; one outside every field of view is at once.
    outside_s : float
        A confirmed track is dropped after this long outside every field of view.
    silent_s : float
        All tracks are dropped after this long without any scan.
    spread_max_m : float
        Tracks less certain than this are dropped.
    merge_gate : float
        Tracks that share plots and whose normalised distance squared (6 degrees of freedom) is less are one aircraft.
    clutter_scans : float
        Scans over which the number of false plots is averaged.
    late_max_s : float
        Scans later than this are rejected; up to it they are put in their place and what followed is run again.
    sensor_speed_max_mps : float
        A sensor that moves faster has jumped: its scans are rejected until three agree on the new place.
    assumed_detection_probability, assumed_range_max_m : float
        Of a sensor that does not say them.
    known_altitude_m : float or None
        Altitude of all aircraft (thesis section 5.3), above the origin of NED, in place of the elevation that a 2-D
        radar does not give. None: their height is not known, and each track keeps the height of the field of view as
        its uncertainty.
    known_altitude_sigma_m : float
        Spread about it.
    ownship : OwnshipConfig
        How the ownship's own track is told by telemetry.
    reports : ReportsConfig
        ADS-B.
    """

    straight_noise_m2_per_s3: float = Field(default=1e-7, gt=0.0)
    straight_s: float = Field(default=100.0, gt=0.0)
    gentle_acceleration_mps2: float = Field(default=0.3, gt=0.0)
    hard_acceleration_mps2: float = Field(default=2.0, gt=0.0)
    gentle_jerk_m2_per_s5: float = Field(default=0.001, gt=0.0)
    hard_jerk_m2_per_s5: float = Field(default=0.05, gt=0.0)
    gentle_s: float = Field(default=15.0, gt=0.0)
    hard_s: float = Field(default=15.0, gt=0.0)
    maneuver_share: float = Field(default=0.1, gt=0.0, lt=0.5)
    least_mix: float = Field(default=0.01, ge=0.0, lt=0.3)
    least_report: float = Field(default=0.003, ge=0.0, lt=0.3)
    survival_s: float = Field(default=1000.0, gt=0.0)
    gate: float = Field(default=18.0, gt=0.0)
    event_limit: int = Field(default=5000, ge=1, le=1_000_000)
    birth_per_scan: float = Field(default=0.01, gt=0.0)
    window_scans: int = Field(default=15, ge=3, le=100)
    pair_scans: int = Field(default=5, ge=1)
    window_plots: int = Field(default=256, ge=1, le=4096)
    consensus_budget: int = Field(default=2000, ge=1)
    speed_max_mps: float = Field(default=100.0, gt=0.0)
    speed_sigma_mps: float = Field(default=30.0, gt=0.0)
    least_hits: int = Field(default=3, ge=2)
    confirm_hits: int = Field(default=4, ge=2)
    tentative_odds: float = 0.0
    confirm_odds: float = 11.0
    drop_tentative_odds: float = -3.0
    drop_confirmed_odds: float = -7.0
    existence_max: float = Field(default=1.0 - 1e-5, gt=0.5, lt=1.0)
    coast_after_s: float = Field(default=1.0, gt=0.0)
    outside_s: float = Field(default=10.0, ge=0.0)
    silent_s: float = Field(default=30.0, gt=0.0)
    spread_max_m: float = Field(default=2000.0, gt=0.0)
    merge_gate: float = Field(default=4.0, ge=0.0)
    clutter_scans: float = Field(default=30.0, ge=1.0)
    late_max_s: float = Field(default=0.5, ge=0.0)
    sensor_speed_max_mps: float = Field(default=400.0, gt=0.0)
    assumed_detection_probability: float = Field(default=0.8, gt=0.0, lt=1.0)
    assumed_range_max_m: float = Field(default=2000.0, gt=0.0)
    known_altitude_m: float | None = None
    known_altitude_sigma_m: float = Field(default=10.0, gt=0.0)
    ownship: OwnshipConfig = OwnshipConfig()
    reports: ReportsConfig = ReportsConfig()
