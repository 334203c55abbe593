"""What the corridor sees, for the autopilot and ground stations: ADSB_VEHICLE, COLLISION and texts."""

import math
from collections import deque
from collections.abc import Iterator
from typing import Any

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.links.mavlink.dialect import mavlink
from wideberth.types import AlertLevel, Snapshot, Threat, Track

_EVERY_S = 1.0  # how often an aircraft or threat is told
_TEXT_LENGTH = 50  # characters in one STATUSTEXT
_TEXTS_MAX = 12
_TEXT_EVERY_S = 0.2
_OWN_ADDRESSES = 0xFF000000  # beyond the 24 bits: tracks without an ICAO address
_EMITTER_NONE = 0
_LEVELS = {
    AlertLevel.CLEAR: mavlink.MAV_COLLISION_THREAT_LEVEL_NONE,
    AlertLevel.UNKNOWN: mavlink.MAV_COLLISION_THREAT_LEVEL_NONE,
    AlertLevel.PREVENTIVE: mavlink.MAV_COLLISION_THREAT_LEVEL_LOW,
    AlertLevel.CORRECTIVE: mavlink.MAV_COLLISION_THREAT_LEVEL_HIGH,
    AlertLevel.WARNING: mavlink.MAV_COLLISION_THREAT_LEVEL_HIGH,
}


