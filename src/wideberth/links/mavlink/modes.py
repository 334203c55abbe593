"""Kinds of vehicle, and their flight modes by `custom_mode`, in words."""

from dataclasses import dataclass

from wideberth.links.mavlink.dialect import mavlink

_PLANE = {
    0: "MANUAL", 1: "CIRCLE", 2: "STABILIZE", 3: "TRAINING", 4: "ACRO", 5: "FBWA", 6: "FBWB", 7: "CRUISE",
    8: "AUTOTUNE", 10: "AUTO", 11: "RTL", 12: "LOITER", 13: "TAKEOFF", 14: "AVOID_ADSB", 15: "GUIDED",
    16: "INITIALISING", 17: "QSTABILIZE", 18: "QHOVER", 19: "QLOITER", 20: "QLAND", 21: "QRTL", 22: "QAUTOTUNE",
    23: "QACRO", 24: "THERMAL", 25: "LOITER_ALT_QLAND", 26: "AUTOLAND",
}  # fmt: skip
_COPTER = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 5: "LOITER", 6: "RTL", 7: "CIRCLE", 9: "LAND",
    11: "DRIFT", 13: "SPORT", 14: "FLIP", 15: "AUTOTUNE", 16: "POSHOLD", 17: "BRAKE", 18: "THROW", 19: "AVOID_ADSB",
    20: "GUIDED_NOGPS", 21: "SMART_RTL", 22: "FLOWHOLD", 23: "FOLLOW", 24: "ZIGZAG", 25: "SYSTEMID", 26: "AUTOROTATE",
    27: "AUTO_RTL", 28: "TURTLE",
}  # fmt: skip
_PX4_MAIN = {1: "MANUAL", 2: "ALTITUDE", 3: "POSITION", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATE"}
_PX4_AUTO = {
    1: "READY", 2: "TAKEOFF", 3: "HOLD", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW_TARGET", 9: "PRECISION_LAND",
    10: "VTOL_TAKEOFF",
}  # fmt: skip
_PLANE_TYPES = {mavlink.MAV_TYPE_FIXED_WING, *range(19, 26)}  # 19 to 25 are the kinds of VTOL


def px4_mode(main: int, sub: int = 0) -> int:
    """Return PX4's `custom_mode` of a main mode and, for AUTO (4), a sub mode."""
    return main << 16 | sub << 24


@dataclass(frozen=True, slots=True)
class VehicleKind:
    """An autopilot's family and airframe, and what follows from them.

    Attributes
    ----------
    family : str
        ``ardupilot``, ``px4`` or ``other``.
    airframe : str
        ``plane`` (also VTOL) or ``copter``.
    """

    family: str
    airframe: str

    @property
    def mission_mode(self) -> int:
        """The mode that flies the mission."""
        if self.family == "ardupilot":
            return 10 if self.airframe == "plane" else 3
        return px4_mode(4, 4)

    @property
    def guided_mode(self) -> int:
        """The mode that flies set-points."""
        if self.family == "ardupilot":
            return 15 if self.airframe == "plane" else 4
        return px4_mode(6)

    @property
    def loiter_mode(self) -> int:
        """The mode that stays where it is."""
        if self.family == "ardupilot":
            return 12 if self.airframe == "plane" else 5
        return px4_mode(4, 3)

    @property
    def home_is_item_0(self) -> bool:
        """Whether the first mission item is home (ArduPilot) and not part of the path."""
        return self.family == "ardupilot"

    def mode_name(self, custom_mode: int) -> str:
        """Return a mode in words."""
        if self.family == "ardupilot":
            names = _PLANE if self.airframe == "plane" else _COPTER
            return names.get(custom_mode, f"mode {custom_mode}")
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        if self.family == "px4" and main == 4 and sub in _PX4_AUTO:
            return _PX4_AUTO[sub]
        return _PX4_MAIN.get(main, f"mode {custom_mode}") if self.family == "px4" else f"mode {custom_mode}"


def kind_of(autopilot: int, vehicle_type: int) -> VehicleKind:
    """Return the kind of vehicle that a HEARTBEAT's `autopilot` and `type` mean."""
    families = {mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: "ardupilot", mavlink.MAV_AUTOPILOT_PX4: "px4"}
    return VehicleKind(families.get(autopilot, "other"), "plane" if vehicle_type in _PLANE_TYPES else "copter")
