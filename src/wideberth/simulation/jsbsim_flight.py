"""Intruders that JSBSim flies: an aircraft of its library, by name, along the flight that is asked for."""

import math
import os
from typing import Any, Protocol

import numpy as np

from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.types import FloatArray
from wideberth.units import FOOT

STEP = 1.0 / 120.0  # s, of JSBSim
_HOLD = 4  # steps between commands
_CHUNK = 30.0  # s flown ahead at once
_KEPT = 3  # commands from one state that is kept to the next: linear between them
_GRAVITY = 9.81
_LEAD = 0.5  # s
_BANK_MAX = math.radians(35.0)
_PITCH_MAX = math.radians(15.0)  # away from that of the trimmed flight
# Controls are JSBSim's normalised ones. The loops are slow enough for light and heavy aircraft alike.
_COURSE_GAIN = 0.4  # 1/s
_POSITION_GAIN = 0.1  # 1/s: velocity for being off the place
_CATCH_UP = 0.15  # of the speed, at most, to catch up
_AILERON_BANK, _AILERON_RATE = 0.8, 0.35
_ELEVATOR_PITCH, _ELEVATOR_RATE, _ELEVATOR_SUM = 1.5, 1.0, 0.3
_PITCH_CLIMB, _PITCH_CLIMB_SUM = 0.6, 0.15
_THROTTLE_SPEED, _THROTTLE_SUM = 0.06, 0.01


class Flight(Protocol):
    """What gives the flight that is wanted."""

    def state(self, t: float) -> FloatArray:
        """Return position and velocity at `t` s, local NED, shape (6,)."""


