"""Settings of the ADS-B sensors; the numbers of the ADS-B paper are the defaults.

Source: ADS-B paper, sections "Airspace and Power Requirements" and "Error Characterization".
"""

from typing import Literal

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig

PowerClass = Literal["A0", "A1", "A2", "A3"]


class AdsbNoiseConfig(PartConfig):
    """The white part of the error of reports, and what to assume of aircraft that do not report their accuracy.

    Attributes
    ----------
    assumed_nacp, assumed_nacv, assumed_nic, assumed_sil, assumed_sda : int
        Used where an aircraft has not said its own: the least that 14 CFR 91.227 accepts.
    position_white_sigma_m : float
        Standard deviation of the part of the horizontal position error that changes from one report to the next, each
        axis (12 ft: the Gauss-Markov process of the paper moves 5.28 ft in a second, CPR and time stamps add the rest).
    position_resolution_m : float
        Step of the CPR encoding.
    altitude_white_sigma_ft : float
        White part of the altitude error: the paper's 75.9 ft (125 ft at 95 %, divided by 1.645). Give less where the
        altitude error is taken as slowly varying, and give that part to the tracker.
    altitude_resolution_ft, climb_rate_resolution_ft_per_min : float
        Steps of the encoding.
    climb_rate_sigma_ft_per_min : float
        Climb rate error in nearly level flight.
    climb_rate_regime_ft_per_min, climb_rate_fraction_95 : float
        Beyond this climb rate the error is at most this fraction of it, 95 % of the time.
    """

    assumed_nacp: int = Field(default=8, ge=0, le=11)
    assumed_nacv: int = Field(default=1, ge=0, le=4)
    assumed_nic: int = Field(default=7, ge=0, le=11)
    assumed_sil: int = Field(default=3, ge=0, le=3)
    assumed_sda: int = Field(default=2, ge=0, le=3)
    position_white_sigma_m: float = Field(default=3.66, gt=0.0)
    position_resolution_m: float = Field(default=5.0, ge=0.0)
    altitude_white_sigma_ft: float = Field(default=75.9, ge=0.0)
    altitude_resolution_ft: float = Field(default=25.0, gt=0.0)
    climb_rate_sigma_ft_per_min: float = Field(default=27.96, ge=0.0)
    climb_rate_regime_ft_per_min: float = Field(default=500.0, ge=0.0)
    climb_rate_fraction_95: float = Field(default=0.05, ge=0.0)
    climb_rate_resolution_ft_per_min: float = Field(default=64.0, gt=0.0)


class EncounterKeyConfig(PartConfig):
    """Which encounter of a Monte Carlo set the noise is that of."""

    intruders: int = Field(ge=1, le=65_535)
    number: int = Field(ge=0, lt=2**47)


