"""The report of a tracker over a file of radar plots: one self-contained page and its pictures."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from wideberth import __version__
from wideberth.evaluation import tracking_figures as figures
from wideberth.evaluation import tracking_score_figures as scores
from wideberth.evaluation.plot_run import SeedRun
from wideberth.evaluation.report_shell import make_folder, notes_footer, number, section, shell, write_files
from wideberth.evaluation.report_style import png, svg
from wideberth.evaluation.tracking_table import MetricRow, metric_rows
from wideberth.sensors.radar.plot_file import PlotFile

Summary = Mapping[str, Any]

_ORDER = (
    "paths",
    "plots",
    "ospa",
    "timeline",
    "polar",
    "position",
    "velocity",
    "acceleration",
    "errors",
    "velocity_errors",
    "nees",
)


def write_tracking_report(out: Path, file: PlotFile, runs: Sequence[SeedRun], summary: Summary) -> Path:
    """Write ``report.html`` and its pictures as PNG.

    Parameters
    ----------
    out : Path
        A folder, made where it does not exist.
    file : PlotFile
    runs : sequence of SeedRun
        The pictures are of the first; the numbers, OSPA and NEES of all.
    summary : mapping
        As `plot_run.summary_of` makes it.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    make_folder(out)
    pictures = _pictures(file, runs)
    drawn = {f"{name}.png": png(figure) for name, (_, _, figure) in pictures.items()}
    write_files(out, {**drawn, "report.html": _page(file, runs, summary, pictures)})
    return out / "report.html"


def _pictures(file: PlotFile, runs: Sequence[SeedRun]) -> dict[str, tuple[str, str, Figure]]:
    """Return each picture by name: title, a line of text, figure."""
    plots, tracks, truth = file.scans(runs[0].seed), figures.histories(runs[0]), file.truth
    angles = " Speed, course and flight-path angle" if file.onboard else " North, east and up"
    found: dict[str, tuple[str, str, Figure]] = {}
    if truth is not None:
        found["paths"] = (
            "Flight paths",
            "In space, from above and from the side; a dot at the start"
            + (" (figures 3.6 and 3.7)." if file.onboard else "."),
            figures.path_figure(file, plots, tracks, measured=False),
        )
    found["plots"] = (
        "Flight paths with radar plots and tracks",
        f"Every plot put into its place in space (figure{'s 3.8 and 3.9' if file.onboard else ' 4.15'}).",
        figures.path_figure(file, plots, tracks, measured=True),
    )
    found["polar"] = (
        "What the radar measured",
        "Range, azimuth and elevation, and what the tracks say they are"
        f" (figure {'3.10' if file.onboard else '4.14'}).",
        figures.polar_figure(file, plots, tracks),
    )
    numbers = ("3.11", "3.12", "3.13") if file.onboard else ("4.16", "4.17", "")
    for what, told in zip(("position", "velocity", "acceleration"), numbers, strict=True):
        about = {"position": "", "velocity": angles, "acceleration": angles + ", their rates"}[what]
        found[what] = (
            f"{what.capitalize()} estimates",
            ("Tracks" if truth is None else "Tracks on the truth")
            + (f" (figure {told})" if told else "")
            + (f".{about}." if about else "."),
            figures.state_figure(file, plots, tracks, what),
        )
    if truth is None:
        return found
    found["ospa"] = (
        "OSPA against time",
        "How far the set of tracks is from the set of visible aircraft, c = 50 m, p = 2.",
        scores.ospa_figure(runs),
    )
    found["errors"] = (
        "Errors of position",
        "Estimate minus truth of the assigned track, in the band that its covariance promises.",
        scores.error_figure(truth, tracks, file.t, "position"),
    )
    found["velocity_errors"] = ("Errors of velocity", "", scores.error_figure(truth, tracks, file.t, "velocity"))
    found["nees"] = (
        "NEES of position and velocity",
        "1 where covariances are honest; above, the tracker believes itself too much.",
        scores.nees_figure(runs),
    )
    found["timeline"] = (
        "Life of the tracks",
        "A change of colour within a row is a track that went over to another aircraft.",
        scores.timeline_figure(truth, tracks, file.t),
    )
    return found


def _page(
    file: PlotFile, runs: Sequence[SeedRun], summary: Summary, pictures: Mapping[str, tuple[str, str, Figure]]
) -> str:
    state, headline, sentence = verdict(summary)
    span = file.t[-1] - file.t[0]
    several = f"{len(runs)} seeds, pictures of seed {runs[0].seed}" if len(runs) > 1 else f"seed {runs[0].seed}"
    where = "a radar on board" if file.onboard else "a radar on the ground"
    subtitle = f"{file.name}: {where}, {len(file.t)} scans over {span:.0f} s, {several}"
    body = [_tiles(summary), _tables(summary, len(runs) > 1)]
    for name in _ORDER:
        if name in pictures:
            title, text, figure = pictures[name]
            body.append(section(title, text, svg(figure, title)))
    notes = ["Numbers of figures are those of the R-RANSAC thesis.", f"wideberth {__version__}."]
    if file.truth is None:
        notes.insert(0, "The file has no truth: the tracks are shown, but not scored.")
    body.append(notes_footer(notes))
    return shell(f"Tracks by {summary['tracker']}", subtitle, state, headline, sentence, "\n".join(body))


