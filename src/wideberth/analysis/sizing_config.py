"""The files of `sizing/`: a sensor and an aircraft of which to ask whether the one protects the other."""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from wideberth.config import Checked, check_table, read_toml
from wideberth.config_errors import wrong_things
from wideberth.errors import InputError
from wideberth.named_files import find_named
from wideberth.part_config import PartConfig
from wideberth.sensors.adsb.config import AdsbErrorConfig
from wideberth.sensors.radar.config import RadarConfig
from wideberth.units import DEGREE


class AdsbSizingConfig(AdsbErrorConfig):
    """ADS-B, with its range by power class, its losses and its latency, and what confirms a track.

    Attributes
    ----------
    confirm_hits, confirm_window : int
        A track is confirmed by this many messages of this many that were sent. The tracker asks for three.
    confirmation_probability : float
        With which a track is to be confirmed at the range that is given out.
    """

    confirm_hits: int = Field(default=3, ge=1, le=12)
    confirm_window: int = Field(default=5, ge=1, le=12)
    confirmation_probability: float = Field(default=0.9, gt=0.0, lt=1.0)

    @model_validator(mode="after")
    def _rule_makes_sense(self) -> Self:
        if self.confirm_hits > self.confirm_window:
            raise ValueError(f"confirm_hits {self.confirm_hits} is more than confirm_window {self.confirm_window}")
        return self


class GroundRadarConfig(RadarConfig):
    """A radar on the ground; by default a planar array that looks straight up and forms beams over the whole sky.

    Boresights are clockwise from north. The other defaults are those of the simulated radar of the thesis (4.5): 5 kW,
    4 by 4 channels, 20 averages.

    Attributes
    ----------
    ceiling_m : float or None
        Height above the radar that nobody comes down from, such as a floor of controlled airspace. The surveillance
        volume is then an upright cylinder of this height; None: a hemisphere.
    """

    sweep_time_ms: float = Field(default=2.0, gt=0.0)
    if_bandwidth_mhz: float = Field(default=1.024, gt=0.0)
    transmit_power_w: float = Field(default=5000.0, gt=0.0)
    channels: int = Field(default=16, ge=1, le=256)
    averages: int = Field(default=20, ge=1, le=4096)
    false_alarm_probability: float = Field(default=0.1, ge=1e-15, le=0.5)
    azimuth_fov_deg: float = Field(default=360.0, gt=0.0, le=360.0)
    elevation_fov_deg: float = Field(default=180.0, gt=0.0, le=180.0)
    azimuth_beamwidth_deg: float | None = Field(default=None, gt=0.0, le=360.0)
    elevation_beamwidth_deg: float | None = Field(default=None, gt=0.0, le=360.0)
    boresight_elevation_deg: float = Field(default=90.0, ge=-90.0, le=90.0)
    ceiling_m: float | None = Field(default=None, gt=0.0)


SensorConfig = RadarConfig | AdsbSizingConfig
SENSORS: dict[str, type[RadarConfig] | type[AdsbSizingConfig]] = {
    "radar": RadarConfig,
    "ground_radar": GroundRadarConfig,
    "adsb": AdsbSizingConfig,
}

Escape = Literal["turn", "climb", "slow_down"]
Fraction = Annotated[float, Field(gt=0.0, le=1.0)]
FOLDER = Path("sizing")