class AdsbErrorConfig(PartConfig):
    """The error model of simulated ADS-B traffic.

    Attributes
    ----------
    link : {"1090", "978"}
        Sets the loss of messages (MHz).
    loss_1090, loss_978 : float
        Fraction of broadcasts that is not received.
    nacp, nacv, nic, sil, sda : int
        What the aircraft report; the errors follow from them.
    correlation_time_s : float
        Time constant of the Gauss-Markov position error.
    start : {"stationary", "zero"}
        Whether the position error starts with its stationary spread or at zero; the paper does not say which it used.
    altitude_kind : {"pressure", "geometric"}
        Which altitude is sent.
    altitude_error : {"white", "bias"}
        New in each message (the paper), or one value for each aircraft.
    pressure_altitude_sigma_ft, geometric_altitude_sigma_ft : float
        75.9 and 89.8 ft are the 95 % bounds 125 and 147.6 ft divided by 1.645.
    climb_rate_sigma_ft_per_min, climb_rate_regime_ft_per_min, climb_rate_fraction_95 : float
        27.96 ft/min (46 ft/min divided by 1.645) within the regime, beyond it the fraction divided by 1.645.
    position_resolution_m, pressure_altitude_resolution_ft, geometric_altitude_resolution_ft, velocity_resolution_kt, \
climb_rate_resolution_ft_per_min : float
        Steps of the encoding; 0 switches one off.
    latency_s : float
        Total age of the state that a message carries.
    uncompensated_latency_s : float
        The part that the transmitter has not extrapolated away: the position is this much behind.
    interval_s, interval_jitter_s : float
        Time between broadcasts and half the width of its uniform jitter; each aircraft has its own phase.
    gross_error_scale : float
        Multiplies the rates of SIL and SDA, to see the effect within a short simulation.
    sil_per : {"sample", "hour"}
        What the probability of the SIL counts (the message field SILsupp).
    gross_error_duration_s : float
        How long a faulty system sends false positions (SDA).
    gross_error_max_nic_bounds : float
        False positions lie between one and this many NIC bounds from the truth.
    velocity_swap_probability : float
        That a message carries north and east velocity in reverse order; "on rare occasions" in the paper.
    power_class : {"A0", "A1", "A2", "A3"}
        Transmitter class, sets the range.
    range_a0_nmi, range_a1_nmi, range_a2_nmi, range_a3_nmi : float
        Air-to-air range by class. DO-260B and DO-282B: 10, 20, 40 and 90 nmi (A3 reaches 120 nmi ahead on 1090 MHz);
        the paper reckons with the least, 10 nmi.
    encounter : EncounterKeyConfig or None
        Take the noise of this encounter, as the Monte Carlo draws it, in place of a stream for each address.
    """

    link: Literal["1090", "978"] = "1090"
    loss_1090: float = Field(default=0.15, ge=0.0, le=1.0)
    loss_978: float = Field(default=0.10, ge=0.0, le=1.0)
    nacp: int = Field(default=8, ge=0, le=11)
    nacv: int = Field(default=1, ge=0, le=4)
    nic: int = Field(default=7, ge=1, le=11)
    sil: int = Field(default=3, ge=0, le=3)
    sda: int = Field(default=2, ge=0, le=3)
    correlation_time_s: float = Field(default=1100.0, gt=0.0)
    start: Literal["stationary", "zero"] = "stationary"
    altitude_kind: Literal["pressure", "geometric"] = "pressure"
    altitude_error: Literal["white", "bias"] = "white"
    pressure_altitude_sigma_ft: float = Field(default=75.9, ge=0.0)
    geometric_altitude_sigma_ft: float = Field(default=89.8, ge=0.0)
    climb_rate_sigma_ft_per_min: float = Field(default=27.96, ge=0.0)
    climb_rate_regime_ft_per_min: float = Field(default=500.0, ge=0.0)
    climb_rate_fraction_95: float = Field(default=0.05, ge=0.0)
    position_resolution_m: float = Field(default=5.0, ge=0.0)
    pressure_altitude_resolution_ft: float = Field(default=25.0, ge=0.0)
    geometric_altitude_resolution_ft: float = Field(default=45.0, ge=0.0)
    velocity_resolution_kt: float = Field(default=1.0, ge=0.0)
    climb_rate_resolution_ft_per_min: float = Field(default=64.0, ge=0.0)
    latency_s: float = Field(default=0.6, ge=0.0, le=2.0)
    uncompensated_latency_s: float = Field(default=0.6, ge=0.0, le=2.0)
    interval_s: float = Field(default=1.0, gt=0.0)
    interval_jitter_s: float = Field(default=0.05, ge=0.0)
    gross_error_scale: float = Field(default=1.0, ge=0.0)
    sil_per: Literal["sample", "hour"] = "sample"
    gross_error_duration_s: float = Field(default=10.0, ge=0.0)
    gross_error_max_nic_bounds: float = Field(default=3.0, gt=1.0)
    velocity_swap_probability: float = Field(default=1e-3, ge=0.0, le=1.0)
    power_class: PowerClass = "A0"
    range_a0_nmi: float = Field(default=10.0, gt=0.0)
    range_a1_nmi: float = Field(default=20.0, gt=0.0)
    range_a2_nmi: float = Field(default=40.0, gt=0.0)
    range_a3_nmi: float = Field(default=90.0, gt=0.0)
    noise: AdsbNoiseConfig = AdsbNoiseConfig()
    encounter: EncounterKeyConfig | None = None

    @model_validator(mode="after")
    def _consistent(self) -> "AdsbErrorConfig":
        if self.uncompensated_latency_s > self.latency_s:
            raise ValueError("uncompensated_latency_s cannot be more than latency_s, the total")
        if self.interval_jitter_s >= self.interval_s / 2:
            raise ValueError("interval_jitter_s must be less than half of interval_s")
        return self

    @property
    def scan_kind(self) -> str:
        """Kind of its scans."""
        return "adsb"

    @property
    def loss(self) -> float:
        """Fraction of messages lost on the chosen link."""
        return self.loss_1090 if self.link == "1090" else self.loss_978

    @property
    def range_nmi(self) -> float:
        """Range of the chosen power class, nmi."""
        ranges = {
            "A0": self.range_a0_nmi,
            "A1": self.range_a1_nmi,
            "A2": self.range_a2_nmi,
            "A3": self.range_a3_nmi,
        }
        return ranges[self.power_class]

    @property
    def altitude_sigma_ft(self) -> float:
        """Standard deviation of the altitude that is sent, ft."""
        pressure = self.altitude_kind == "pressure"
        return self.pressure_altitude_sigma_ft if pressure else self.geometric_altitude_sigma_ft

    @property
    def altitude_resolution_ft(self) -> float:
        """Step of the altitude that is sent, ft."""
        pressure = self.altitude_kind == "pressure"
        return self.pressure_altitude_resolution_ft if pressure else self.geometric_altitude_resolution_ft


class AdsbReceiverConfig(PartConfig):
    """The ADS-B receiver.

    Attributes
    ----------
    range_max_m : float
        Horizontal distance from the ownship beyond which aircraft are left out (counted).
    altitude_window_m : float or None
        Greatest altitude difference from the ownship, either way; None: no limit.
    noise : AdsbNoiseConfig
        Errors of the reports, and what to assume of aircraft that do not say theirs.
    """

    range_max_m: float = Field(default=185_200.0, gt=0.0)
    altitude_window_m: float | None = Field(default=None, gt=0.0)
    noise: AdsbNoiseConfig = AdsbNoiseConfig()

    @property
    def scan_kind(self) -> str:
        """Kind of its scans."""
        return "adsb"
