"""Put labels into a picture where they cover neither each other nor the things drawn."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from wideberth.evaluation.report_style import PAPER

FloatArray = NDArray[np.float64]


class Label(NamedTuple):
    """A text that belongs to a point in data coordinates."""

    x: float
    y: float
    text: str
    colour: str
    bold: bool = False


def place_labels(axes: Axes, labels: Sequence[Label], avoid: Sequence[FloatArray], size: float = 9.0) -> None:
    """Write labels near their points, joined by a thin line where they had to move away.

    Parameters
    ----------
    axes : Axes
        With its final limits.
    labels : sequence of Label
        The most important first.
    avoid : sequence of ndarray, shape (n, 2)
        Points drawn, in data coordinates, that labels should not cover.
    size : float
        Of the text, points.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    # The layout must be final before pixels mean anything.
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    drawn = [axes.transData.transform(points) for points in avoid if len(points)]
    points = np.concatenate(drawn) if drawn else np.empty((0, 2))
    points = points[np.isfinite(points).all(axis=1)]
    frame = axes.get_window_extent(renderer)
    taken: list[tuple[float, float, float, float]] = []
    pixel = figure.dpi / 72
    for label in labels:
        text = axes.text(
            label.x,
            label.y,
            label.text,
            fontsize=size,
            color=label.colour,
            fontweight="bold" if label.bold else "normal",
            ha="center",
            va="center",
            zorder=20,
            linespacing=1.15,
            bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.78, "pad": 1.2},
        )
        extent = text.get_window_extent(renderer)
        width, height = extent.width + 6 * pixel, extent.height + 4 * pixel
        x0, y0 = axes.transData.transform((label.x, label.y))
        best, best_cost = (x0, y0), math.inf
        for radius in (8, 16, 28, 44, 66, 92, 124):
            for k in range(16):
                angle = 2 * math.pi * k / 16
                x = x0 + math.cos(angle) * (radius * pixel + width / 2)
                y = y0 + math.sin(angle) * (radius * pixel + height / 2)
                box = (x - width / 2, y - height / 2, x + width / 2, y + height / 2)
                cost = radius * 0.02 + 60 * _outside(box, frame) + 50 * sum(_overlap(box, other) for other in taken)
                cost += 0.25 * np.count_nonzero(
                    (points[:, 0] > box[0])
                    & (points[:, 0] < box[2])
                    & (points[:, 1] > box[1])
                    & (points[:, 1] < box[3])
                )
                if cost < best_cost:
                    best, best_cost = (x, y), cost
        x, y = best
        taken.append((x - width / 2, y - height / 2, x + width / 2, y + height / 2))
        there = axes.transData.inverted().transform((x, y))
        text.set_position((float(there[0]), float(there[1])))
        nearest = (min(max(x0, x - width / 2), x + width / 2), min(max(y0, y - height / 2), y + height / 2))
        if math.hypot(nearest[0] - x0, nearest[1] - y0) > 14 * pixel:
            ends = axes.transData.inverted().transform(np.array([(x0, y0), nearest]))
            axes.plot(ends[:, 0], ends[:, 1], color=label.colour, linewidth=0.7, alpha=0.7, zorder=19)


def _overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _outside(box: tuple[float, float, float, float], frame: Bbox) -> bool:
    x0, y0, x1, y1 = frame.extents
    return bool(box[0] < x0 or box[1] < y0 or box[2] > x1 or box[3] > y1)