def verdict(summary: Summary) -> tuple[str, str, str]:
    """Return state, headline and sentence of the page.

    Parameters
    ----------
    summary : mapping
        As `plot_run.summary_of` makes it.

    Returns
    -------
    tuple of str
    """
    m = summary["metrics"]
    if m is None:
        return "warn", "Not scored", "The file has no truth to score the tracks by."
    faults = [
        (m["never_confirmed"], "aircraft never tracked", "aircraft never tracked", "bad"),
        (
            m["intruder_taken_for_ownship_scans"],
            "scan with an intruder taken for the ownship",
            "scans with an intruder taken for the ownship",
            "bad",
        ),
        (m["false_tracks"], "false track", "false tracks", "warn"),
        (m["identity_switches"], "identity switch", "identity switches", "warn"),
    ]
    found = [(_count(number_, one, many), state) for number_, one, many, state in faults if number_]
    sentence = (
        f"OSPA {number(m['ospa_m'], ' m', 2)}, first confirmed after {number(m['first_confirmed_s'], ' s', 2)}, errors "
        f"{number(m['rmse_position_m'], ' m', 2)} and {number(m['rmse_velocity_mps'], ' m/s', 2)}."
    )
    if not found:
        return "good", "Every aircraft tracked, no false track, no identity switch", sentence
    state = "bad" if any(state == "bad" for _, state in found) else "warn"
    return state, ", ".join(words for words, _ in found), sentence


def _count(count: int, one: str, many: str) -> str:
    return f"{count:,} {one if count == 1 else many}"


def _tiles(summary: Summary) -> str:
    m = summary["metrics"]
    tiles = [("CPU time a scan", number(summary["cpu_ms_per_scan"], " ms", 3), "compiling not counted")]
    if m is not None:
        share = "–" if m["coverage_95_horizontal"] is None else f"{100 * m['coverage_95_horizontal']:.1f}\u00a0%"
        tiles = [
            (
                "OSPA after 10 s",
                number(m["ospa_m"], " m", 2),
                f"cardinality {number(m['ospa_cardinality_m'], ' m', 2)}",
            ),
            ("first confirmed", number(m["first_confirmed_s"], " s", 2), "mean over targets, from scan 0"),
            (
                "RMSE of position",
                number(m["rmse_position_m"], " m", 2),
                f"of velocity {number(m['rmse_velocity_mps'], ' m/s', 2)}",
            ),
            (
                "false tracks, switches",
                f"{m['false_tracks']} / {m['identity_switches']}",
                f"{_count(m['tracks'], 'track', 'tracks')} in {_count(m['runs'], 'run', 'runs')}",
            ),
            (
                "NEES per dof",
                number(m["nees_per_dof"], "", 2),
                f"95 % ellipse holds {share}",
            ),
            *tiles,
        ]
    cells = "".join(
        f'<div class="tile"><span>{escape(name)}</span><b>{escape(value)}</b><br><small>{escape(more)}</small></div>'
        for name, value, more in tiles
    )
    return f'<div class="tiles">{cells}</div>'


def _tables(summary: Summary, several: bool) -> str:
    """Return the numbers in two tables side by side: how many and how far, and how exact and how honest."""
    head = '<th class="n">all seeds</th><th class="n">worst</th>' if several else '<th class="n">value</th>'
    rows = metric_rows(summary)
    counters = [MetricRow(name, f"{count:,}", "", "") for name, count in summary["counters"].items()]
    first = next((k for k, row in enumerate(rows) if row.name.startswith("RMSE")), len(rows))
    tables = []
    for part in (rows[1:first], [*rows[first:], rows[0], *counters]):
        cells = "".join(
            f'<tr><td>{escape(row.name)}</td><td class="n">{escape(row.value)}</td>'
            + (f'<td class="n">{escape(row.worst)}</td>' if several else "")
            + f"<td>{escape(row.unit)}</td></tr>"
            for row in part
        )
        tables.append(f'<div class="scroll"><table><tr><th></th>{head}<th></th></tr>{cells}</table></div>')
    if first == len(rows):
        return section("Numbers", "", tables[1])
    left = section("Which aircraft", "Distances count after 10 s, aircraft while they are visible.", tables[0])
    right = section("How exact, how honest", "Errors and covariances of assigned tracks after 10 s.", tables[1])
    return f'<div class="two">{left}{right}</div>'
