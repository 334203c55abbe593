"""Draw how well three looks of a radar determine the nine states of the turning model, around the radar.

Each point is an aircraft at one height that flies east, level and straight, at 15 m/s. Rows are in standard deviations
of the plots (0.4 m, 1 deg, 1 deg), looks 2 s apart, columns in what is usually known of an aircraft beforehand.

    python experiments/observability_map.py docs/results/observability.png
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from wideberth.analysis.observability import observability_matrix

HEIGHT_M, SPEED_MPS, LOOKS_APART_S = 100.0, 15.0, 2.0
PLOT_SIGMA = np.array([0.4, np.radians(1.0), np.radians(1.0)])
STATE_SIZE = np.array([100.0, 100.0, 50.0, 10.0, 1.0, 0.2, 1.0, np.radians(8.0), np.radians(3.0)])


def main(path: Path) -> None:
    """Draw the map into a file."""
    north, east = np.meshgrid(np.linspace(-500.0, 500.0, 201), np.linspace(-500.0, 500.0, 201), indexing="ij")
    state = np.zeros((*north.shape, 9))
    state[..., 0], state[..., 1], state[..., 2] = north, east, HEIGHT_M
    state[..., 3], state[..., 4] = SPEED_MPS, np.pi / 2
    result = observability_matrix(
        state, np.zeros(3), element_scale=PLOT_SIGMA, state_scale=STATE_SIZE, time_scale_s=LOOKS_APART_S
    )
    weakest = np.where(result.observable, result.singular_values[..., -1], np.nan)
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    panels = [
        ("condition number (log10)", np.where(result.observable, np.log10(result.condition), np.nan)),
        ("least singular value (log10)", np.log10(weakest)),
    ]
    for axis, (title, value) in zip(axes, panels, strict=True):
        image = axis.contourf(east, north, value, levels=20)
        figure.colorbar(image, ax=axis)
        axis.plot(0.0, 0.0, "r^", label="radar")
        axis.annotate("", (-300.0, -400.0), (-450.0, -400.0), arrowprops={"arrowstyle": "->", "color": "white"})
        axis.set(title=title, xlabel="east, m", ylabel="north, m", aspect="equal")
        axis.legend(loc="upper right")
    figure.suptitle(f"Turning model, 3 looks {LOOKS_APART_S:g} s apart, {HEIGHT_M:g} m above the radar, flying east")
    figure.savefig(path, dpi=80)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
