"""A maneuver as waypoints in the mission: uploaded before the item flown to, taken out again afterwards."""

from collections.abc import Callable

from wideberth.links.mavlink.flight import Phase
from wideberth.links.mavlink.guided_path import with_floor
from wideberth.links.mavlink.mission_copy import MissionCopy
from wideberth.links.mavlink.mission_items import waypoint
from wideberth.links.mavlink.telemetry import Telemetry
from wideberth.links.mavlink.vehicle import Vehicle
from wideberth.types import FloatArray

_UPLOADS = 3  # tries before a maneuver is given up
_AGAIN_S = 2.0  # between tries to restore the mission


class InsertedFlight:
    """Inserts a maneuver's waypoints into the mission, and restores the mission afterwards.

    The vehicle stays in its mission mode. If the link is cut meanwhile it flies the maneuver and goes on with the
    mission by itself.

    Parameters
    ----------
    vehicle : Vehicle
    telemetry : Telemetry
    mission : MissionCopy
    floor : float
        Height above the ground below which no waypoint is put, m.
    tell : callable
        Takes an event in words.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        telemetry: Telemetry,
        mission: MissionCopy,
        floor: float,
        tell: Callable[[str], None],
    ) -> None:
        self._vehicle, self._telemetry, self._mission, self._floor = vehicle, telemetry, mission, floor
        self._tell = tell
        self.phase = Phase.IDLE
        self.lost = self.failed = ""
        self._waypoints: FloatArray | None = None
        self._uploads = 0
        self._t_again = 0.0
        self._begun = self._resumed = False

    def fly(self, waypoints: FloatArray, times: FloatArray, t: float) -> None:
        """Fly a path (n, 3) in the local frame from now on, instead of the mission or the path before."""
        self._waypoints = waypoints
        self._uploads = 0
        self.lost = self.failed = ""
        self.phase = Phase.TAKING
        self._upload(t)

    def end(self, t: float) -> None:
        """Give back the mission from before, and go on with it where it is."""
        if self.phase in (Phase.TAKING, Phase.FLYING):
            self._begin_restoring(t)

    def let_go(self, t: float) -> None:
        """Command nothing more; what was inserted into the mission is taken out all the same."""
        if self.phase is not Phase.IDLE:
            self._begin_restoring(t)

    def step(self, t: float) -> None:
        """Go on with the upload, or with restoring the mission."""
        mission = self._mission
        if self.phase is Phase.IDLE:
            if mission.is_mixed:
                self._begin_restoring(t)
            return
        if mission.foreign:
            # Their mission is the mission now: nothing of ours is in it.
            self.phase = Phase.IDLE
            self.lost = "the mission was changed by another ground station"
            return
        if self.phase is Phase.RESTORING:
            self._restore(t)
        elif not self._vehicle.flies_mission:
            self.lost = f"mode changed to {self._vehicle.mode_name} by somebody else"
            self._begin_restoring(t)
        elif mission.is_mixed and not mission.is_busy:
            self.phase = Phase.TAKING
            self._upload(t)
        elif self.phase is Phase.TAKING and not mission.is_busy:
            if mission.is_inserted and not self._begun:
                # The autopilot flies on to what it had loaded before, until it is told again.
                self._begun = True
                mission.set_current(mission.first_inserted)
            elif mission.is_inserted:
                self.phase = Phase.FLYING
                self._tell("flying the maneuver as part of the mission")
            elif mission.is_unsure:
                return  # it is being looked at
            elif self._uploads >= _UPLOADS:
                self.failed = "the maneuver could not be put into the mission"
                self._begin_restoring(t)
            else:
                self._upload(t)

    def _upload(self, t: float) -> None:
        frame = self._telemetry.frame
        self._uploads += 1
        self._begun = False
        if frame is None or self._waypoints is None:
            return
        raised = with_floor(self._waypoints, self._telemetry.ground, self._floor)
        places = zip(*frame.to_geodetic(raised), strict=True)
        items = [
            waypoint(float(latitude), float(longitude), float(altitude)) for latitude, longitude, altitude in places
        ]
        if not self._mission.insert(items, t):
            self.failed = "the mission is not known, or at its end"
            self.phase = Phase.IDLE

    def _begin_restoring(self, t: float) -> None:
        self.phase = Phase.RESTORING
        self._resumed = False
        self._t_again = t + _AGAIN_S
        self._mission.restore(t)

    def _restore(self, t: float) -> None:
        mission = self._mission
        if mission.is_busy:
            return
        if mission.is_inserted or mission.is_mixed:
            if t >= self._t_again:  # the upload failed
                self._t_again = t + _AGAIN_S
                mission.restore(t)
            return
        if mission.is_unsure:
            return  # it is being looked at
        if not self._resumed:
            self._resumed = True
            mission.set_current(mission.seq_to_resume())
        elif not mission.is_altered:
            self.phase = Phase.IDLE
            self._tell(f"mission restored, resumed at item {mission.seq_to_resume()}")
