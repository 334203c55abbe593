"""Settings of a radar; the defaults are the 10 GHz FMCW radar of the thesis (table 5.1)."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig
from wideberth.sensors.radar.processing.config import ProcessingConfig
from wideberth.sensors.radar.sweeps.config import ReceiverConfig

SPEED_OF_LIGHT = 299_792_458.0

Azimuth = Annotated[float, Field(ge=-360.0, le=360.0)]


class RadarConfig(PartConfig):
    """An FMCW radar with one transmitter and several receiving channels, and what confirms a track.

    Attributes
    ----------
    carrier_frequency_ghz, bandwidth_mhz, sweep_time_ms : float
        Center frequency, frequency swept, and duration of a sweep. A sweep's range bin has the noise bandwidth
        1/sweep time and the length c/(2 bandwidth).
    if_bandwidth_mhz : float
        Highest beat frequency that is sampled: sets the instrumented range. 1 MHz makes it 614 m (errata, "Radar").
    transmit_power_w, transmit_gain_dbi, receive_gain_dbi, noise_figure_db : float
        The gains are those of one element on boresight.
    losses_db : float
        All other losses: atmosphere, radome, window, bins straddled.
    channels, averages : int
        Receiving channels, and sweeps that are averaged (thesis 5.4).
    array_rows : int
        The receiving channels form a grid of so many rows (downwards) and `channels / array_rows` columns (rightwards).
    element_spacing_wavelengths : float
        Between neighbours in a row, and between rows.
    sampling : {"real", "complex"}
        Real beat signals are sampled at twice, complex ones at once the `if_bandwidth_mhz`.
    sweep_interval_ms : float or None
        From the start of one sweep to the next; None: one begins where the last ends.
    averaging : {"noncoherent", "coherent"}
        How sweeps are averaged; the radar of the thesis averages powers.
    detect_on : {"channels", "beam"}
        What the threshold is put to: the mean power of the channels, as in the thesis (4.3), or the formed beam.
    migration_corrected : bool
        Whether the averaging for detection follows targets through the range bins: a joint search over range and range
        rates up to `processing.range_rate_max_mps`. If not, as in the thesis, a target that crosses several bins within
        the averaged sweeps leaves only a share of its power in each. Estimates follow it in any case.
    update_interval_s : float
        Time from one scan to the next.
    range_min_m : float
        Nearer targets are not seen.
    range_max_m : float or None
        Farther ones neither; None: as far as the instrumented range.
    azimuth_fov_deg, elevation_fov_deg : float
        Whole widths of the field of view.
    azimuth_beamwidth_deg, elevation_beamwidth_deg : float or None
        Half-power widths of an element; None: the same gain in all of the field of view.
    boresight_azimuths_deg : tuple of float
        One for each of several such radars, clockwise from the nose (or from north, on the ground).
    boresight_elevation_deg : float
        Above the horizon.
    false_alarm_probability : float
        In each range bin and scan (thesis 4.1 has 0.01; 5.4 goes from 0.03 near to 0.15 far).
    snr_threshold_db : float or None
        Given, a target is detected where its signal-to-noise ratio after processing reaches this, and never else; the
        false alarm probability and `swerling` are not used then.
    swerling : {0, 1, 3}
        Fluctuation of the target's cross-section from scan to scan: none, many equal scatterers, one large scatterer.
    confirm_hits, confirm_window : int
        A track is started by this many detections in this many scans: by default the inlier ratio 0.6 of the thesis
        (table 4.5) within a second.
    confirm_time_s : float
        How long a track must have lived to count (table 4.5: 40 scans of 0.1 s).
    confirmation_probability : float
        With which a track is to be confirmed at the range that is given out.
    receiver : ReceiverConfig
        What its hardware does to the samples.
    processing : ProcessingConfig
        How the samples become plots.
    """

    carrier_frequency_ghz: float = Field(default=10.25, gt=0.0)
    bandwidth_mhz: float = Field(default=500.0, gt=0.0)
    sweep_time_ms: float = Field(default=2.048, gt=0.0)
    if_bandwidth_mhz: float = Field(default=1.0, gt=0.0)
    transmit_power_w: float = Field(default=0.25, gt=0.0)
    transmit_gain_dbi: float = Field(default=12.0, ge=-50.0, le=100.0)
    receive_gain_dbi: float = Field(default=12.0, ge=-50.0, le=100.0)
    noise_figure_db: float = Field(default=6.0, ge=0.0, le=100.0)
    losses_db: float = Field(default=0.0, ge=0.0, le=200.0)
    channels: int = Field(default=4, ge=1, le=256)
    averages: int = Field(default=32, ge=1, le=4096)
    array_rows: int = Field(default=1, ge=1, le=256)
    element_spacing_wavelengths: float = Field(default=0.5, gt=0.0, le=10.0)
    sampling: Literal["real", "complex"] = "real"
    sweep_interval_ms: float | None = Field(default=None, gt=0.0)
    averaging: Literal["noncoherent", "coherent"] = "noncoherent"
    detect_on: Literal["channels", "beam"] = "channels"
    migration_corrected: bool = False
    update_interval_s: float = Field(default=0.1, gt=0.0, le=3600.0)
    range_min_m: float = Field(default=1.0, gt=0.0)
    range_max_m: float | None = Field(default=None, gt=0.0)
    azimuth_fov_deg: float = Field(default=120.0, gt=0.0, le=360.0)
    elevation_fov_deg: float = Field(default=30.0, gt=0.0, le=180.0)
    azimuth_beamwidth_deg: float | None = Field(default=80.0, gt=0.0, le=360.0)
    elevation_beamwidth_deg: float | None = Field(default=18.0, gt=0.0, le=360.0)
    boresight_azimuths_deg: tuple[Azimuth, ...] = Field(default=(0.0,), min_length=1, max_length=64)
    boresight_elevation_deg: float = Field(default=0.0, ge=-90.0, le=90.0)
    false_alarm_probability: float = Field(default=0.01, ge=1e-15, le=0.5)
    snr_threshold_db: float | None = Field(default=None, ge=-100.0, le=200.0)
    swerling: Literal[0, 1, 3] = 1
    confirm_hits: int = Field(default=6, ge=1, le=12)
    confirm_window: int = Field(default=10, ge=1, le=12)
    confirm_time_s: float = Field(default=4.0, ge=0.0, le=3600.0)
    confirmation_probability: float = Field(default=0.9, gt=0.0, lt=1.0)
    receiver: ReceiverConfig = ReceiverConfig()
    processing: ProcessingConfig = ProcessingConfig()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.confirm_hits > self.confirm_window:
            raise ValueError(f"confirm_hits {self.confirm_hits} is more than confirm_window {self.confirm_window}")
        if self.channels % self.array_rows:
            raise ValueError(f"channels {self.channels} do not fill {self.array_rows} array_rows evenly")
        if self.sweep_interval_ms is not None and self.sweep_interval_ms < self.sweep_time_ms:
            raise ValueError(
                f"sweep_interval_ms {self.sweep_interval_ms:g} is shorter than sweep_time_ms {self.sweep_time_ms:g}"
            )
        if self.samples_per_sweep < 8:
            raise ValueError("if_bandwidth_mhz and sweep_time_ms leave fewer than 8 samples in a sweep")
        sweeps = self.averages * self.sweep_interval
        if self.update_interval_s < sweeps * (1 - 1e-9):
            raise ValueError(
                f"update_interval_s {self.update_interval_s:g} is shorter than the averaged sweeps take, {sweeps:.6g} s"
                ": give fewer averages or a longer interval"
            )
        if self.range_min_m >= self.range_limit:
            raise ValueError(
                f"range_min_m {self.range_min_m:g} is not below the greatest range, {self.range_limit:g} m"
            )
        return self

    @property
    def wavelength(self) -> float:
        """Wavelength, m."""
        return SPEED_OF_LIGHT / (self.carrier_frequency_ghz * 1e9)

    @property
    def sweep_interval(self) -> float:
        """From the start of one sweep to the start of the next, s."""
        return 1e-3 * (self.sweep_time_ms if self.sweep_interval_ms is None else self.sweep_interval_ms)

    @property
    def sampling_frequency(self) -> float:
        """Samples a second of each channel, Hz (the 2 MHz of the errata, "Radar", for the radar of table 5.1)."""
        return (2.0 if self.sampling == "real" else 1.0) * self.if_bandwidth_mhz * 1e6

    @property
    def samples_per_sweep(self) -> int:
        """Samples of one channel in one sweep."""
        return round(self.sampling_frequency * self.sweep_time_ms * 1e-3)

    @property
    def range_bins(self) -> int:
        """Bins of a sweep's spectrum that stand for a range; bin i is that of range i times `range_bin`."""
        return self.samples_per_sweep // 2 if self.sampling == "real" else self.samples_per_sweep

    @property
    def array_columns(self) -> int:
        """Receiving channels in a row of the array."""
        return self.channels // self.array_rows

    @property
    def range_bin(self) -> float:
        """Length of a range bin, m."""
        return SPEED_OF_LIGHT / (2.0 * self.bandwidth_mhz * 1e6)

    @property
    def instrumented_range(self) -> float:
        """Range of the highest beat frequency, m."""
        return self.range_bin * self.if_bandwidth_mhz * 1e6 * self.sweep_time_ms * 1e-3

    @property
    def range_limit(self) -> float:
        """Range beyond which nothing is looked for, m."""
        return min(self.instrumented_range, math.inf if self.range_max_m is None else self.range_max_m)