class TrafficMessages:
    """Makes messages of snapshots, each aircraft and threat once a second.

    Parameters
    ----------
    own_receiver : str
        Name of the sensor that the autopilot itself is: what only it sees is not told back.
    """

    def __init__(self, own_receiver: str = "autopilot") -> None:
        self._own_receiver = own_receiver
        self._numbers: dict[str, int] = {}
        self._numbered = 0
        self._t_tracks = -math.inf
        self._levels: dict[str, AlertLevel] = {}
        self._alert = AlertLevel.CLEAR
        self._texts: deque[tuple[int, str]] = deque(maxlen=_TEXTS_MAX)
        self._t_text = -math.inf
        self._text_id = 0

    def of_snapshot(
        self, t: float, snapshot: Snapshot, frame: LocalFrame, *, traffic: bool
    ) -> Iterator[tuple[int | None, Any]]:
        """Yield messages, each with the address that it tells of where it is an aircraft.

        Parameters
        ----------
        t : float
        snapshot : Snapshot
        frame : LocalFrame
        traffic : bool
            Whether to tell of the aircraft, too, not only of threats.
        """
        by_id = {track.id: track for track in snapshot.tracks}
        avoided = () if snapshot.maneuver is None else snapshot.maneuver.threat_ids
        due = t - self._t_tracks >= _EVERY_S - 1e-6
        for threat in snapshot.threats:
            track = by_id.get(threat.track_id)
            before = self._levels.get(threat.track_id, AlertLevel.CLEAR)
            if track is None or max(threat.level, before) < AlertLevel.PREVENTIVE:
                continue
            if threat.level is not before:
                self._say_level(track, threat)
            if due or threat.level is not before:
                yield None, self._collision(threat, self._address(track.id), snapshot, threat.track_id in avoided)
        self._levels = {x.track_id: x.level for x in snapshot.threats if x.level >= AlertLevel.PREVENTIVE}
        if snapshot.alert_state is not self._alert and AlertLevel.UNKNOWN in (snapshot.alert_state, self._alert):
            known = snapshot.alert_state is not AlertLevel.UNKNOWN
            self.say("traffic picture is known again" if known else "traffic unknown: sensors cannot tell", 4)
        self._alert = snapshot.alert_state
        if not due:
            return
        self._t_tracks = t
        self._numbers = {name: number for name, number in self._numbers.items() if name in by_id}
        if traffic:
            for track in snapshot.tracks:
                if not track.is_ownship and track.sources != (self._own_receiver,):
                    address = self._address(track.id)
                    yield address, _adsb_vehicle(track, address, frame)

    def say(self, text: str, severity: int = 6) -> None:
        """Queue a text; `severity` as in syslog (4 warning, 5 notice, 6 information)."""
        self._texts.append((severity, text))

    def texts(self, t: float) -> Iterator[Any]:
        """Yield the STATUSTEXT messages of one queued text, at most five texts a second."""
        if not self._texts or t - self._t_text < _TEXT_EVERY_S:
            return
        self._t_text = t
        severity, text = self._texts.popleft()
        data = text.encode("ascii", "replace")
        if len(data) <= _TEXT_LENGTH:
            yield mavlink.MAVLink_statustext_message(severity, data)
            return
        self._text_id = self._text_id % 65535 + 1
        for k in range(0, len(data), _TEXT_LENGTH):
            chunk = data[k : k + _TEXT_LENGTH]
            yield mavlink.MAVLink_statustext_message(severity, chunk, self._text_id, k // _TEXT_LENGTH)

    def _address(self, track_id: str) -> int:
        """Return the ICAO address, or a number of our own beyond 24 bits."""
        if len(track_id) == 6 and all(c in "0123456789abcdef" for c in track_id):
            return int(track_id, 16)
        if track_id not in self._numbers:
            self._numbers[track_id] = _OWN_ADDRESSES + self._numbered % 0xFFFFFF
            self._numbered += 1
        return self._numbers[track_id]

    def _say_level(self, track: Track, threat: Threat) -> None:
        if threat.level < AlertLevel.PREVENTIVE:
            self.say(f"{track.label}: no threat any more")
            return
        ahead = f" in {threat.t_cpa:.0f} s" if math.isfinite(threat.t_cpa) and threat.t_cpa > 0 else ""
        miss = f", miss {threat.horizontal_miss:.0f} m" if math.isfinite(threat.horizontal_miss) else ""
        self.say(f"{track.label} {threat.level.name.lower()}{ahead}{miss}", 4 if threat.level > 2 else 5)

    @staticmethod
    def _collision(threat: Threat, address: int, snapshot: Snapshot, avoided: bool) -> Any:
        action = mavlink.MAV_COLLISION_ACTION_REPORT
        if avoided and snapshot.maneuver is not None:
            first = snapshot.maneuver.waypoints[0]
            height = abs(float(first[2] - snapshot.ownship.position[2]))
            level = float(np.hypot(*(first[:2] - snapshot.ownship.position[:2])))
            action = (
                mavlink.MAV_COLLISION_ACTION_ASCEND_OR_DESCEND
                if height > 0.1 * level
                else mavlink.MAV_COLLISION_ACTION_MOVE_HORIZONTALLY
            )
        return mavlink.MAVLink_collision_message(
            mavlink.MAV_COLLISION_SRC_ADSB,
            address,
            action,
            _LEVELS[threat.level],
            threat.t_cpa,
            abs(threat.vertical_miss),
            threat.horizontal_miss,
        )


def _adsb_vehicle(track: Track, address: int, frame: LocalFrame) -> Any:
    latitude, longitude, altitude = frame.to_geodetic(track.position)
    velocity = frame.velocity_from_ned(latitude, longitude, track.velocity)
    flags = (
        mavlink.ADSB_FLAGS_VALID_COORDS
        | mavlink.ADSB_FLAGS_VALID_ALTITUDE
        | mavlink.ADSB_FLAGS_VALID_HEADING
        | mavlink.ADSB_FLAGS_VALID_VELOCITY
        | mavlink.ADSB_FLAGS_VERTICAL_VELOCITY_VALID
        | mavlink.ADSB_FLAGS_VALID_CALLSIGN
    )
    squawk = track.info.squawk
    if squawk is not None and squawk.isdecimal():
        flags |= mavlink.ADSB_FLAGS_VALID_SQUAWK
    course = math.degrees(math.atan2(velocity[1], velocity[0])) % 360.0
    return mavlink.MAVLink_adsb_vehicle_message(
        address,
        round(math.degrees(latitude) * 1e7),
        round(math.degrees(longitude) * 1e7),
        mavlink.ADSB_ALTITUDE_TYPE_GEOMETRIC,
        round(float(altitude) * 1e3),
        round(course * 1e2) % 36000,
        min(round(math.hypot(velocity[0], velocity[1]) * 1e2), 65535),
        round(min(max(-float(velocity[2]) * 1e2, -32768), 32767)),
        track.label[:8].encode("ascii", "replace"),
        _EMITTER_NONE,
        round(min(max(track.t - track.t_last_update, 0.0), 255.0)),
        flags,
        int(squawk) if squawk is not None and squawk.isdecimal() else 0,
    )
