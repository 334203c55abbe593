"""Image and averaged powers of a frame, in the arithmetic that the radar has: floating or fixed point."""

from typing import Any

from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.processing.averaging import channel_powers
from wideberth.sensors.radar.processing.fixed_point import fixed_point_image, fixed_point_powers
from wideberth.sensors.radar.processing.range_compression import ComplexImage, range_compress


def frame_image(config: RadarConfig, samples: NDArray[Any]) -> ComplexImage:
    """Return the range-compressed image, in the arithmetic that the radar has."""
    return (
        range_compress(config, samples) if config.processing.fixed_point is None else fixed_point_image(config, samples)
    )


def frame_powers(config: RadarConfig, image: ComplexImage) -> tuple[FloatArray, float]:
    """Return the averaged powers of channels and bins, and how many powers are in each.

    Parameters
    ----------
    config : RadarConfig
    image : ndarray of complex64, shape (sweeps, channels, range_bins)

    Returns
    -------
    powers : ndarray, shape (channels, range_bins)
    looks : float
    """
    filtered = config.processing.clutter_filter == "moving_target"
    if config.processing.fixed_point is None:
        powers = channel_powers(config, image, moving_target=filtered)
    else:
        powers = fixed_point_powers(config, image)
    return powers, float(len(image) - filtered)
