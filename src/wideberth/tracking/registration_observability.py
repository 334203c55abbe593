"""Which combinations of the biases of a network can be told apart, from where its radars and the aircraft are.

Pairs of plots compare radars with each other, so they are blind to everything that moves all places measured in the
same way. What that is depends on what may be wrong, for radars that see all around:

- Offsets of range, azimuth and elevation, radars at known and different places: nothing is hidden. A common turn of all
  radars shifts the places that two of them measure against each other by the turn times their distance; so it is seen
  the worse the nearer they stand, and at one place not at all (there the common offsets are hidden, three).
- Range scales: nothing more.
- Tilts (roll and pitch): of two radars the common turn about the line that joins them, of three not in a line none.
- Places of the radars as well: the common shift (two or, with the height, three) and the turn about the vertical, with
  radars displaced as if carried around; with tilts all six motions of a rigid body.
- Clocks: what is common to all. With places, and all aircraft on one straight course at one speed, each clock alone
  is a shift along that course too.

References, aircraft whose places are known, leave nothing hidden if they are seen in several places; one in one place
leaves the turns about it.
"""

from collections.abc import Sequence

import numpy as np

from wideberth.argument_checks import FINITE, NOT_NEGATIVE, checked
from wideberth.tracking import registration_kernels as kernels
from wideberth.tracking.registration_kernels import BIASES
from wideberth.types import FloatArray


def unobservable(
    sensors: FloatArray,
    attitudes: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    prior_sigma: FloatArray,
    *,
    references: Sequence[int] = (),
    tolerance: float = 1e-6,
) -> FloatArray:
    """Return the combinations of biases that aircraft seen by all radars say nothing of.

    Parameters
    ----------
    sensors, attitudes : ndarray, shape (n, 3) and (n, 3, 3)
        Poses of the radars: NED, m, and C_ned_sensor.
    positions, velocities : ndarray, shape (k, 3)
        Of the aircraft, m and m/s; one that is looked at along its path appears once for each look.
    prior_sigma : ndarray, shape (10,)
        Of the biases of each radar, as `wideberth.tracking.bias_correction.prior_sigma` gives it; 0: not estimated.
    references : sequence of int
        Numbers of the aircraft whose positions are known.
    tolerance : float
        A combination is hidden if it moves the places measured by less than this share of what the others may do.

    Returns
    -------
    ndarray, shape (m, 10 n)
        An orthonormal basis, in standard deviations of the prior.

    Raises
    ------
    ValueError
        If shapes do not fit, a value is not finite, or a reference is not among the aircraft.
    """
    n, k = len(sensors), len(positions)
    for name, value, shape in (
        ("sensors", sensors, (n, 3)),
        ("attitudes", attitudes, (n, 3, 3)),
        ("positions", positions, (k, 3)),
        ("velocities", velocities, (k, 3)),
    ):
        if checked(name, value, FINITE).shape != shape:
            raise ValueError(f"{name} must have shape {shape}, got {value.shape}")
    sigma = checked("prior_sigma", prior_sigma, NOT_NEGATIVE)
    if sigma.shape != (BIASES,):
        raise ValueError(f"prior_sigma must have shape ({BIASES},), got {sigma.shape}")
    if any(not 0 <= r < k for r in references):
        raise ValueError(f"references {tuple(references)} must be numbers of the {k} aircraft")
    columns = np.flatnonzero(np.tile(sigma, n) > 0.0)
    if not len(columns):
        return np.zeros((0, BIASES * n))
    rows: list[FloatArray] = []
    for i in range(k):
        slopes = np.zeros((n, 3, BIASES * n))
        for r in range(n):
            slopes[r, :, BIASES * r : BIASES * (r + 1)] = _place_slopes(
                sensors[r], attitudes[r], positions[i], velocities[i]
            )
        # Without a reference only differences from the mean of all radars are seen.
        rows.append((slopes if i in references else slopes - slopes.mean(axis=0)).reshape(3 * n, -1))
    seen = np.concatenate(rows) if rows else np.zeros((1, BIASES * n))
    scaled = seen[:, columns] * np.tile(sigma, n)[columns]
    _, shares, basis = np.linalg.svd(scaled, full_matrices=True)
    shares = np.concatenate([shares, np.zeros(len(columns) - len(shares))])
    hidden = shares <= tolerance * max(shares[0], 1e-300)
    found = np.zeros((int(hidden.sum()), BIASES * n))
    found[:, columns] = basis[hidden]
    return found


def _place_slopes(sensor: FloatArray, attitude: FloatArray, position: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return how the place measured of an aircraft depends on the biases of a radar (3, 10)."""
    nothing, slopes, plot = np.zeros(BIASES), np.zeros((3, BIASES)), np.zeros(3)
    x = np.concatenate([position, velocity])
    kernels.biased_plot(nothing, sensor, attitude, x, 0.0, plot, slopes, np.zeros((3, 6)), np.zeros((12, 3)))
    kernels.place(
        nothing, sensor, attitude, plot, np.zeros(3), velocity, np.zeros(3), slopes, np.zeros((3, 3)),
        np.zeros((28, BIASES)),
    )  # fmt: skip
    return slopes
