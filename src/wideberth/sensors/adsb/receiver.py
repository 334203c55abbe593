"""The ADS-B receiver: reports of a source become the Scan of one step."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.sensors.adsb.accuracy import measurement_covariance
from wideberth.sensors.adsb.config import AdsbReceiverConfig
from wideberth.sensors.adsb.report import AdsbReport, TrafficSource
from wideberth.types import FloatArray, Scan, SensorHealth

_FORGET_AFTER = 600.0  # s without a position after which an aircraft's last place means nothing


class AdsbReceiver:
    """Turns the reports of a traffic source into scans of kind ``"adsb"`` in a local frame.

    Parameters
    ----------
    config : AdsbReceiverConfig
    source : TrafficSource
    frame : LocalFrame
    name : str
        Of the sensor.

    Notes
    -----
    Altitudes are pressure altitudes; the geometric altitude is used only of aircraft that give no other, as the two
    differ by hundreds of feet and must not take turns. Velocities are turned into the local frame at the aircraft's
    last position.
    """

    Config = AdsbReceiverConfig
    name = "adsb"

    def __init__(self, config: AdsbReceiverConfig, source: TrafficSource, frame: LocalFrame, name: str = name) -> None:
        self._config = config
        self._source = source
        self._frame = frame
        self._name = name
        self._places: dict[str, tuple[float, float, float]] = {}  # t, latitude, longitude
        self._has_pressure_altitude: set[str] = set()
        self._left_out: Counter[str] = Counter()
        self._passed = 0

    @property
    def counters(self) -> dict[str, int]:
        """The counters of the source, and those of the reports that this receiver passed or left out."""
        return self._source.counters | {"reports passed": self._passed} | dict(self._left_out)

    def health(self, t: float) -> SensorHealth:
        """Return the source's health with this receiver's own rejections among the rejects."""
        health = self._source.health(t)
        return replace(health, rejects={**health.rejects, **self._left_out}) if self._left_out else health

    def sense(self, t: float, own_position: FloatArray | None = None) -> Scan:
        """Return the reports since the last call.

        Parameters
        ----------
        t : float
            Time of the step, Unix s.
        own_position : ndarray, shape (3,), optional
            Local NED, m; ranges are taken from it, from the frame's origin if it is not given.

        Returns
        -------
        Scan
            One row per report; times of validity are those of receipt.
        """
        own = np.zeros(3) if own_position is None else own_position
        window = self._config.altitude_window_m if own_position is not None else None
        placed = self._with_place(self._source.poll(t))
        if not placed:
            return self._scan(t, np.zeros((0, 6)), [])
        reports = [report for report, _, _ in placed]
        places = np.array([place for _, *place in placed])
        values = np.array(
            [
                (
                    report.latitude,
                    self._altitude(report),
                    report.velocity_north,
                    report.velocity_east,
                    -report.climb_rate,
                )
                for report in reports
            ]
        )
        z = np.empty((len(reports), 6))
        z[:, :3] = self._frame.to_ned(places[:, 0], places[:, 1], values[:, 1])
        z[:, 3:] = self._frame.velocity_to_ned(places[:, 0], places[:, 1], values[:, 2:])
        near = np.hypot(z[:, 0] - own[0], z[:, 1] - own[1]) <= self._config.range_max_m
        if not near.all():
            self._left_out["out of range"] += int(np.sum(~near))
        if window is not None:
            beside = near & (np.abs(z[:, 2] - own[2]) > window)  # NaN: altitude not in this report, passes
            if beside.any():
                self._left_out["outside the altitude window"] += int(np.sum(beside))
                near &= ~beside
        z[np.isnan(values[:, 0]), :2] = np.nan  # placed by an earlier report: this one carries no position
        empty = near & np.isnan(z).all(axis=1)
        if empty.any():
            near &= ~empty
        kept = np.flatnonzero(near)
        return self._scan(t, z[kept], [reports[k] for k in kept])

    def _with_place(self, reports: Sequence[AdsbReport]) -> list[tuple[AdsbReport, float, float]]:
        """Return the reports of aircraft whose place is known, each with the latitude and longitude then known."""
        placed = []
        for report in reports:
            if report.on_ground:
                self._left_out["surface"] += 1
                continue
            if not math.isnan(report.pressure_altitude):
                self._has_pressure_altitude.add(report.address)
            if not math.isnan(report.latitude):
                self._places[report.address] = (report.t, report.latitude, report.longitude)
            else:
                place = self._places.get(report.address)
                if place is None or report.t - place[0] > _FORGET_AFTER:
                    self._left_out["no position yet"] += 1
                    continue
            placed.append((report, *self._places[report.address][1:]))
        return placed

    def _altitude(self, report: AdsbReport) -> float:
        if report.address in self._has_pressure_altitude:
            return report.pressure_altitude
        return report.geometric_altitude

    def _scan(self, t: float, z: FloatArray, reports: Sequence[AdsbReport]) -> Scan:
        self._passed += len(reports)
        infos = tuple(report.info for report in reports)
        covariance = measurement_covariance(infos, self._config.noise, -z[:, 5]) if reports else np.zeros((0, 6, 6))
        return Scan(
            t,
            t,
            self._name,
            "adsb",
            z,
            covariance,
            np.array([report.t for report in reports]),
            tuple(report.address for report in reports),
            infos,
            health=self.health(t),
        )
