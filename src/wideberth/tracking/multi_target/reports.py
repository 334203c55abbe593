"""ADS-B scans made ready for the kernels: addresses become places, reports are put into the order of validity."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking.kernels import NACP_COUNT, position_sigma_of
from wideberth.tracking.multi_target.config import ReportsConfig
from wideberth.tracking.multi_target.consider_kernels import BIASES
from wideberth.tracking.multi_target.heard_kernels import ReportRules
from wideberth.tracking.multi_target.own_reports import may_be_ownship
from wideberth.tracking.report_checks import report_faults
from wideberth.types import Scan, SourceInfo

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FORGET_S = 900.0
"""An address without a track and without reports for this long is forgotten."""

SLICE_S = 0.1
"""Reports of one tenth of a second are taken in together; scans of radars come between."""

_BLANK = SourceInfo()


@dataclass(frozen=True, slots=True)
class ReadyReports:
    """Reports of one sensor as `identity_kernels.take_reports` takes them; `t` is the last one's time of validity."""

    t: float
    sensor: int
    rows: IntArray
    times: FloatArray
    z: FloatArray
    variance: FloatArray
    time_sigma: FloatArray
    bias: FloatArray
    mine: NDArray[np.bool_]
    infos: tuple[SourceInfo, ...]


class AddressBook:
    """Which place an address has, and what its aircraft says of itself.

    Parameters
    ----------
    config : ReportsConfig
    """

    def __init__(self, config: ReportsConfig) -> None:
        self._config = config
        self.sensors: list[str] = []
        self.addresses: list[str] = []
        self.infos: list[SourceInfo] = []
        self._rows: dict[str, int] = {}
        self._told: list[float] = []
        self._free: list[int] = []
        self._bias: dict[int | None, tuple[float, ...]] = {}

    def name(self, place: int) -> str:
        """Return what to call the aircraft at a place in front of people: address, and callsign where it is known."""
        address, callsign = self.addresses[place].upper(), self.infos[place].callsign
        return f"{address} ({callsign})" if callsign else address

    def sensor(self, name: str) -> int:
        """Return the number of a sensor."""
        if name not in self.sensors:
            self.sensors.append(name)
        return self.sensors.index(name)

    def row(self, address: str, t: float) -> int | None:
        """Return the place of an address, a new one if need be; None if all are taken."""
        row = self._rows.get(address)
        if row is None:
            row = self.place(address, t)
            if row is not None:
                self._rows[address] = row
        elif t > self._told[row]:
            self._told[row] = t
        return row

    def place(self, address: str, t: float) -> int | None:
        """Return a place for one more aircraft; None if all are taken.

        Parameters
        ----------
        address : str
            What to call it.
        t : float
            Now, s.
        """
        if self._free:
            row = self._free.pop()
            self.addresses[row], self.infos[row], self._told[row] = address, _BLANK, t
            return row
        if len(self.addresses) >= self._config.addresses_max:
            return None
        self.addresses.append(address)
        self.infos.append(_BLANK)
        self._told.append(t)
        return len(self.addresses) - 1

    def forget(self, t: float, alive: IntArray, other: IntArray) -> list[int]:
        """Free the places of addresses that are silent and have no track; return them.

        Parameters
        ----------
        t : float
            Now, s.
        alive, other : ndarray of int64, shape (R,)
            As in `Heard`.
        """
        freed = []
        for address, row in list(self._rows.items()):
            second = int(other[row])
            if t - self._told[row] <= FORGET_S or alive[row] or (second >= 0 and alive[second]):
                continue
            del self._rows[address]
            freed.extend([row] if second < 0 else [row, second])
        self._free.extend(freed)
        return freed

    def bias(self, info: SourceInfo) -> tuple[float, ...]:
        """Return the variances (BIASES,) of an aircraft's biases, by its NACp."""
        known = self._bias.get(info.nacp)
        if known is None:
            c = self._config
            nacp = info.nacp if info.nacp is not None and 0 <= info.nacp < NACP_COUNT else c.assumed_nacp
            horizontal = position_sigma_of(nacp) ** 2
            known = (horizontal, horizontal, c.altitude_bias_sigma_m**2, c.latency_sigma_s**2)
            self._bias[info.nacp] = known
        return known

    def ready(self, scan: Scan, t: float, oldest: float, counters: Counter[str]) -> Iterator[ReadyReports]:
        """Return the usable reports of a scan in slices of time; the others are counted.

        Parameters
        ----------
        scan : Scan
            Of kind "adsb".
        t, oldest : float
            Now, and the earliest validity that is used, s.
        counters : Counter
        """
        k = len(scan.source_ids)
        counters["reports"] += k
        good = np.ones(k, np.bool_)
        for reason, bad in report_faults(scan, t, oldest):
            counters[reason] += int(np.count_nonzero(bad & good))
            good &= ~bad
        infos = scan.sources or (_BLANK,) * k
        rows = np.full(k, -1, np.int64)
        bias = np.empty((k, BIASES))
        for q in np.flatnonzero(good).tolist():
            row = self.row(scan.source_ids[q], t)
            if row is None:
                counters["address beyond the most"] += 1
                good[q] = False
                continue
            rows[q] = row
            bias[q] = self.bias(infos[q])
        order = np.flatnonzero(good)
        order = order[np.argsort(scan.t_valid[order], kind="stable")]
        times = np.asarray(scan.t_valid, dtype=np.float64)[order]
        c = self._config
        sigma = np.where(np.floor(times) == times, c.whole_second_sigma_s, c.time_sigma_s)
        variance = np.diagonal(scan.R, axis1=1, axis2=2)
        number = self.sensor(scan.sensor)
        mine = np.array([may_be_ownship(c, address) for address in scan.source_ids], np.bool_)
        edges = np.flatnonzero(np.diff(np.floor(times / SLICE_S))) + 1
        for part in np.split(np.arange(len(order)), edges):
            if len(part):
                take = order[part]
                yield ReadyReports(
                    t=float(times[part[-1]]),
                    sensor=number,
                    rows=rows[take],
                    times=times[part],
                    z=np.ascontiguousarray(scan.z[take], dtype=np.float64),
                    variance=np.ascontiguousarray(variance[take], dtype=np.float64),
                    time_sigma=sigma[part],
                    bias=bias[take],
                    mine=mine[take],
                    infos=tuple(infos[q] for q in take.tolist()),
                )