class PlotModelConfig(PartConfig):
    """What the plots of a radar are like, in terms of what its signals allow; see `plot_model`.

    Attributes
    ----------
    processing_loss_db : float
        What a target loses beside the link budget and beside what `range_cells` says of window, range bins straddled
        and crossed: negative, as noise that neighbours share makes groups likelier. Fitted, as all defaults but the
        floors (docs/results/plot_model.md).
    range_error_factor, direction_error_factor, range_rate_error_factor : float
        Standard deviations in terms of the Cramer-Rao bounds.
    range_floor_bins, direction_floor_beamwidths, range_rate_floor_bins : float
        Standard deviations that no signal-to-noise ratio improves on, in range bins, half-power beamwidths of the array
        and Doppler bins; added in squares. They stand for the extent of an aircraft and for the pose of the array:
        the processing has none (below a hundredth of each).
    range_bias_bins : float
        Added to all ranges.
    range_doppler_share : float
        Share of the coupling of range and Doppler that the radar leaves in its ranges (errata, "Radar").
    grazing_limit_deg : float
        Direction errors grow with the angle from boresight, as the array looks narrower, up to this angle.
    resolution_bins, resolution_beamwidths : float or None
        Two aircraft nearer to each other than both give one plot, but for 40 % either way, which differ from look to
        look. None: as the beamformer of `processing` does. The conventional one resolves in
        range alone.
    false_alarm_factor : float
        Factor on what `range_cells.false_plot_probability` makes of `false_alarm_probability`: how many false plots a
        range bin really gives.
    """

    processing_loss_db: float = Field(default=-0.4, ge=-3.0, le=100.0)
    range_error_factor: float = Field(default=1.0, ge=0.0, le=1000.0)
    direction_error_factor: float = Field(default=1.0, ge=0.0, le=1000.0)
    range_rate_error_factor: float = Field(default=1.0, ge=0.0, le=1000.0)
    range_floor_bins: float = Field(default=0.3, gt=0.0, le=1000.0)
    direction_floor_beamwidths: float = Field(default=0.02, gt=0.0, le=10.0)
    range_rate_floor_bins: float = Field(default=0.1, gt=0.0, le=1000.0)
    range_bias_bins: float = Field(default=0.0, ge=-1000.0, le=1000.0)
    range_doppler_share: float = Field(default=0.0, ge=-1.0, le=1.0)
    grazing_limit_deg: float = Field(default=80.0, gt=0.0, lt=90.0)
    resolution_bins: float | None = Field(default=None, ge=0.0, le=1000.0)
    resolution_beamwidths: float | None = Field(default=None, ge=0.0, le=100.0)
    false_alarm_factor: float = Field(default=1.0, ge=0.0, le=10.0)


