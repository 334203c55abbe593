"""Settings of the trackers."""

from pydantic import Field

from wideberth.part_config import PartConfig


class AdsbKalmanConfig(PartConfig):
    """The Kalman filter for ADS-B reports (ADS-B paper, section "ADS-B Signal Processing").

    A time constant of None is infinite: with both None, and `acceleration_sigma_mps2` giving way to
    `jerk_noise_m2_per_s7`, the model is the constant-jerk one as printed.

    Attributes
    ----------
    step_s : float
        Internal step; reports are put at the nearest.
    acceleration_sigma_mps2, vertical_acceleration_sigma_mps2 : float
        Spread of the acceleration that the model expects of aircraft; sets the noise on the jerk's rate.
    acceleration_time_constant_s, jerk_time_constant_s : float or None
        How fast acceleration and jerk die away; None never (as printed).
    jerk_noise_m2_per_s7 : float
        Spectral density of the noise on the jerk's rate, used where a time constant is None.
    gate_mahalanobis : float
        Largest Mahalanobis distance of horizontal position, of altitude and of climb rate, each by itself.
    use_reported_velocity : bool
        Whether reported horizontal velocities update the filter (the paper ignores them: some are swapped).
    initialise_from_reported_velocity : bool
        Whether a track starts with the reported velocity; if the next positions deny it, it starts again from those.
    initial_velocity_sigma_mps : float
        Added to the NACv's at the start from a reported velocity.
    initial_acceleration_sigma_mps2, initial_jerk_sigma_mps3 : float
    time_sigma_s : float
        Uncertainty of the time of validity (DO-260B lets positions be extrapolated to the nearest 0.2 s).
    whole_second_sigma_s : float
        The same for time stamps that are whole seconds, which are taken as rounded.
    latency_sigma_s : float
        Uncompensated latency as reported uncertainty along the velocity; with 0.5 s the 95 % ellipse holds 90 % of the
        positions even of fast aircraft that all are the allowed 0.6 s behind.
    altitude_bias_sigma_ft : float
        Slowly varying altitude error, part of the reported covariance (0 where the altitude error is taken as white).
    assumed_nacp, assumed_nacv, assumed_nic : int
        Used where an aircraft has not reported its own.
    bound_min_m, bound_max_m : float
        The NIC bound at which a track becomes invalid is kept between these; the least is that of NIC 7, the worst that
        the FAA accepts, as better categories bound the error of a position that is fresh.
    coast_after_s : float
        A confirmed track without an accepted position for this long is coasting.
    lost_after_s, tentative_lost_after_s : float
        A track (a tentative one) without an accepted position for this long is lost, whatever its uncertainty.
    confirm_positions : int
        Accepted positions that confirm a track.
    late_max_s : float
        Reports later than this are rejected; up to it they are put in their place and the filter is run again.
    restart_rejects : int
        Rejected positions, none accepted between, after which a track starts again (3 that agree are enough).
    speed_max_mps : float
        Fastest aircraft that is believed.
    hover_speed_mps : float
        A repeated position is no new position, unless the reported speed is below this.
    """

    step_s: float = Field(default=0.1, gt=0.0, le=1.0)
    acceleration_sigma_mps2: float = Field(default=2.0, gt=0.0)
    vertical_acceleration_sigma_mps2: float = Field(default=0.5, gt=0.0)
    acceleration_time_constant_s: float | None = Field(default=20.0, gt=0.0)
    jerk_time_constant_s: float | None = Field(default=2.0, gt=0.0)
    jerk_noise_m2_per_s7: float = Field(default=1e-3, gt=0.0)
    gate_mahalanobis: float = Field(default=5.0, gt=0.0)
    use_reported_velocity: bool = False
    initialise_from_reported_velocity: bool = True
    initial_velocity_sigma_mps: float = Field(default=5.0, ge=0.0)
    initial_acceleration_sigma_mps2: float = Field(default=2.0, gt=0.0)
    initial_jerk_sigma_mps3: float = Field(default=0.3, gt=0.0)
    time_sigma_s: float = Field(default=0.06, ge=0.0)
    whole_second_sigma_s: float = Field(default=0.289, ge=0.0)
    latency_sigma_s: float = Field(default=0.5, ge=0.0)
    altitude_bias_sigma_ft: float = Field(default=0.0, ge=0.0)
    assumed_nacp: int = Field(default=8, ge=0, le=11)
    assumed_nacv: int = Field(default=1, ge=0, le=4)
    assumed_nic: int = Field(default=7, ge=0, le=11)
    bound_min_m: float = Field(default=370.4, gt=0.0)
    bound_max_m: float = Field(default=1852.0, gt=0.0)
    coast_after_s: float = Field(default=3.0, gt=0.0)
    lost_after_s: float = Field(default=60.0, gt=0.0)
    tentative_lost_after_s: float = Field(default=15.0, gt=0.0)
    confirm_positions: int = Field(default=3, ge=1)
    late_max_s: float = Field(default=3.0, ge=0.0)
    restart_rejects: int = Field(default=5, ge=1)
    speed_max_mps: float = Field(default=350.0, gt=0.0)
    hover_speed_mps: float = Field(default=1.5, ge=0.0)