class AircraftConfig(PartConfig):
    """The aircraft to be protected; the defaults are the nominal values of the thesis (table 2.3) at 25 kt.

    Attributes
    ----------
    name : str
    speed_min_mps, speed_cruise_mps, speed_max_mps : float
        Airspeeds; 0 is a hover.
    bank_max_deg : float
    roll_rate_max_deg_s, roll_time_constant_s : float
        Greatest roll rate and the lag of the roll rate behind the ailerons.
    climb_rate_max_mps, sink_rate_max_mps : float
    turn_deg : float
        Change of course of the avoidance turn, chi_t in the thesis.
    decision_time_s : float
        From a confirmed track to the start of the turn, t_c in the thesis: deciding, planning, sending.
    safety_radius_m : float
        Least distance that an intruder may come to.
    safety_height_m : float
        Height of the safety volume, h_s in the thesis; climbing or descending must gain half of it.
    escapes : tuple of {"turn", "climb", "slow_down"}
        What it may do, all to be had at any time: turn to either side, climb or descend, go to its least speed.
    turn_fractions : tuple of float
        It may turn by these fractions of `turn_deg`, whichever is best; by default always by all of it.
    vertical_acceleration_mps2, acceleration_mps2 : float
        With which it takes up a climb or descent, and with which it slows down.
    """

    name: str = Field(default="aircraft", min_length=1)
    speed_min_mps: float = Field(default=10.0, ge=0.0)
    speed_cruise_mps: float = Field(default=12.861, gt=0.0)
    speed_max_mps: float = Field(default=20.0, gt=0.0)
    bank_max_deg: float = Field(default=30.0, gt=0.0, lt=80.0)
    roll_rate_max_deg_s: float = Field(default=30.0, gt=0.0)
    roll_time_constant_s: float = Field(default=0.5, ge=0.0)
    climb_rate_max_mps: float = Field(default=3.0, ge=0.0)
    sink_rate_max_mps: float = Field(default=3.0, ge=0.0)
    turn_deg: float = Field(default=90.0, gt=0.0, le=180.0)
    decision_time_s: float = Field(default=5.0, ge=0.0)
    safety_radius_m: float = Field(default=152.4, gt=0.0)
    safety_height_m: float = Field(default=60.96, gt=0.0)
    escapes: tuple[Escape, ...] = Field(default=("turn",), min_length=1, max_length=3)
    turn_fractions: tuple[Fraction, ...] = Field(default=(1.0,), min_length=1, max_length=8)
    vertical_acceleration_mps2: float = Field(default=2.0, gt=0.0)
    acceleration_mps2: float = Field(default=2.0, gt=0.0)

    @model_validator(mode="after")
    def _speeds_in_order(self) -> Self:
        if not self.speed_min_mps <= self.speed_cruise_mps <= self.speed_max_mps:
            raise ValueError(
                f"speed_min_mps {self.speed_min_mps:g}, speed_cruise_mps {self.speed_cruise_mps:g} and speed_max_mps"
                f" {self.speed_max_mps:g} are not in this order"
            )
        return self

    def turn_arguments(self) -> dict[str, float]:
        """Return what the avoidance turn takes, in SI units and rad, under the names that the detection ranges use."""
        return {
            "ownship_speed": self.speed_cruise_mps,
            "safety_radius": self.safety_radius_m,
            "computation_time": self.decision_time_s,
            "max_bank": self.bank_max_deg * DEGREE,
            "turn_angle": self.turn_deg * DEGREE,
            "max_bank_rate": self.roll_rate_max_deg_s * DEGREE,
            "roll_time_constant": self.roll_time_constant_s,
        }


def find_sizing_file(given: str, folder: Path = FOLDER) -> Path:
    """Return the file of a sensor or aircraft: a path, or the bare name of a file in `folder`.

    Parameters
    ----------
    given : str
    folder : Path

    Raises
    ------
    InputError
        If there is no such file.
    """
    return find_named(given, folder, "sensor or aircraft")


def build_sensor(table: dict[str, Any], source: str = "sensor") -> SensorConfig:
    """Check a sensor's table.

    Parameters
    ----------
    table : dict
        `kind` and the sensor's own keys.
    source : str
        What to call it in messages.

    Raises
    ------
    InputError
        With one line for each thing that is wrong.
    """
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in SENSORS:
        said = "missing" if kind is None else f"there is no {kind!r:.60}"
        raise InputError(f"{source}: kind: {said} (known: {', '.join(SENSORS)})")
    return _checked(SENSORS[kind], {k: v for k, v in table.items() if k != "kind"}, source)


def load_sensor(path: Path) -> SensorConfig:
    """Read and check a sensor.

    Parameters
    ----------
    path : Path
        A TOML file.

    Raises
    ------
    InputError
        If it cannot be read; else with one line for each thing that is wrong.
    """
    return build_sensor(read_toml(Path(path)), str(path))


def load_aircraft(path: Path) -> AircraftConfig:
    """Read and check an aircraft.

    Parameters
    ----------
    path : Path
        A TOML file.

    Raises
    ------
    InputError
        If it cannot be read; else with one line for each thing that is wrong.
    """
    return _checked(AircraftConfig, read_toml(Path(path)), str(path))


def _checked(model: type[Checked], table: dict[str, Any], source: str) -> Checked:
    wrong: list[str] = []
    found = check_table(model, table, "", wrong)
    if found is None:
        raise wrong_things(source, [line.removeprefix("scenario: ") for line in wrong])
    return found
