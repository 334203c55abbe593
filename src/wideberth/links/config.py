"""Settings of radars on the wire: where they stand, how exact they are, what their packets look like."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig

Probability = Annotated[float, Field(ge=0.0, le=1.0)]
Range = Annotated[float, Field(ge=0.0, le=1e6)]


class RadarUnitConfig(PartConfig):
    """Where a radar stands or is mounted, what it sees, and how exact its plots are where they do not say so.

    Attributes
    ----------
    name : str
        Of the sensor.
    radar_id : int or None
        Number in its packets (ASTERIX: 256 SAC + SIC); None: whatever comes is this radar's.
    mount : {"ground", "ownship"}
        On the ownship the pose is relative to the aircraft and turns with it.
    north_m, east_m : float
        Of a radar on the ground, in the local frame.
    latitude_deg, longitude_deg : float or None
        In place of `north_m` and `east_m`, WGS84.
    altitude_m : float
        Of a radar on the ground, on the scale of altitude that the ownship's and the traffic's altitudes have.
    boresight_azimuth_deg, boresight_elevation_deg, boresight_roll_deg : float
        Clockwise from north (at the radar) or from the nose; above the horizon or the nose; right side down.
    range_sigma_m, azimuth_sigma_deg, elevation_sigma_deg, range_rate_sigma_mps : float
        Standard deviations of plots that state none.
    azimuth_fov_deg, elevation_fov_deg : float
        Whole widths of the field of view.
    range_max_m : float
        Farther plots are left out.
    detection_ranges_m, detection_probabilities : tuple of float
        How probably it sees an aircraft in one scan, against range, linear in between; empty: it does not say.
    update_interval_s : float
        From one scan to the next. Without a scan for `silent_intervals` of them the radar is called silent.
    silent_intervals : float
    max_plots : int
        In a scan; of more the strongest are kept, or the nearest where they carry no signal-to-noise ratio.
    """

    name: str = Field(default="radar", min_length=1, max_length=64)
    radar_id: int | None = Field(default=None, ge=0, le=65535)
    mount: Literal["ground", "ownship"] = "ground"
    north_m: float = Field(default=0.0, ge=-1e6, le=1e6)
    east_m: float = Field(default=0.0, ge=-1e6, le=1e6)
    latitude_deg: float | None = Field(default=None, ge=-90.0, le=90.0)
    longitude_deg: float | None = Field(default=None, ge=-180.0, le=180.0)
    altitude_m: float = Field(default=0.0, ge=-1000.0, le=100_000.0)
    boresight_azimuth_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    boresight_elevation_deg: float = Field(default=0.0, ge=-90.0, le=90.0)
    boresight_roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    range_sigma_m: float = Field(default=0.4, gt=0.0, le=1e5)
    azimuth_sigma_deg: float = Field(default=1.0, gt=0.0, le=180.0)
    elevation_sigma_deg: float = Field(default=1.0, gt=0.0, le=90.0)
    range_rate_sigma_mps: float = Field(default=0.5, gt=0.0, le=1000.0)
    azimuth_fov_deg: float = Field(default=360.0, gt=0.0, le=360.0)
    elevation_fov_deg: float = Field(default=180.0, gt=0.0, le=180.0)
    range_max_m: float = Field(default=1e5, gt=0.0, le=1e6)
    detection_ranges_m: tuple[Range, ...] = ()
    detection_probabilities: tuple[Probability, ...] = ()
    update_interval_s: float = Field(default=0.1, gt=0.0, le=3600.0)
    silent_intervals: float = Field(default=10.0, ge=1.0, le=1e6)
    max_plots: int = Field(default=256, ge=1, le=10_000)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.latitude_deg is None) != (self.longitude_deg is None):
            raise ValueError("latitude_deg and longitude_deg need each other")
        if self.mount == "ownship" and self.latitude_deg is not None:
            raise ValueError('latitude_deg and longitude_deg are of a radar on the ground: set mount = "ground"')
        ranges = self.detection_ranges_m
        if len(ranges) != len(self.detection_probabilities):
            raise ValueError("detection_ranges_m and detection_probabilities must be equally many")
        if any(b <= a for a, b in pairwise(ranges)):
            raise ValueError("detection_ranges_m must increase")
        return self


class ThesisPacketConfig(PartConfig):
    """The packet of thesis 5.1: 32-bit words, a count and then pairs of range and azimuth.

    The thesis leaves open the order of bytes and the unit of angles; the defaults are what its Simulink receiver on a
    PC gives, with the angle of (5.1).

    Attributes
    ----------
    byte_order : {"little", "big"}
    count_word : {"float", "integer"}
        Whether the count is a 32-bit float, as printed, or an unsigned integer.
    angle : {"cone", "azimuth"}
        The angle of a line array from the plane at right angles to it (5.1), or the azimuth in the horizontal plane.
    angle_unit : {"rad", "deg"}
    angle_sign : {1, -1}
        -1 where angles count to the left.
    range_unit_m : float
        Metres that a range of 1 stands for; also corrects a scale error (thesis, figure 5.17).
    range_offset_m, angle_offset_deg : float
        Added to ranges and (after the sign) angles.
    ignore_beyond_count : bool
        Whether what follows the counted pairs is old data of a buffer of fixed size. If not, only zeros may follow.
    """

    byte_order: Literal["little", "big"] = "little"
    count_word: Literal["float", "integer"] = "float"
    angle: Literal["cone", "azimuth"] = "cone"
    angle_unit: Literal["rad", "deg"] = "rad"
    angle_sign: Literal[1, -1] = 1
    range_unit_m: float = Field(default=1.0, gt=0.0, le=1e6)
    range_offset_m: float = Field(default=0.0, ge=-1e5, le=1e5)
    angle_offset_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    ignore_beyond_count: bool = False


class RadarClockConfig(PartConfig):
    """What is believed of the times in a radar's messages.

    Attributes
    ----------
    use : {"message", "receipt"}
        Where the time of validity comes from.
    latency_s : float
        With `use` "receipt", or where messages carry no time: how long before its receipt a scan was true.
    age_max_s : float
        A scan that was true longer before its receipt is refused.
    ahead_max_s : float
        One that will be true later after its receipt is, too; up to here the time of receipt is taken.
    """

    use: Literal["message", "receipt"] = "message"
    latency_s: float = Field(default=0.0, ge=0.0, le=60.0)
    age_max_s: float = Field(default=2.0, gt=0.0, le=3600.0)
    ahead_max_s: float = Field(default=0.1, ge=0.0, le=3600.0)


class RadarUdpConfig(PartConfig):
    """Radars that send plots in UDP datagrams.

    Attributes
    ----------
    packet : {"wideberth", "thesis"}
        Ours (docs/inputs.md) or that of thesis 5.1.
    units : tuple of RadarUnitConfig
        The radars that send to this address.
    thesis : ThesisPacketConfig
    clock : RadarClockConfig
    """

    packet: Literal["wideberth", "thesis"] = "wideberth"
    units: tuple[RadarUnitConfig, ...] = Field(default=(RadarUnitConfig(),), min_length=1, max_length=64)
    thesis: ThesisPacketConfig = ThesisPacketConfig()
    clock: RadarClockConfig = RadarClockConfig()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        told_apart(self.units)
        if self.packet == "thesis" and len(self.units) > 1:
            raise ValueError("the thesis's packets do not say which radar they are of: give one of the units")
        return self


class AsterixConfig(PartConfig):
    """Radars and receivers that speak ASTERIX.

    Attributes
    ----------
    units : tuple of RadarUnitConfig
        The radars whose plots (category 048) are used; their azimuths count from north at the radar. None: only reports
        are wanted.
    scan : {"packet", "rotation"}
        Whether a datagram holds all plots of a scan, as of a radar that steers its beam electronically, or scans end at
        the north marks (category 034) and, without them, after `update_interval_s`.
    elevation : {"height", "none"}
        Whether the height of a 3-D radar (I048/110) becomes an elevation; it has steps of 25 ft.
    doppler_sign : {1, -1}
        -1 where the radar calls closing speeds positive.
    accept_test_targets : bool
        Whether what is marked as a test, as simulated or as a field monitor is used.
    clock : RadarClockConfig
    """

    units: tuple[RadarUnitConfig, ...] = Field(default=(RadarUnitConfig(),), max_length=64)
    scan: Literal["packet", "rotation"] = "packet"
    elevation: Literal["height", "none"] = "height"
    doppler_sign: Literal[1, -1] = 1
    accept_test_targets: bool = False
    clock: RadarClockConfig = RadarClockConfig()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        told_apart(self.units)
        for unit in self.units:
            if unit.mount == "ownship" or unit.boresight_elevation_deg or unit.boresight_roll_deg:
                raise ValueError(
                    "ASTERIX gives azimuths from north in the horizontal plane: radars are on the ground and level"
                )
        return self


def told_apart(units: tuple[RadarUnitConfig, ...]) -> None:
    """Check that messages of several radars can be told apart.

    Raises
    ------
    ValueError
        If two have one name or number, or one of several has no number.
    """
    if len({unit.name for unit in units}) < len(units):
        raise ValueError("two units have the same name")
    ids = [unit.radar_id for unit in units]
    if len(units) > 1 and (None in ids or len(set(ids)) < len(ids)):
        raise ValueError("several units need a radar_id each, all different")