class OwnshipConfig(PartConfig):
    """How a radar's track of the ownship is told from intruders by telemetry (thesis 4.2; see `ownship_kernels`).

    Attributes
    ----------
    window_s : float
        Time constant of the running mean of the chi-square.
    settle_s : float
        A track is watched for this long before it can be the ownship.
    miss_rate : float
        Chance that telemetry is held not to explain the ownship's own track.
    false_alarm_rate : float
        Chance that another aircraft's track is taken as the ownship, if traffic is spread as set below: with
        `miss_rate` it sets the odds that are asked for, against such traffic and against the next best track. It does
        not hold for an aircraft that flies along with an ownship which has no track: nothing tells the two apart.
    traffic_radius_m : float
        Other traffic is taken as spread evenly over a sphere of this radius around the ownship: smaller is more
        cautious.
    traffic_speed_sigma_mps, traffic_vertical_speed_sigma_mps : float
        Spread of other traffic's velocity about the ownship's, on each horizontal axis and vertically.
    position_sigma_m, altitude_sigma_m, velocity_sigma_mps, vertical_velocity_sigma_mps : float
        Of telemetry, where it comes without a covariance.
    acceleration_sigma_mps2 : float
        What the ownship may do between telemetry and scan.
    stale_after_s : float
        Telemetry older than this is none.
    """

    window_s: float = Field(3.0, gt=0)
    settle_s: float = Field(0.5, ge=0)
    miss_rate: float = Field(1e-4, gt=0, lt=0.5)
    false_alarm_rate: float = Field(3e-4, gt=0, lt=0.5)
    traffic_radius_m: float = Field(50.0, gt=0)
    traffic_speed_sigma_mps: float = Field(10.0, gt=0)
    traffic_vertical_speed_sigma_mps: float = Field(3.0, gt=0)
    position_sigma_m: float = Field(1.5, gt=0)
    altitude_sigma_m: float = Field(3.0, gt=0)
    velocity_sigma_mps: float = Field(0.2, gt=0)
    vertical_velocity_sigma_mps: float = Field(0.3, gt=0)
    acceleration_sigma_mps2: float = Field(2.0, ge=0)
    stale_after_s: float = Field(1.0, gt=0)


