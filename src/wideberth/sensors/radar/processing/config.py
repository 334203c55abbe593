"""Settings of the signal processing of a radar."""

from typing import Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from wideberth.part_config import PartConfig


class FixedPointConfig(PartConfig):
    """Word lengths of the signal processing in the thesis's gate array (5.2); the converter's are the receiver's.

    Attributes
    ----------
    fft_bits, product_bits, sum_bits, output_bits : int
        Of the spectrum (each part), of a power, of the sum of powers, and of what is handed on.
    fft_shift_bits : int
        Bits that are dropped below the spectrum's word: at 4 a step is 16 steps of the converter; with 4096 samples the
        loss is 0.13 dB (at 5: 0.40), and 16 bits overflow at a tone 75 dB above the noise of a bin.
    """

    fft_bits: int = Field(default=16, ge=4, le=31)
    product_bits: int = Field(default=32, ge=4, le=62)
    sum_bits: int = Field(default=37, ge=4, le=62)
    output_bits: int = Field(default=32, ge=4, le=62)
    fft_shift_bits: int = Field(default=4, ge=0, le=24)


class ProcessingConfig(PartConfig):
    """How samples become plots.

    Attributes
    ----------
    window : {"hann", "rectangular"}
        Put to the sweeps for detection. With the rectangular one a target in the middle of a range bin fills that bin
        alone, and the rule of two adjacent bins drops it.
    threshold : {"gamma", "exponential", "ca_cfar", "os_cfar"}
        From the noise's mean with the distribution of averaged powers or with that of a single one, as printed (4.4),
        or from the bins around, by their mean or by one of them in order of power.
    finite_noise_run : bool
        Whether thresholds allow for how few samples the noise's mean comes from. As printed they do not.
    false_alarm_probability_near, false_alarm_probability_far : float or None
        Of bin 0 and of the last bin, by the quadratic law (5.5) between them; None: the radar's
        `false_alarm_probability` everywhere.
    cfar_cells, cfar_guard_cells : int
        Bins on each side that a threshold is formed of, and those between them and the bin under test.
    cfar_rank : float
        Which of the bins in order of power, as a share of all of them.
    group_bins : int
        Adjacent bins over their thresholds that make a target (5.2: two).
    estimator : {"maximum_likelihood", "printed"}
        Of range, direction and range rate; printed: parabola and correction (5.6-5.8) for the range, the beam of
        greatest power for the direction, no range rate.
    range_spread : tuple of float or None
        Rate, alpha and beta of the printed range correction (5.7-5.8), the thesis's by default;
        `peak_interpolation.fit_range_spread` fits them. None: the parabola alone.
    beamformer : {"conventional", "mvdr"}
        Of the estimator.
    range_rate_max_mps : float
        Fastest opening or closing that plots are estimated for; more takes longer.
    clutter_filter : {"none", "moving_target", "map"}
        Against echoes that stand still: the mean over the frame's sweeps is taken out, or (by `RadarProcessor` alone)
        noise is what a bin held in the frames before.
    clutter_map_frames : float
        Over how many frames a clutter map forgets.
    fixed_point : FixedPointConfig or None
        None: floating point.
    max_plots : int
        In a scan; the weakest beyond are dropped and counted.
    noise_drift_db_per_sqrt_hour : float
        By how much (1 sigma) the receiver's gain may wander from a noise run, in an hour.
    clipped_share : float
        A channel with more than this share of its samples at its greatest or least value is not used.
    echo_spread_m, echo_rate_spread_mps : float
        Where on an aircraft its echo comes from, and how fast it moves there: standard deviations that plots have at
        least in a plot file. A strong echo alone would be known to a tenth of a millimetre.
    reference_rcs_m2 : float
        Mean cross-section that a scan's probability of detection is given for (that of the aircraft of thesis 4.5).
    """

    window: Literal["hann", "rectangular"] = "hann"
    threshold: Literal["gamma", "exponential", "ca_cfar", "os_cfar"] = "gamma"
    finite_noise_run: bool = True
    false_alarm_probability_near: float | None = Field(default=None, ge=1e-15, le=0.5)
    false_alarm_probability_far: float | None = Field(default=None, ge=1e-15, le=0.5)
    cfar_cells: int = Field(default=16, ge=1, le=512)
    cfar_guard_cells: int = Field(default=3, ge=0, le=64)
    cfar_rank: float = Field(default=0.75, gt=0.0, le=1.0)
    group_bins: int = Field(default=2, ge=1, le=16)
    estimator: Literal["maximum_likelihood", "printed"] = "maximum_likelihood"
    range_spread: tuple[PositiveFloat, PositiveFloat, PositiveFloat] | None = (9.18, 0.6, 0.6)
    beamformer: Literal["conventional", "mvdr"] = "conventional"
    range_rate_max_mps: float = Field(default=50.0, gt=0.0, le=1000.0)
    clutter_filter: Literal["none", "moving_target", "map"] = "none"
    clutter_map_frames: float = Field(default=100.0, ge=2.0, le=1e6)
    fixed_point: FixedPointConfig | None = None
    max_plots: int = Field(default=64, ge=1, le=4096)
    noise_drift_db_per_sqrt_hour: float = Field(default=0.1, ge=0.0, le=100.0)
    clipped_share: float = Field(default=0.1, gt=0.0, le=1.0)
    echo_spread_m: float = Field(default=0.05, gt=0.0)
    echo_rate_spread_mps: float = Field(default=0.02, gt=0.0)
    reference_rcs_m2: float = Field(default=0.1, gt=0.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.false_alarm_probability_near is None) != (self.false_alarm_probability_far is None):
            raise ValueError("false_alarm_probability_near and false_alarm_probability_far need each other")
        if self.fixed_point is not None and self.clutter_filter == "moving_target":
            raise ValueError("fixed_point has no moving-target filter: choose another clutter_filter")
        return self
