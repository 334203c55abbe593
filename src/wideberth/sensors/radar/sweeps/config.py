"""Settings of the receiver of a simulated radar."""

from typing import Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig


class ReceiverConfig(PartConfig):
    """What the receiver does to the echoes; by default nothing but adding noise.

    Attributes
    ----------
    channel_coupling_db : float or None
        Coupling of neighbouring channels (thesis, table 5.1: about -20); None: no channel hears another.
    if_filter_order : int or None
        Order of the Butterworth filter before the A/D converter; None: it passes the band of the beats unchanged, and
        nothing else.
    if_filter_cutoff_mhz : float or None
        Where that filter is 3 dB down (if `sampling` is complex: its width, around the middle of the band); None: at
        the edge of the band.
    high_pass_khz : float or None
        Where a first-order high-pass filter, against leakage and near clutter, is 3 dB down; None: there is none.
    adc_bits : int or None
        Of the A/D converter (two of them if `sampling` is complex); None: exact samples without limit.
    noise_rms_lsb : float
        The receiver's gain, as the noise of a sample (of each part if complex) in steps of the converter. At 2 rounding
        adds 0.09 dB of noise, and 12 bits overflow at a tone 57 dB above the noise of a sample.
    adc_offset_lsb : float
        Constant error of the converter. With it overflow makes even harmonics, too.
    channel_gain_spread_db, channel_phase_spread_deg : float
        By how much (1 sigma) the channels differ in gain and phase: always the same ones of a `channel_seed`.
    channel_seed : int
    leakage_db : float or None
        Power of the transmitter that gets into each receiving channel directly, relative to all of it.
    leakage_range_m : float
        Half of the way that it takes.
    """

    channel_coupling_db: float | None = Field(default=None, ge=-200.0, le=-10.0)
    if_filter_order: int | None = Field(default=None, ge=1, le=20)
    if_filter_cutoff_mhz: float | None = Field(default=None, gt=0.0)
    high_pass_khz: float | None = Field(default=None, gt=0.0)
    adc_bits: int | None = Field(default=None, ge=2, le=24)
    noise_rms_lsb: float = Field(default=2.0, gt=0.0)
    adc_offset_lsb: float = 0.0
    channel_gain_spread_db: float = Field(default=0.0, ge=0.0, le=10.0)
    channel_phase_spread_deg: float = Field(default=0.0, ge=0.0, le=180.0)
    channel_seed: int = Field(default=0, ge=0)
    leakage_db: float | None = Field(default=None, ge=-300.0, le=0.0)
    leakage_range_m: float = Field(default=0.3, gt=0.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.if_filter_cutoff_mhz is not None and self.if_filter_order is None:
            raise ValueError("if_filter_cutoff_mhz needs an if_filter_order: without one the filter is ideal")
        return self