class RegistrationConfig(PartConfig):
    """What may be wrong with radars, and how their biases are estimated (`wideberth.tracking.registration`).

    The first nine are standard deviations before anything is known; 0: this is taken as right and not estimated.

    Attributes
    ----------
    range_sigma_m, azimuth_sigma_deg, elevation_sigma_deg : float
        Offsets of the measurements. The elevation of a radar that does not measure it is left out by itself.
    range_scale_sigma : float
        Relative error of the range.
    roll_sigma_deg, pitch_sigma_deg : float
        Tilt of the radar's axes; differs from an elevation offset only for a radar that sees all around.
    position_sigma_m, height_sigma_m : float
        North and east, and down.
    clock_sigma_s : float
    drift_time_constant_h : float
        Biases wander within their standard deviations with this time constant (Gauss-Markov).
    pair_age_s : float
        Plots of two radars this far apart in time are still compared.
    velocity_sigma_mps : float
        Added to the uncertainty of a track's velocity, by which plots are brought to one time.
    track_height_sigma_m : float
        Added to the uncertainty of a track's height, which plots without elevation need: that height has biases in it.
    gate_mahalanobis : float
        Largest Mahalanobis distance of two plots of one aircraft.
    reference_correlation_s : float
        Time constant of the errors of reference positions (satellite navigation errs slowly); 0 takes them as white.
    suspect_window : int
        Comparisons of two radars over which agreement is judged.
    suspect_share : float
        If more than this share of them is beyond the gate, a radar has been moved and its biases start again.
    pose_jump_m, pose_jump_deg : float
        A fixed radar whose told pose changes by more starts again.
    moving_radars : tuple of str
        Radars on board of something: their told pose may change.
    """

    range_sigma_m: float = Field(default=20.0, ge=0.0)
    range_scale_sigma: float = Field(default=0.0, ge=0.0, le=0.5)
    azimuth_sigma_deg: float = Field(default=3.0, ge=0.0, le=45.0)
    elevation_sigma_deg: float = Field(default=1.5, ge=0.0, le=45.0)
    roll_sigma_deg: float = Field(default=0.0, ge=0.0, le=45.0)
    pitch_sigma_deg: float = Field(default=0.0, ge=0.0, le=45.0)
    position_sigma_m: float = Field(default=0.0, ge=0.0)
    height_sigma_m: float = Field(default=0.0, ge=0.0)
    clock_sigma_s: float = Field(default=0.0, ge=0.0)
    drift_time_constant_h: float = Field(default=200.0, gt=0.0)
    pair_age_s: float = Field(default=1.0, gt=0.0)
    velocity_sigma_mps: float = Field(default=1.0, ge=0.0)
    track_height_sigma_m: float = Field(default=150.0, ge=0.0)
    gate_mahalanobis: float = Field(default=4.0, gt=0.0)
    reference_correlation_s: float = Field(default=60.0, ge=0.0)
    suspect_window: int = Field(default=10, ge=5)
    suspect_share: float = Field(default=0.7, gt=0.0, lt=1.0)
    pose_jump_m: float = Field(default=5.0, gt=0.0)
    pose_jump_deg: float = Field(default=1.0, gt=0.0)
    moving_radars: tuple[str, ...] = ()


class RadarNetworkConfig(PartConfig):
    """A network of radars in front of one tracker (`wideberth.tracking.radar_network`).

    Attributes
    ----------
    registration : RegistrationConfig
    silent_after_s : float
        A radar without a scan for this long is silent.
    handover_after_s : float
        A track is handed over when the radar that fed it has not seen it for this long and another has.
    blind_after_expected : float
        A radar is blind that has seen nothing where by its detection model this many plots were to be expected.
    near_track_m : float
        A plot feeds a track if it is within this distance, beside its uncertainty.
    known_share : float
        A bias is known, and said, when its standard deviation is below this share of what it was before.
    range_limit_m, azimuth_limit_deg, elevation_limit_deg : float
        A bias that is beyond for sure is an alarm.
    """

    registration: RegistrationConfig = RegistrationConfig()
    silent_after_s: float = Field(default=5.0, gt=0.0)
    handover_after_s: float = Field(default=2.0, gt=0.0)
    blind_after_expected: float = Field(default=12.0, gt=0.0)
    near_track_m: float = Field(default=10.0, ge=0.0)
    known_share: float = Field(default=0.2, gt=0.0, lt=1.0)
    range_limit_m: float = Field(default=50.0, gt=0.0)
    azimuth_limit_deg: float = Field(default=6.0, gt=0.0)
    elevation_limit_deg: float = Field(default=4.0, gt=0.0)