def report_scan_fault(scan: Scan) -> str | None:
    """Return why an ADS-B scan cannot be used as a whole, None where it can.

    Parameters
    ----------
    scan : Scan
    """
    k = len(scan.source_ids)
    shapes = np.shape(scan.z), np.shape(scan.R), np.shape(scan.t_valid)
    if shapes != ((k, 6), (k, 6, 6), (k,)) or len(scan.sources) not in (0, k):
        return "scan of a wrong shape"
    return None if math.isfinite(scan.t) else "scan time not finite"


def report_rules(c: ReportsConfig, existence_max: float) -> ReportRules:
    """Return the rules for the kernels.

    Parameters
    ----------
    c : ReportsConfig
    existence_max : float
        No track is surer than this.
    """
    return ReportRules(
        gate=c.gate_mahalanobis**2,
        latency=c.latency_s,
        velocity_variance=c.initial_velocity_sigma_mps**2,
        speed_variance=c.speed_sigma_mps**2,
        climb_variance=c.climb_sigma_mps**2,
        speed_max=c.speed_max_mps,
        hover_speed=c.hover_speed_mps,
        confirm=c.confirm_positions,
        link_gate=c.link_gate,
        split_gate=c.split_gate,
        lead=2.0 * c.lead_odds,
        waits=c.wait_reports,
        strikes=c.split_reports,
        keep_s=c.lost_after_s,
        keep_tentative_s=c.tentative_lost_after_s,
        existence_max=existence_max,
    )
