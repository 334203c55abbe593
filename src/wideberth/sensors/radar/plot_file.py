"""Recorded or simulated radar plots from a file (NPZ), with the truth kept apart from what a tracker may see.

In the file positions and velocities are north, east, *up*; here they are north, east, down. Azimuth is
``atan2(east, north)`` and elevation ``asin(up / range)`` in the frame of the radar: the local frame for a radar on the
ground, the body frame for one that an aircraft carries (arrays ``own_pos``, ``own_vel``, ``own_att``). A radar on the
ground may also stand elsewhere and look anywhere (``radar_pos``: north, east, up, m; ``radar_att``: roll, pitch, yaw,
rad), with angles in its own axes, and give range rates (``meas_range_rate``, m/s, NaN where it does not, with the
standard deviation ``sigma_range_rate``). Where plots differ in how good they are, ``meas_sigma`` (rows, 4) holds the
standard deviations of each one's range, azimuth, elevation and range rate; ``sigma`` then is what is typical.
"""

import math
import os
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.errors import InputError
from wideberth.frames import rotation_ned_body
from wideberth.plots import Plots

__all__ = ["PlotFile", "PlotTruth", "Plots", "read_plot_file"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

GROUND_FIELD_OF_VIEW = (math.pi, math.pi / 2)
# Three units of 120 deg in azimuth and 60 deg up and down (R-RANSAC thesis, section 3.3.5).
ONBOARD_FIELD_OF_VIEW = (math.pi, math.radians(60.0))
_NEU_NED = np.array([1.0, 1.0, -1.0])
_PLOT_ARRAYS = ("meas_seed", "meas_scan", "meas_time", "meas_range", "meas_az", "meas_el")


@dataclass(frozen=True, slots=True)
class PlotTruth:
    """Where the aircraft really were, for the metrics and for nothing else; the same in every run of a file.

    Attributes
    ----------
    position, velocity : ndarray, shape (n_scans, n_targets, 3)
        Local NED, m and m/s.
    visible : ndarray of bool, shape (n_scans, n_targets)
        Whether the target was inside range and field of view.
    ownship : int
        Which target is the ownship; -1 none.
    """

    position: FloatArray
    velocity: FloatArray
    visible: NDArray[np.bool_]
    ownship: int


@dataclass(frozen=True, slots=True)
class PlotFile:
    """A file of radar plots: some runs (seeds) over the same flights.

    Attributes
    ----------
    name : str
        Of the file.
    seed, scan : ndarray of int64, shape (rows,)
        Run and scan of each plot; the rows of a run stand together, in order of scan.
    z : ndarray, shape (rows, 4)
        As `Plots.z`.
    t : ndarray, shape (n_scans,)
        Time of each scan, s.
    sensor_position, sensor_attitude, sigma, detection_probability, range_max, field_of_view, dt, ownship, variance
        As in `Plots`.
    onboard : bool
        Whether the ownship carries the radar.
    truth : PlotTruth or None
        None where the file has no truth.
    """

    name: str
    seed: IntArray
    scan: IntArray
    z: FloatArray
    t: FloatArray
    sensor_position: FloatArray
    sensor_attitude: FloatArray
    sigma: FloatArray
    detection_probability: float
    range_max: float
    field_of_view: tuple[float, float]
    dt: float
    ownship: FloatArray
    variance: FloatArray | None
    onboard: bool
    truth: PlotTruth | None

    def seeds(self) -> tuple[int, ...]:
        """Return the runs in the file, in order."""
        return tuple(int(seed) for seed in np.unique(self.seed))

    def scans(self, seed: int) -> Plots:
        """Return the plots of one run.

        Parameters
        ----------
        seed : int
            One of `seeds`.

        Returns
        -------
        Plots

        Raises
        ------
        InputError
            If the file has no such run.
        """
        known = self.seeds()
        if seed not in known:
            raise InputError(f"{self.name} has no seed {seed}: it has {', '.join(map(str, known)) or 'none'}")
        rows = self.seed == seed
        return Plots(
            first=np.searchsorted(self.scan[rows], np.arange(len(self.t) + 1)).astype(np.int64),
            z=np.ascontiguousarray(self.z[rows]),
            t=self.t.copy(),
            sensor_position=self.sensor_position.copy(),
            sensor_attitude=self.sensor_attitude.copy(),
            sigma=self.sigma.copy(),
            detection_probability=self.detection_probability,
            range_max=self.range_max,
            field_of_view=self.field_of_view,
            dt=self.dt,
            ownship=self.ownship.copy(),
            variance=None if self.variance is None else np.ascontiguousarray(self.variance[rows]),
        )


def read_plot_file(path: str | os.PathLike[str], field_of_view: tuple[float, float] | None = None) -> PlotFile:
    """Return the plots of a file.

    Only faults of the file's make are refused. Plots that cannot be right (NaN, ranges below zero, scans whose time
    goes back) are passed on, for a tracker must stand them and count them; a plot whose time is not that of its scan
    (by more than half of ``dt``) is passed on as NaN.

    Parameters
    ----------
    path : str or Path
    field_of_view : tuple of float, optional
        Azimuth and elevation half-widths, rad. Without it as the file says (array ``field_of_view``), else everything
        for a radar on the ground, and 180 deg and 60 deg for one on board (thesis, section 3.3.5).

    Returns
    -------
    PlotFile

    Raises
    ------
    InputError
        If the file cannot be read or is not NPZ, or an array is missing or has a wrong shape, type or value; the
        message names the file and the array.
    """
    file = Path(path)
    try:
        loaded = np.load(file, allow_pickle=False)
        if not isinstance(loaded, np.lib.npyio.NpzFile):
            raise InputError(f"{file} is one array: a plot file is NPZ with several, as numpy.savez writes it")
        with loaded:
            arrays: dict[str, NDArray[Any]] = {name: loaded[name] for name in loaded.files}
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{file} does not exist") from None
    except OSError as error:
        raise InputError(f"cannot read {file}: {error.strerror or error}") from None
    except (ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(f"{file} is no plot file (NPZ): {error}") from None
    return _Reader(file.name, arrays).plot_file(field_of_view)


class _Reader:
    """Checks the arrays of one file and puts them together."""

    def __init__(self, name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        self._name = name
        self._arrays = arrays

    def plot_file(self, field_of_view: tuple[float, float] | None) -> PlotFile:
        missing = [name for name in (*_PLOT_ARRAYS, "time", "sigma", "p_d", "r_max", "dt") if name not in self._arrays]
        if missing:
            raise InputError(f"{self._name} lacks {', '.join(missing)}: it is no file of radar plots")
        t = self._numbers("time", (None,))
        n_scans, dt = len(t), self._positive("dt")
        if n_scans == 0:
            raise InputError(f"{self._name}: time is empty: there is no scan")
        seed, scan, z, variance = self._rows(t, dt)
        truth = self._truth(n_scans)
        onboard = any(name in self._arrays for name in ("own_pos", "own_vel", "own_att"))
        position, attitude = np.zeros((n_scans, 3)), np.tile(np.eye(3), (n_scans, 1, 1))
        ownship = np.full((n_scans, 6), np.nan)
        if onboard:
            position = self._numbers("own_pos", (n_scans, 3)) * _NEU_NED
            self._numbers("own_vel", (n_scans, 3))
            attitude = _rotation(self._numbers("own_att", (n_scans, 3)))
        elif truth is not None and truth.ownship >= 0:
            # Stands in for telemetry, which only says which track is the ownship's.
            own = truth.ownship
            ownship = np.concatenate([truth.position[:, own], truth.velocity[:, own]], axis=1)
        if not onboard and ("radar_pos" in self._arrays or "radar_att" in self._arrays):
            position = np.tile(self._numbers("radar_pos", (3,)) * _NEU_NED, (n_scans, 1))
            attitude = np.tile(rotation_ned_body(*self._numbers("radar_att", (3,)).tolist()), (n_scans, 1, 1))
        sigma = self._numbers("sigma", (3,))
        if np.any(sigma <= 0):
            raise InputError(f"{self._name}: sigma must be positive, got {sigma.tolist()}")
        rate_sigma = self._positive("sigma_range_rate") if "sigma_range_rate" in self._arrays else math.nan
        p_d = float(self._numbers("p_d", ()))
        if not 0.0 < p_d <= 1.0:
            raise InputError(f"{self._name}: p_d must be more than 0 and at most 1, got {p_d:g}")
        return PlotFile(
            name=self._name,
            seed=seed,
            scan=scan,
            z=z,
            t=t,
            sensor_position=position,
            sensor_attitude=attitude,
            sigma=np.append(sigma, rate_sigma),
            detection_probability=p_d,
            range_max=self._positive("r_max"),
            field_of_view=self._field_of_view(field_of_view, onboard),
            dt=dt,
            ownship=ownship,
            variance=variance,
            onboard=onboard,
            truth=truth,
        )

    def _rows(self, t: FloatArray, dt: float) -> tuple[IntArray, IntArray, FloatArray, FloatArray | None]:
        seed = self._integers("meas_seed", (None,))
        rows = len(seed)
        scan = self._integers("meas_scan", (rows,))
        outside = np.flatnonzero((scan < 0) | (scan >= len(t)))
        if len(outside):
            row = int(outside[0])
            raise InputError(
                f"{self._name}: meas_scan is {scan[row]} in row {row}: time has {len(t)} scans, counted from 0"
            )
        # The rows of a run may be spread over the file, but stand in its order.
        order = np.argsort(seed, kind="stable")
        back = np.flatnonzero((np.diff(scan[order]) < 0) & (np.diff(seed[order]) == 0))
        if len(back):
            row = int(order[back[0] + 1])
            raise InputError(f"{self._name}: meas_scan goes back in row {row}: sort the rows of each seed by scan")
        when = self._numbers("meas_time", (rows,), finite=False)
        z = np.full((rows, 4), np.nan)
        for column, name in enumerate(("meas_range", "meas_az", "meas_el")):
            z[:, column] = self._numbers(name, (rows,), finite=False)
        if "meas_range_rate" in self._arrays:
            z[:, 3] = self._numbers("meas_range_rate", (rows,), finite=False)
        z[~(np.abs(when - t[scan]) <= 0.5 * dt)] = np.nan
        return seed[order], scan[order], z[order], self._variance(z, order)

    def _variance(self, z: FloatArray, order: NDArray[np.intp]) -> FloatArray | None:
        if "meas_sigma" not in self._arrays:
            return None
        sigma = self._numbers("meas_sigma", (len(z), 4), finite=False)
        wrong = np.argwhere(np.isfinite(z) & ~((sigma > 0.0) & np.isfinite(sigma)))
        if len(wrong):
            row, column = wrong[0].tolist()
            raise InputError(
                f"{self._name}: meas_sigma must be positive where something is measured, got {sigma[row, column]:g} in "
                f"row {row}, column {column}"
            )
        return sigma[order] ** 2

    def _truth(self, n_scans: int) -> PlotTruth | None:
        if "truth_pos" not in self._arrays:
            return None
        position = self._numbers("truth_pos", (n_scans, None, 3))
        targets = position.shape[1]
        velocity = self._numbers("truth_vel", (n_scans, targets, 3))
        visible = np.ones((n_scans, targets), dtype=np.bool_)
        if "truth_visible" in self._arrays:
            array = self._arrays["truth_visible"]
            if array.dtype.kind != "b":
                raise InputError(f"{self._name}: truth_visible must be true or false, got {array.dtype}")
            self._check_shape("truth_visible", array, (n_scans, targets))
            visible = array.astype(np.bool_)
        ownship = int(self._integers("ownship_id", ())) if "ownship_id" in self._arrays else -1
        if not -1 <= ownship < targets:
            raise InputError(f"{self._name}: ownship_id is {ownship}: one of {targets} targets from 0, or -1 for none")
        return PlotTruth(position * _NEU_NED, velocity * _NEU_NED, visible, ownship)

    def _field_of_view(self, given: tuple[float, float] | None, onboard: bool) -> tuple[float, float]:
        if given is None and "field_of_view" in self._arrays:
            azimuth, elevation = self._numbers("field_of_view", (2,)).tolist()
        else:
            azimuth, elevation = given or (ONBOARD_FIELD_OF_VIEW if onboard else GROUND_FIELD_OF_VIEW)
        if not (0.0 < azimuth <= math.pi and 0.0 < elevation <= math.pi / 2):
            raise InputError(
                f"{self._name}: field_of_view must be half-widths in rad, up to pi and pi/2, got "
                f"({azimuth:g}, {elevation:g})"
            )
        return azimuth, elevation

    def _positive(self, name: str) -> float:
        value = float(self._numbers(name, ()))
        if value <= 0:
            raise InputError(f"{self._name}: {name} must be positive, got {value:g}")
        return value

    def _integers(self, name: str, shape: tuple[int | None, ...]) -> IntArray:
        array = self._arrays[name]
        if array.dtype.kind not in "iu":
            raise InputError(f"{self._name}: {name} must be whole numbers, got {array.dtype}")
        self._check_shape(name, array, shape)
        return array.astype(np.int64)

    def _numbers(self, name: str, shape: tuple[int | None, ...], *, finite: bool = True) -> FloatArray:
        if name not in self._arrays:
            raise InputError(f"{self._name} lacks {name}")
        array = self._arrays[name]
        if array.dtype.kind not in "iuf":
            raise InputError(f"{self._name}: {name} must be numbers, got {array.dtype}")
        self._check_shape(name, array, shape)
        numbers = array.astype(np.float64)
        if finite and not np.isfinite(numbers).all():
            where = np.argwhere(~np.isfinite(numbers))[0].tolist()
            raise InputError(f"{self._name}: {name} is not finite at {where}")
        return numbers

    def _check_shape(self, name: str, array: NDArray[Any], shape: tuple[int | None, ...]) -> None:
        same = array.ndim == len(shape) and all(b in (None, a) for a, b in zip(array.shape, shape, strict=True))
        if not same:
            words = "a single number" if not shape else str(tuple("any" if n is None else n for n in shape))
            raise InputError(f"{self._name}: {name} must have shape {words}, got {array.shape}".replace("'", ""))


def _rotation(attitude: FloatArray) -> FloatArray:
    """Return C_ned_body (n, 3, 3) of roll, pitch, yaw: the transpose of (3.52) of the thesis."""
    roll, pitch, yaw = attitude.T
    c_roll, s_roll, c_pitch, s_pitch = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    c_yaw, s_yaw = np.cos(yaw), np.sin(yaw)
    rows = [
        [c_pitch * c_yaw, s_roll * s_pitch * c_yaw - c_roll * s_yaw, c_roll * s_pitch * c_yaw + s_roll * s_yaw],
        [c_pitch * s_yaw, s_roll * s_pitch * s_yaw + c_roll * c_yaw, c_roll * s_pitch * s_yaw - s_roll * c_yaw],
        [-s_pitch, s_roll * c_pitch, c_roll * c_pitch],
    ]
    return np.moveaxis(np.array(rows), -1, 0).copy()
