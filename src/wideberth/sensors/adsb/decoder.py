"""Mode S frames to reports: rs1090 decodes the messages, this keeps state between them and counts each frame once."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

import rs1090

from wideberth.sensors.adsb import message_fields as fields
from wideberth.sensors.adsb import quality
from wideberth.sensors.adsb.address_use import identity
from wideberth.sensors.adsb.aircraft_state import ALTITUDE_AGE, AircraftState
from wideberth.sensors.adsb.parity import LONG_BYTES, SHORT_BYTES, syndromes
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.units import FOOT

_SQUITTERS = (17, 18)
_REPLIES = {0: "air-air replies", 16: "air-air replies", 4: "surveillance replies", 5: "surveillance replies"} | {
    20: "Comm-B replies",
    21: "Comm-B replies",
}
_INTERROGATOR_CODES = 80  # a DF11 syndrome below this is an interrogator's code (Annex 10 Volume IV, 3.1.2.5.2.1.2)
_BATCH = 1000
_CROWD, _FORGET_AFTER = 5000, 600.0  # aircraft; s unheard after which one is forgotten in a crowd


class ModeSDecoder:
    """Stateful decoder of Mode S frames.

    Every frame given is counted once: in `kinds` if it was understood, in `rejects` by cause if it was left out.
    `results` counts what became of the positions of those understood.

    Parameters
    ----------
    timed : bool
        False where times of receipt are made up, so that speeds between positions mean nothing.

    Notes
    -----
    The altitudes of surveillance and air-air replies are not used: they are no ADS-B, and the position messages carry
    the same altitude. Of Comm-B only the identity code and the ACAS advisory (BDS 3,0) are used.
    """

    def __init__(self, *, timed: bool = True) -> None:
        self.kinds: Counter[str] = Counter()
        self.rejects: Counter[str] = Counter()
        self.results: Counter[str] = Counter()
        self.messages = 0
        self._timed = timed
        self._aircraft: dict[str, AircraftState] = {}

    @property
    def addresses(self) -> tuple[str, ...]:
        """The addresses heard (and not forgotten)."""
        return tuple(self._aircraft)

    def decode(self, frames: Sequence[bytes], times: Sequence[float]) -> list[AdsbReport]:
        """Return the reports that frames make, in their order.

        Parameters
        ----------
        frames : sequence of bytes
            Mode S frames, parity included; any other length than 7 or 14 bytes is counted and left out.
        times : sequence of float
            Time of receipt of each, s.
        """
        self.messages += len(frames)
        kept = [
            # Some recorders store short frames in the space of long ones: what follows the seventh byte is no message.
            (frame if frame[0] >= 0x80 else frame[:SHORT_BYTES], t)
            for frame, t in zip(frames, times, strict=True)
            if len(frame) == LONG_BYTES or (len(frame) == SHORT_BYTES and frame[0] < 0x80)
        ]
        if len(kept) < len(frames):
            self.rejects["wrong length"] += len(frames) - len(kept)
        checks = syndromes([frame for frame, _ in kept])
        squitters = [
            frame.hex()
            for (frame, _), check in zip(kept, checks, strict=True)
            if check == 0 and frame[0] >> 3 in _SQUITTERS
        ]
        decoded = iter(_decode_with_rs1090(squitters))
        reports: list[AdsbReport] = []
        for (frame, t), check in zip(kept, checks, strict=True):
            downlink_format = frame[0] >> 3
            if downlink_format in _SQUITTERS:
                if check:
                    self.rejects["crc failed"] += 1
                    continue
                report = self._squitter(frame, t, next(decoded))
                if report is not None:
                    reports.append(report)
            elif downlink_format == 11:
                self._all_call(frame, t, check)
            elif downlink_format in _REPLIES:
                self._reply(frame, t, f"{check:06x}", downlink_format)
            else:
                self.rejects["format not used"] += 1
        if len(self._aircraft) > _CROWD and times:
            oldest = max(times) - _FORGET_AFTER
            self._aircraft = {a: state for a, state in self._aircraft.items() if state.t_heard >= oldest}
        return reports

    def _state(self, address: str, t: float) -> AircraftState:
        state = self._aircraft.get(address)
        if state is None:
            state = self._aircraft[address] = AircraftState(timed=self._timed)
        state.t_heard = t
        return state

    def _all_call(self, frame: bytes, t: float, check: int) -> None:
        address = frame[1:4].hex()
        # With an interrogator's code in the parity the check is weak: only for aircraft known otherwise.
        if check == 0 or (check < _INTERROGATOR_CODES and address in self._aircraft):
            self._state(address, t)
            self.kinds["all-call replies"] += 1
        else:
            self.rejects["crc failed"] += 1

    def _reply(self, frame: bytes, t: float, address: str, downlink_format: int) -> None:
        state = self._aircraft.get(address)
        if state is None:
            # The address is the parity: a damaged frame looks like one of an aircraft that was never heard.
            self.rejects["address not known"] += 1
            return
        state.t_heard = t
        self.kinds[_REPLIES[downlink_format]] += 1
        if downlink_format in (5, 21):
            state.say(squawk=fields.squawk(int.from_bytes(frame[2:4], "big") & 0x1FFF))
        if downlink_format in (4, 5, 20, 21):
            state.say(ident=frame[0] & 7 in (4, 5))
        if downlink_format == 16 and frame[4] == 0x30:
            state.say(tcas_equipped=True, tcas_advisory=_advisory(frame))
        elif downlink_format in (20, 21) and frame[4] == 0x30:
            message: Any = rs1090.decode(frame.hex())
            if message and "bds30" in message and sum(key.startswith("bds") for key in message) == 1:
                state.say(tcas_equipped=True, tcas_advisory=_advisory(frame))

    def _squitter(self, frame: bytes, t: float, message: dict[str, Any] | None) -> AdsbReport | None:
        control = frame[0] & 7
        if frame[0] >> 3 == 18 and control not in (0, 1, 6):
            self.rejects["TIS-B not used"] += 1
            return None
        if message is None:
            self.rejects["field out of range"] += 1
            return None
        # An address that is not an ICAO one (DF18, control 1) must not be taken for the aircraft that has it as such.
        address = ("~" if frame[0] >> 3 == 18 and control == 1 else "") + frame[1:4].hex()
        state = self._state(address, t)
        type_code = frame[4] >> 3
        if 9 <= type_code <= 18 or 20 <= type_code <= 22:
            return self._position(address, state, t, type_code, frame, message)
        if type_code == 19:
            return self._velocity(address, state, t, fields.velocity(_me(frame)))
        if 5 <= type_code <= 8:
            state.land()
            self.rejects["surface"] += 1
        elif 1 <= type_code <= 4:
            callsign = str(message["callsign"]).strip()
            category = quality.emitter_category(type_code, frame[4] & 7)
            # "#" stands for a character outside the alphabet: such a callsign is damaged or not set.
            state.say(callsign=callsign if callsign and "#" not in callsign else state.info.callsign, category=category)
            self.kinds["identifications"] += 1
        elif type_code in (28, 29, 31):
            self._status(state, type_code, frame[4] & 7, _me(frame))
            self.kinds["status messages"] += 1
        else:
            self.kinds["other extended squitters"] += 1
        return None

    def _position(
        self, address: str, state: AircraftState, t: float, type_code: int, frame: bytes, message: dict[str, Any]
    ) -> AdsbReport:
        self.kinds["airborne positions"] += 1
        state.on_ground = False
        nic = quality.nic(state.version, type_code, state.nic_supplement_a, frame[4] & 1)
        ident = (frame[4] >> 1) & 3 == 3
        if nic != state.info.nic or ident != state.info.ident:
            state.say(nic=nic, ident=ident)
        if state.version == 0:
            nacp = quality.nacp_of_version_0(type_code)
            if nacp != state.info.nacp:
                state.say(nacp=nacp)
        pressure = geometric = math.nan
        altitude = message.get("altitude")
        if altitude is not None:
            if type_code >= 20:
                geometric = altitude * FOOT
            else:
                pressure = altitude * FOOT
                state.pressure_altitude, state.t_pressure_altitude = pressure, t
        users = len(state.use.places)
        found = state.locate(t, message["lat_cpr"], message["lon_cpr"], odd=message["parity"] == "odd")
        latitude = longitude = math.nan
        if isinstance(found, str):
            self.results["position jumps" if found == "jump" else "positions unresolved"] += 1
            if len(state.use.places) > 1:
                pressure = geometric = math.nan  # whose altitude it is cannot be told
            name = address
        else:
            user, latitude, longitude = found
            name = identity(address, user)
            self.results["positions"] += 1
            if len(state.use.places) > users == 1:
                self.results["addresses used by two aircraft"] += 1
        return AdsbReport(t, name, latitude, longitude, pressure, geometric, info=state.info)

    def _velocity(self, address: str, state: AircraftState, t: float, said: fields.Velocity) -> AdsbReport | None:
        if state.on_ground:
            self.rejects["surface"] += 1
            return None
        if len(state.use.places) > 1:
            self.rejects["velocity of an address used by two aircraft"] += 1
            return None
        self.kinds["velocities" if said.ground else "airspeeds"] += 1
        if said.nacv != state.info.nacv and said.ground:
            state.say(nacv=said.nacv)
        geometric = math.nan
        if abs(t - state.t_pressure_altitude) <= ALTITUDE_AGE:
            geometric = state.pressure_altitude + said.difference
        if math.isnan(said.north) and math.isnan(said.climb_rate) and math.isnan(geometric):
            return None
        return AdsbReport(
            t,
            address,
            geometric_altitude=geometric,
            velocity_north=said.north,
            velocity_east=said.east,
            climb_rate=said.climb_rate,
            info=state.info,
        )

    def _status(self, state: AircraftState, type_code: int, subtype: int, me: int) -> None:
        if type_code == 28 and subtype == 1:
            state.say(emergency=fields.emergency_state(me), squawk=fields.squawk(fields.bits(me, 12, 13)))
        elif type_code == 28 and subtype == 2:
            state.say(tcas_equipped=True, tcas_advisory=fields.advisory_active(me, 9))
        elif type_code == 29 and subtype >> 1 == 1:
            state.say(
                nacp=fields.bits(me, 40, 4), sil=fields.bits(me, 45, 2), tcas_equipped=bool(fields.bits(me, 53, 1))
            )
        elif type_code == 31:
            status = fields.operational_status(me)
            state.version = status.version if status.version in (1, 2) else 0
            state.nic_supplement_a = status.nic_supplement_a
            said = {
                name: getattr(status, name)
                for name in ("nacp", "sil", "sda", "nacv", "tcas_equipped", "tcas_advisory", "ident", "adsb_in")
            }
            size = quality.length_and_width(status.size_code) if status.size_code is not None else None
            if size is not None:
                said["length"], said["width"] = size
            state.say(**{name: value for name, value in said.items() if value is not None})


def _me(frame: bytes) -> int:
    return int.from_bytes(frame[4:11], "big")


def _advisory(frame: bytes) -> bool:
    return fields.advisory_active(_me(frame), 9)


def _decode_with_rs1090(frames: list[str]) -> list[dict[str, Any] | None]:
    """Decode frames, each on its own if the library fails on the batch; None where it refuses one."""
    if not frames:
        return []
    try:
        batch: Any = rs1090.decode(frames, batch=_BATCH)
        if len(batch) == len(frames):
            return list(batch)
    except BaseException as error:
        if not _is_panic(error):
            raise
    decoded: list[dict[str, Any] | None] = []
    for frame in frames:
        try:
            message: Any = rs1090.decode(frame)
        except BaseException as error:
            if not _is_panic(error):
                raise
            message = None
        decoded.append(message)
    return decoded


def _is_panic(error: BaseException) -> bool:
    # The library's panics derive from BaseException and their class cannot be imported.
    return type(error).__name__ == "PanicException"