class JsbsimFlight:
    """An aircraft of JSBSim that flies after another flight: its velocity, and towards its place.

    It starts in trimmed flight with the other one's place and velocity; courses by bank, climbs by pitch, speed by
    throttle, without rudder. Its own limits and lags make the difference.

    Parameters
    ----------
    aircraft : str
        As JSBSim calls it: ``c172p``.
    wanted : Flight
    frame : LocalFrame
    wind : ndarray, shape (3,)
        Of the air, local NED, m/s.

    Raises
    ------
    InputError
        If JSBSim is not installed, has no such aircraft, or cannot trim it at this speed.
    """

    def __init__(self, aircraft: str, wanted: Flight, frame: LocalFrame, wind: FloatArray) -> None:
        self._aircraft, self._wanted, self._frame = aircraft, wanted, frame
        self._model = _load(aircraft)
        self._engines = self._model.get_propulsion().get_num_engines()
        self._commands = 0
        self._wind = np.asarray(wind, float)
        self._trim(wanted.state(0.0))
        self._sums = np.zeros(3)  # of pitch, climb angle and speed errors
        self._states = self._state()[np.newaxis]

    def state(self, t: float) -> FloatArray:
        """Return position and velocity at `t` s after the start, local NED, shape (6,); straight before the start."""
        place = t / (_KEPT * _HOLD * STEP)
        if place <= 0.0:
            first: FloatArray = self._states[0].copy()
            first[:3] += t * first[3:]
            return first
        while place >= len(self._states) - 1:
            self._fly_chunk()
        k = int(place)
        state: FloatArray = self._states[k] + (place - k) * (self._states[k + 1] - self._states[k])
        return state

    def _fly_chunk(self) -> None:
        states = []
        for _ in range(round(_CHUNK / (_KEPT * _HOLD * STEP))):
            for _ in range(_KEPT):
                self._command(self._commands * _HOLD * STEP)
                for _ in range(_HOLD):
                    self._model.run()
                self._commands += 1
            state = self._state()
            if not np.isfinite(state).all():
                raise InputError(f"traffic: JSBSim's {self._aircraft} left controlled flight: choose another speed")
            states.append(state)
        self._states = np.concatenate([self._states, states])

    def _trim(self, start: FloatArray) -> None:
        model = self._model
        air = start[3:] - self._wind
        speed = float(np.linalg.norm(air))
        latitude, longitude, altitude = self._frame.to_geodetic(start[:3])
        model["ic/terrain-elevation-ft"] = -10_000.0
        model["ic/lat-geod-deg"], model["ic/long-gc-deg"] = math.degrees(latitude), math.degrees(longitude)
        model["ic/h-sl-ft"] = altitude / FOOT
        model["ic/psi-true-deg"] = math.degrees(math.atan2(air[1], air[0])) % 360.0
        model["ic/vt-fps"] = speed / FOOT
        model["ic/gamma-deg"] = math.degrees(math.asin(-air[2] / max(speed, 1.0)))
        try:
            model.run_ic()
            model["gear/gear-cmd-norm"] = 0.0
            model["propulsion/set-running"] = -1
            for engine in range(self._engines):
                model[f"fcs/mixture-cmd-norm[{engine}]"] = 0.9
            self._throttle(0.7)
            model.run_ic()
            model.do_trim(1)
        except Exception as error:  # JSBSim raises types of its own
            raise InputError(
                f"traffic: JSBSim cannot trim {self._aircraft} at {speed:.0f} m/s and {altitude:.0f} m: {error};"
                " choose another speed_mps"
            ) from error
        self._pitch_trim = model["attitude/theta-rad"]
        self._elevator_trim = model["fcs/elevator-cmd-norm"]
        self._throttle_trim = model["fcs/throttle-cmd-norm"]

    def _state(self) -> FloatArray:
        model = self._model
        place = self._frame.to_ned(
            model["position/lat-geod-rad"], model["position/long-gc-rad"], model["position/h-sl-ft"] * FOOT
        )
        velocity = [model[f"velocities/v-{axis}-fps"] * FOOT for axis in ("north", "east", "down")]
        # JSBSim flies in still air, which a steady wind carries along.
        return np.concatenate([place + self._commands * _HOLD * STEP * self._wind, velocity + self._wind])

    def _command(self, t: float) -> None:
        model, dt = self._model, _HOLD * STEP
        now, wanted = self._state(), self._wanted.state(t)
        speed = max(math.hypot(now[3], now[4]), 1.0)
        catch_up = _POSITION_GAIN * (wanted[:3] - now[:3])
        most = _CATCH_UP * float(np.linalg.norm(wanted[3:]))
        catch_up *= min(1.0, most / max(float(np.linalg.norm(catch_up)), 1e-9))
        aim = wanted[3:] + catch_up

        before, after = self._wanted.state(t - _LEAD), self._wanted.state(t + _LEAD)
        turning = _wrapped(_course(after) - _course(before)) / (2.0 * _LEAD)
        off = _wrapped(math.atan2(aim[1], aim[0]) - _course(now))
        bank = math.atan(speed * (turning + _COURSE_GAIN * off) / _GRAVITY)
        bank = min(max(bank, -_BANK_MAX), _BANK_MAX)
        roll = model["attitude/phi-rad"]
        aileron = _AILERON_BANK * (bank - roll) - _AILERON_RATE * model["velocities/p-rad_sec"]

        climb_error = (now[5] - aim[2]) / speed
        pitch_error = self._pitch_trim + _PITCH_CLIMB * climb_error + self._sums[1] - model["attitude/theta-rad"]
        # A banked wing needs more of an angle of attack for the same lift; the sums find out how much.
        self._sums += dt * np.array([_ELEVATOR_SUM * pitch_error, _PITCH_CLIMB_SUM * climb_error, 0.0])
        self._sums[1] = min(max(self._sums[1], -_PITCH_MAX), _PITCH_MAX)
        elevator = self._elevator_trim - (
            _ELEVATOR_PITCH * pitch_error - _ELEVATOR_RATE * model["velocities/q-rad_sec"] + self._sums[0]
        )

        speed_error = math.hypot(aim[0], aim[1]) - speed
        throttle = self._throttle_trim + _THROTTLE_SPEED * speed_error + self._sums[2]
        if 0.0 < throttle < 1.0:
            self._sums[2] += dt * _THROTTLE_SUM * speed_error
        model["fcs/aileron-cmd-norm"] = min(max(aileron, -1.0), 1.0)
        model["fcs/elevator-cmd-norm"] = min(max(elevator, -1.0), 1.0)
        self._throttle(min(max(throttle, 0.0), 1.0))

    def _throttle(self, command: float) -> None:
        for engine in range(self._engines):
            self._model[f"fcs/throttle-cmd-norm[{engine}]"] = command


def _course(state: FloatArray) -> float:
    return math.atan2(state[4], state[3])


def _wrapped(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)


def _load(aircraft: str) -> Any:
    """Return JSBSim's executive with the aircraft in it."""
    try:
        import jsbsim
    except ImportError as error:
        raise InputError("traffic: an intruder of kind jsbsim needs JSBSim: pip install 'wideberth[jsbsim]'") from error
    model = jsbsim.FGFDMExec(None)
    model.set_debug_level(0)
    try:
        loaded = model.load_model(aircraft)
    except Exception:  # JSBSim raises types of its own
        loaded = False
    if not loaded:
        raise InputError(f"traffic: JSBSim has no aircraft {aircraft!r}: give one of its library, such as c172p")
    # Some aircraft of the library would write files where we are.
    number = 0
    while model.set_output_filename(number, os.devnull):
        number += 1
    model.set_dt(STEP)
    return model