class SimulatedRadarConfig(RadarConfig):
    """A radar of a scenario; what confirms a track is the tracker's business here.

    Attributes
    ----------
    level : {"plots", "samples"}
        Whether its plots are drawn from a model of them (`plot_model`), or made of simulated samples by the processing
        that a real radar's samples go through. With the latter `plot_model` only shapes what the radar states of itself
        and the plots of a burst.
    noise_run_frames : int
        With `level` "samples": frames without targets of which the noise is measured before the start; 0: it is the
        link budget's, which a receiver with a filter or a converter departs from.
    calibrated : bool
        With `level` "samples": whether the processing knows how the channels couple and differ. What it does not know
        biases the directions.
    mount : {"ground", "ownship"}
        Where it stands: on the ground it sees the ownship as well; on the ownship it turns with it.
    north_m, east_m, altitude_m : float
        Of a radar on the ground.
    range_rate : bool
        Whether plots carry a range rate.
    range_rate_max_mps : float
        False plots have range rates up to this, either way.
    reference_rcs_m2, reference_closing_speed_mps : float
        The aircraft for which the radar states how probably it sees one.
    stated_probability_max : float
        It states no more than this: for some scans an aircraft may be unresolved from another, whatever its echo.
    pose_error_north_m, pose_error_east_m, pose_error_up_m, pose_error_heading_deg, pose_error_pitch_deg, \
pose_error_roll_deg : float
        Where the radar really is and looks, less what it says; the angles turn the array about its own axes.
    range_scale : float
        Ranges given in terms of the true ones.
    silent_from_s, silent_until_s : float or None
        It gives nothing from and until these times after the run's start; no end: for ever.
    burst_at_s : float or None
        For `burst_s` seconds from this time on, every scan has `burst_plots` false plots more.
    burst_s : float
    burst_plots : int
    plot_model : PlotModelConfig
    """

    level: Literal["plots", "samples"] = "plots"
    noise_run_frames: int = Field(default=0, ge=0, le=100_000)
    calibrated: bool = False
    mount: Literal["ground", "ownship"] = "ground"
    north_m: float = 0.0
    east_m: float = 0.0
    altitude_m: float = Field(default=0.0, ge=-1000.0, le=100_000.0)
    range_rate: bool = False
    range_rate_max_mps: float = Field(default=60.0, gt=0.0, le=1000.0)
    reference_rcs_m2: float = Field(default=0.1, gt=0.0, le=1e6)
    reference_closing_speed_mps: float = Field(default=15.0, ge=0.0, le=1000.0)
    stated_probability_max: float = Field(default=0.9, gt=0.0, le=1.0)
    pose_error_north_m: float = Field(default=0.0, ge=-1000.0, le=1000.0)
    pose_error_east_m: float = Field(default=0.0, ge=-1000.0, le=1000.0)
    pose_error_up_m: float = Field(default=0.0, ge=-1000.0, le=1000.0)
    pose_error_heading_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    pose_error_pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0)
    pose_error_roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    range_scale: float = Field(default=1.0, gt=0.0, le=10.0)
    silent_from_s: float | None = Field(default=None, ge=0.0)
    silent_until_s: float | None = Field(default=None, gt=0.0)
    burst_at_s: float | None = Field(default=None, ge=0.0)
    burst_s: float = Field(default=1.0, gt=0.0)
    burst_plots: int = Field(default=0, ge=0, le=10_000)
    plot_model: PlotModelConfig = PlotModelConfig()

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        if self.array_columns < 2:
            raise ValueError("an array of one column measures no azimuth: give more channels, or fewer array_rows")
        if self.azimuth_beamwidth_deg is None or self.elevation_beamwidth_deg is None:
            # A recording's configuration could not say it.
            raise ValueError("azimuth_beamwidth_deg and elevation_beamwidth_deg: give 360 for an element that sees all")
        if self.noise_run_frames and self.level == "plots":
            raise ValueError('noise_run_frames is of level = "samples": leave it out')
        if self.calibrated and self.level == "plots":
            raise ValueError('calibrated is of level = "samples": leave it out')
        if self.mount == "ownship" and (self.north_m, self.east_m, self.altitude_m) != (0.0, 0.0, 0.0):
            raise ValueError('north_m, east_m and altitude_m are of mount = "ground": leave them out')
        if self.silent_until_s is not None:
            if self.silent_from_s is None:
                raise ValueError("silent_until_s needs silent_from_s")
            if self.silent_until_s <= self.silent_from_s:
                raise ValueError("silent_until_s must be later than silent_from_s")
        if (self.burst_at_s is None) != (self.burst_plots == 0):
            raise ValueError("a burst needs both burst_at_s and burst_plots")
        return self

    @property
    def scan_kind(self) -> str:
        """Kind of its scans: a line of elements measures no elevation, only the angle of a cone about the line."""
        return "radar_cone" if self.array_rows == 1 else "radar"

    def unit_names(self, name: str) -> tuple[str, ...]:
        """Return the names of the units of a radar called `name`, one for each boresight."""
        n = len(self.boresight_azimuths_deg)
        return (name,) if n == 1 else tuple(f"{name}/{k + 1}" for k in range(n))
