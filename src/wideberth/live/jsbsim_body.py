"""A Cessna 172 of JSBSim, with JSBSim's own autopilot, as the body of a simulated vehicle."""

import math
import os
from typing import Any

import numpy as np

from wideberth.errors import InputError
from wideberth.frames import LocalFrame, rotation_ned_body
from wideberth.links.mavlink.simulated_autopilot import FlightTarget
from wideberth.types import FloatArray, Ownship
from wideberth.units import FOOT
from wideberth.vehicles import kernels
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.guidance_kernels import K_ORBIT, orbit_course
from wideberth.vehicles.point_mass import parameters

CRUISE_SPEED = 50.0
"""m/s."""

_MODEL = "c172x"
_STEP_S = 1.0 / 120.0
_ORBIT_M = 700.0
_THROTTLE_PER_MPS, _THROTTLE_PER_M = 0.08, 0.012  # of the speed error, and of its integral
_LIMITS = PointMassConfig(
    speed_min_mps=40.0, speed_max_mps=60.0, bank_max_deg=20.0, climb_rate_max_mps=3.0, sink_rate_max_mps=3.0
)


class JsbsimBody:
    """A plane whose motion JSBSim reckons; its autopilot holds heading and altitude, ours the airspeed.

    Parameters
    ----------
    frame : LocalFrame
    wind : ndarray, shape (3,), optional
        Velocity of the air, local NED, m/s.

    Raises
    ------
    InputError
        If jsbsim is not installed.
    """

    def __init__(self, frame: LocalFrame, wind: FloatArray | None = None) -> None:
        try:
            import jsbsim
        except ImportError as error:
            raise InputError("--dynamics jsbsim needs jsbsim: pip install 'wideberth[jsbsim]'") from error
        self._frame = frame
        self._wind = np.zeros(3) if wind is None else np.asarray(wind, float)
        self._jsbsim: Any = jsbsim
        self._params = parameters(_LIMITS)
        self._command = np.zeros(3)
        self._fdm: Any = None
        self._position, self._velocity, self._attitude = np.zeros(3), np.zeros(3), np.eye(3)
        self._left = self._integral = 0.0

    def place(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put it at a position (3,) with a velocity (3,), local NED, engine running and in trim."""
        latitude, longitude, altitude = self._frame.to_geodetic(position)
        self._jsbsim.FGJSBBase().debug_lvl = 0  # its banner is none of ours
        fdm = self._jsbsim.FGFDMExec(None)
        fdm.load_model(_MODEL)
        fdm.set_output_filename(0, os.devnull)  # the model would write a file where it is run
        fdm.set_dt(_STEP_S)
        fdm["ic/lat-geod-deg"], fdm["ic/long-gc-deg"] = math.degrees(latitude), math.degrees(longitude)
        fdm["ic/h-sl-ft"] = float(altitude) / FOOT
        through_air = velocity - self._wind
        fdm["ic/psi-true-deg"] = math.degrees(math.atan2(through_air[1], through_air[0])) % 360.0
        fdm["ic/vw-mag-fps"] = math.hypot(self._wind[0], self._wind[1]) / FOOT
        fdm["ic/vw-dir-deg"] = math.degrees(math.atan2(self._wind[1], self._wind[0])) % 360.0  # where it blows to
        fdm["ic/vn-fps"], fdm["ic/ve-fps"], fdm["ic/vd-fps"] = velocity / FOOT
        fdm["propulsion/set-running"] = -1
        fdm["fcs/mixture-cmd-norm"] = 0.87
        fdm.run_ic()
        fdm["simulation/do_simple_trim"] = 0  # in level flight
        fdm["ap/heading_hold"] = fdm["ap/altitude_hold"] = 1
        self._fdm, self._left, self._integral = fdm, 0.0, float(fdm["fcs/throttle-cmd-norm"])
        self._read()

    def fly(self, target: FlightTarget, dt: float) -> None:
        """Fly towards a target for `dt` seconds."""
        fdm = self._fdm
        speed, heading, altitude = self._wanted(target)
        fdm["ap/heading_setpoint"] = math.degrees(heading) % 360.0
        fdm["ap/altitude_setpoint"] = altitude / FOOT
        self._left += dt
        while self._left >= _STEP_S:
            self._left -= _STEP_S
            error = speed - fdm["velocities/vt-fps"] * FOOT
            self._integral = kernels.clip(self._integral + _THROTTLE_PER_M * error * _STEP_S, 0.0, 1.0)
            fdm["fcs/throttle-cmd-norm"] = kernels.clip(self._integral + _THROTTLE_PER_MPS * error, 0.0, 1.0)
            fdm.run()
        self._read()

    def ownship(self, t: float) -> Ownship:
        """Return its true state at time `t`."""
        return Ownship(t, self._position.copy(), self._velocity.copy(), self._attitude.copy())

    def _wanted(self, target: FlightTarget) -> tuple[float, float, float]:
        """Return airspeed (m/s), heading (rad) and altitude (m)."""
        if target.holds:
            away = self._position[:2] - target.end[:2]
            distance = math.hypot(away[0], away[1])
            course = orbit_course(distance, math.atan2(away[1], away[0]), _ORBIT_M, 1.0, K_ORBIT)
            return CRUISE_SPEED, self._heading(course, CRUISE_SPEED), -float(target.end[2])
        through_air = self._velocity - self._wind
        airspeed = math.hypot(through_air[0], through_air[1])
        state = np.array([*self._position, airspeed, math.atan2(through_air[1], through_air[0]), 0.0, 0.0])
        points, speeds = np.vstack([target.start, target.end]), np.full(2, max(target.speed, 1.0))
        kernels.follow_path(state, points, speeds, 1, self._params, self._wind, self._command)
        leg = (target.end - target.start)[:2]
        length2 = float(leg @ leg)
        share = 1.0 if length2 < 1.0 else float((self._position - target.start)[:2] @ leg) / length2
        down = target.start[2] + kernels.clip(share, 0.0, 1.0) * (target.end[2] - target.start[2])
        return float(self._command[0]), self._heading(float(self._command[1]), airspeed), -float(down)

    def _heading(self, course: float, airspeed: float) -> float:
        """Return the heading (rad) that leads along a course in the wind."""
        across = self._wind[1] * math.cos(course) - self._wind[0] * math.sin(course)
        return course - math.asin(kernels.clip(across / max(airspeed, 1.0), -1.0, 1.0))

    def _read(self) -> None:
        fdm = self._fdm
        latitude, longitude = math.radians(fdm["position/lat-geod-deg"]), math.radians(fdm["position/long-gc-deg"])
        self._position = self._frame.to_ned(latitude, longitude, fdm["position/h-sl-ft"] * FOOT)
        names = ("velocities/v-north-fps", "velocities/v-east-fps", "velocities/v-down-fps")
        there = np.array([fdm[name] for name in names]) * FOOT
        self._velocity = self._frame.velocity_to_ned(latitude, longitude, there)
        angles = (fdm["attitude/phi-rad"], fdm["attitude/theta-rad"], fdm["attitude/psi-rad"])
        self._attitude = rotation_ned_body(*angles)
