"""Colours and shapes of a report's pictures, chosen to be told apart without colour vision, on light and on dark."""

import re
from io import BytesIO, StringIO
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wideberth.types import AlertLevel

# Drawn with the light values; a page replaces each by the CSS variable of its name, which dark mode redefines.
INK = "#1b2430"
MUTED = "#5b6675"
FAINT = "#a9b2bd"
GRID = "#dde2e8"
PAPER = "#fdfdfe"
OWNSHIP = "#0b5cad"
MISSION = "#7d8793"
MANEUVER = "#7a3e9d"
LIMIT = "#c0261c"

# After Okabe and Ito; the ownship's blue is left out.
TRAFFIC = ("#d55e00", "#009e73", "#cc79a7", "#b8860b", "#3ba3dc", "#8c564b", "#5f6caf", "#6b8e23")
LEVELS = {
    AlertLevel.CLEAR: "#d9dfe6",
    AlertLevel.UNKNOWN: "#8f9aa8",
    AlertLevel.PREVENTIVE: "#f2d04b",
    AlertLevel.CORRECTIVE: "#e8871e",
    AlertLevel.WARNING: "#b5161d",
}
DARK = {
    INK: "#e8ecf1",
    MUTED: "#a7b1bd",
    FAINT: "#5f6a77",
    GRID: "#2c3541",
    PAPER: "#151b23",
    OWNSHIP: "#6cb2f5",
    MISSION: "#8b96a3",
    MANEUVER: "#c79be0",
    LIMIT: "#ff7a6e",
    TRAFFIC[0]: "#f08a3c",
    TRAFFIC[1]: "#35c79b",
    TRAFFIC[2]: "#e3a3c5",
    TRAFFIC[3]: "#d9ab2f",
    TRAFFIC[4]: "#7cc4ee",
    TRAFFIC[5]: "#bd8b80",
    TRAFFIC[6]: "#9aa5e0",
    TRAFFIC[7]: "#a3c25a",
    LEVELS[AlertLevel.CLEAR]: "#323c49",
    LEVELS[AlertLevel.UNKNOWN]: "#7c8794",
    LEVELS[AlertLevel.WARNING]: "#e2483f",
}
_NAMES = {colour: f"--c{k}" for k, colour in enumerate(DARK)}

# How people call the presets.
VOLUME_NAMES = {
    "sarp": "SARP (ADS-B paper)",
    "do365_phase1": "DO-365 I",
    "do365_buffered": "DO-365 buffered",
    "do365_noncooperative": "DO-365 non-coop.",
    "astm_f3442": "ASTM F3442",
    "nmac": "NMAC",
}

RC: dict[Any, Any] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 9.5,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": MUTED,
    "axes.titlecolor": INK,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.facecolor": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": MUTED,
    "ytick.labelcolor": MUTED,
    "text.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "figure.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "svg.fonttype": "none",
    "svg.hashsalt": "wideberth",
    "path.simplify": True,
}


def _settle(figure: Figure) -> None:
    """Lay the figure out once for all: each save would do it again."""
    if figure.get_layout_engine() is not None:
        figure.draw_without_rendering()
        figure.set_layout_engine("none")


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure; the size is in inches."""
    return Figure(figsize=(width, height), layout="constrained")


def traffic_colour(index: int) -> str:
    """Return the colour of the index-th near aircraft."""
    return TRAFFIC[index % len(TRAFFIC)]


def traffic_dashes(index: int) -> str:
    """Return the line style of the index-th near aircraft: the colours repeat with other dashes."""
    return ("-", "--", "-.", ":")[index // len(TRAFFIC) % 4]


def png(figure: Figure) -> bytes:
    """Return the figure as PNG, in the light colours."""
    with rc_context(RC):
        _settle(figure)
        out = BytesIO()
        figure.savefig(out, format="png", dpi=150, metadata={"Software": None})
    return out.getvalue()


def svg(figure: Figure, title: str) -> str:
    """Return the figure as inline SVG that takes its colours from the page; `title` is what a screen reader says."""
    with rc_context(RC):
        _settle(figure)
        out = StringIO()
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    for colour, name in _NAMES.items():
        text = text.replace(colour, f"var({name})")
    text = re.sub(r"font: ([\d.]+)px 'DejaVu Sans'", r"font: \1px var(--font)", text)
    text = re.sub(r"font: (\w+) ([\d.]+)px 'DejaVu Sans'", r"font: \1 \2px var(--font)", text)
    return re.sub(r'<svg ([^>]*?)width="[^"]*" height="[^"]*"|<svg ', r"<svg \1", text, count=1).replace(
        "<svg ", f'<svg role="img" aria-label="{title}" ', 1
    )


def css_variables(*, dark: bool) -> str:
    """Return the CSS declarations of the pictures' colours."""
    return "".join(f"{name}:{DARK[colour] if dark else colour};" for colour, name in _NAMES.items())


def clock_axis(axes: Axes, span: float) -> None:
    """Label an x axis of seconds since the start as minutes and seconds."""
    from matplotlib.ticker import FuncFormatter, MultipleLocator

    step = next((s for s in (5, 10, 15, 30, 60, 120, 300, 600, 1200, 1800, 3600) if span / s <= 10), 7200)
    axes.xaxis.set_major_locator(MultipleLocator(step))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: clock(x)))


def clock(seconds: float) -> str:
    """Return seconds as ``m:ss``, with hours where there are any."""
    sign, whole = ("-" if seconds < -0.5 else ""), round(abs(seconds))
    hours, rest = divmod(whole, 3600)
    minutes, second = divmod(rest, 60)
    return f"{sign}{hours}:{minutes:02d}:{second:02d}" if hours else f"{sign}{minutes}:{second:02d}"
