"""The report on the stability of the vertical avoidance loop (CAS thesis, figures 5.6, 5.10, tables 5.1 to 5.3)."""

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wideberth import __version__
from wideberth.analysis.describing_functions import (
    LimitCycle,
    exact_switching_limit_cycle,
    saturation_limit_cycle,
    switching_limit_cycle,
)
from wideberth.analysis.limit_cycle_flights import measured, saturation_flight, switching_flight
from wideberth.analysis.stability import LAWS, eigenvalues, largest_stable_delay, tangent_gains
from wideberth.evaluation.report_shell import notes_footer, number, section, shell, table, write_files
from wideberth.evaluation.report_style import INK, LIMIT, OWNSHIP, RC, new_figure, png, svg, traffic_colour

FloatArray = NDArray[np.float64]

# Feet and seconds, as in the source: two vehicles that approach at 1 ft/s, a sphere of 12 ft.
SEPARATION_FT = 12.0
_BESIDE = 1e-3  # of it: side by side but for rounding, which may leave no tangent
ORDERS: tuple[int | None, ...] = (1, 2, 4, None)
LAW_WORDS = {
    "full": "both make all of the change",
    "shared": "both make half, as printed",
    "shared_corrected": "both make half, mended",
    "non_cooperative": "only one avoids",
}


def critical_gain(tau: float, law: str, *, as_printed: bool = False) -> float:
    """Return the K below which the loop oscillates, 1/s (tables 5.1 to 5.3).

    Parameters
    ----------
    tau : float
        Lag of the vertical velocity, s.
    law : str
        One of `stability.LAWS`.
    as_printed : bool
        Without the 1/tau on K.
    """
    share = {"full": 2.0, "shared": 1.0, "shared_corrected": 4.0, "non_cooperative": 4.0}[law]
    return -1.0 / (share * tau * (tau if as_printed else 1.0))


def gain_figure() -> Figure:
    """Return figure 5.6: K along three head-on passes at 1 ft/s."""
    with rc_context(RC):
        figure = new_figure(9.6, 3.8)
        axes = figure.add_subplot()
        x = np.linspace(30.0, -30.0, 1201)
        for k, (share, words) in enumerate(
            ((1.0, "one above the other"), (0.5, "half beside"), (_BESIDE, "side by side"))
        ):
            z = -share * SEPARATION_FT
            y = math.sqrt(SEPARATION_FT**2 - z * z)
            gains = np.array([_gain(place, y, z) for place in x])
            axes.plot(
                x, gains, color=traffic_colour(k), linestyle=("-", "--", ":")[k], linewidth=(3.6, 2.2, 1.4)[k],
                label=f"$z_r$ = {round(z):g} ft: {words}",
            )  # fmt: skip
        axes.axhline(0.0, color=INK, linewidth=0.8)
        axes.invert_xaxis()
        axes.set_ylim(-2.0, 1.0)
        axes.set_xlabel("distance ahead $x_r$, ft (approaching at 1 ft/s; below 0 they have passed)")
        axes.set_ylabel("K, 1/s")
        axes.legend(loc="lower left")
    return figure


def _gain(x: float, y: float, z: float) -> float:
    try:
        return float(tangent_gains([x, y, z], [-1.0, 0.0, 0.0], SEPARATION_FT).position[2])
    except ValueError:
        return math.nan


def locus_figure(tau: float) -> Figure:
    """Return where the eigenvalues go as K falls from 0.5 to -10 1/s, for each law."""
    with rc_context(RC):
        figure = new_figure(9.6, 3.6)
        panels = figure.subplots(1, 4, sharex=True, sharey=True)
        gains = np.linspace(0.5, -10.0, 400)
        for axes, law in zip(panels, LAWS, strict=True):
            values = np.array([eigenvalues(k, tau, law) for k in gains])
            shades = np.repeat(gains, values.shape[1])
            drawn = axes.scatter(values.real.ravel(), values.imag.ravel(), c=shades, s=5, cmap="viridis_r")
            axes.axvline(0.0, color=LIMIT, linewidth=1.0)
            axes.set_title(LAW_WORDS[law], fontsize="small")
            axes.set_xlabel("real part, 1/s")
        panels[0].set_ylabel("imaginary part, 1/s")
        figure.colorbar(drawn, ax=panels, label="K, 1/s")
    return figure


def delay_figure(tau: float) -> Figure:
    """Return figure 5.10, against the distance ahead; against the time left, with approximations; and by law."""
    with rc_context(RC):
        figure = new_figure(12.0, 3.8)
        places, middle, right = figure.subplots(1, 3)
        x = np.linspace(0.1, 30.0, 200)
        for k, speed in enumerate((1.0, 2.0, 5.0)):
            delay = np.asarray(largest_stable_delay(x / speed, tau))
            places.plot(x, delay, color=traffic_colour(k), label=f"{speed:g} ft/s")
            places.plot(x, 2.0 * x / speed, color=traffic_colour(k), linestyle=":")
        places.set_title("figure 5.10 (dotted: printed)")
        places.set_ylim(0.0, 20.0)
        places.set_xlabel("distance ahead $x_r$, ft")
        t_star = np.linspace(0.05, 20.0, 200)
        for k, order in enumerate(ORDERS):
            words = "exact" if order is None else f"Padé of order {order}" + (" (2 t*, printed)" if order == 1 else "")
            delay = np.asarray(largest_stable_delay(t_star, tau, "full", order))
            colour = OWNSHIP if order is None else traffic_colour(k)
            middle.plot(t_star, delay, color=colour, linewidth=2.4 if order is None else 1.4, label=words)
        middle.set_title("both make all of the change")
        middle.set_ylim(0.0, 15.0)
        for k, law in enumerate(LAWS[:3]):
            right.plot(t_star, np.asarray(largest_stable_delay(t_star, tau, law)), color=traffic_colour(k),
                       label=LAW_WORDS[law])  # fmt: skip
        right.set_title("exact, by law")
        for axes in (middle, right):
            axes.set_xlabel("time to the closest point t*, s")
        places.set_ylabel("largest stable delay, s")
        places.legend(loc="upper right", fontsize="small", title="relative speed", framealpha=0.9)
        middle.legend(loc="center right", fontsize="small")
        right.legend(loc="lower right", fontsize="small")
    return figure


LIMIT_FT_PER_S = 2.0
CYCLES_T_STAR = 2.0
DELAY_SHARES = (0.9, 1.1, 1.3, 1.6, 2.0)
SWITCHES = ((0.0, 0.5), (1.0, 0.5), (1.0, 2.0), (1.0, 0.0), (4.0, 0.0))  # hysteresis, ft, and delay, s


def saturation_rows(tau: float) -> list[list[str]]:
    """Return, for delays about the limit of stability, the limit cycle of the limited commands: predicted and flown."""
    limit = float(largest_stable_delay(CYCLES_T_STAR, tau))
    rows = []
    for share in DELAY_SHARES:
        given = (CYCLES_T_STAR, tau, share * limit, LIMIT_FT_PER_S)
        flown = measured(*saturation_flight(*given, duration=500.0), 0.05 * LIMIT_FT_PER_S)
        rows.append([f"{share:.0%}", number(share * limit, digits=2), *_cycle(saturation_limit_cycle(*given), flown)])
    return rows


def switching_rows(tau: float) -> list[list[str]]:
    """Return the limit cycles of the switch between avoidance and return: by first harmonic, exactly, and flown."""
    rows = []
    for width, delay in SWITCHES:
        given = (CYCLES_T_STAR, tau, LIMIT_FT_PER_S, width, delay)
        exact = exact_switching_limit_cycle(*given)
        flown = measured(*switching_flight(*given))
        rows.append(
            [number(width, digits=1), number(delay, digits=1), *_cycle(switching_limit_cycle(*given), exact, flown)]
        )
    return rows


def _cycle(*cycles: LimitCycle | None) -> list[str]:
    return [
        text for c in cycles for text in (("–", "–") if c is None else (f"{c.amplitude:.3g}", f"{c.frequency:.3g}"))
    ]


def limit_cycle_figure(tau: float) -> Figure:
    """Return a command that grows into its limit cycle, with the amplitude predicted."""
    with rc_context(RC):
        figure = new_figure(9.6, 3.4)
        axes = figure.add_subplot()
        delay = 1.3 * float(largest_stable_delay(CYCLES_T_STAR, tau))
        given = (CYCLES_T_STAR, tau, delay, LIMIT_FT_PER_S)
        time, wanted = saturation_flight(*given, start=0.5, duration=90.0)
        axes.plot(time, wanted, color=OWNSHIP, linewidth=1.2, label="command wanted")
        cycle = saturation_limit_cycle(*given)
        for sign in (1.0, -1.0):
            axes.axhline(sign * LIMIT_FT_PER_S, color=INK, linewidth=0.8, label="limit" if sign > 0 else None)
            if cycle is not None:
                axes.axhline(
                    sign * cycle.amplitude, color=LIMIT, linestyle="--", linewidth=1.2,
                    label="amplitude predicted" if sign > 0 else None,
                )  # fmt: skip
        axes.set_xlabel("time, s (the time to the closest point held)")
        axes.set_ylabel("ft/s")
        axes.legend(loc="upper left", ncols=3)
        axes.set_ylim(-1.6 * LIMIT_FT_PER_S, 2.0 * LIMIT_FT_PER_S)
    return figure


def write_stability_report(out: Path, tau: float) -> Path:
    """Write ``report.html`` and its pictures.

    Parameters
    ----------
    out : Path
        A folder, made where it does not exist.
    tau : float
        Lag of the vertical velocity, s.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    figures = {
        "gain": gain_figure(),
        "root_locus": locus_figure(tau),
        "delay": delay_figure(tau),
        "limit_cycle": limit_cycle_figure(tau),
    }
    loci = [
        [
            LAW_WORDS[law],
            f"{critical_gain(tau, law):.4g}",
            f"{critical_gain(tau, law, as_printed=True):.4g}" if law != "shared_corrected" else "–",
            roots_in_words(eigenvalues(critical_gain(tau, law), tau, law)),
            roots_in_words(eigenvalues(4.0 * critical_gain(tau, law), tau, law)),
        ]
        for law in LAWS
    ]
    head = ["law", "K, 1/s", "K as printed, 1/s", "eigenvalues there, 1/s", "at four times that K, 1/s"]
    times = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0]
    delays = [
        [
            number(t, digits=1),
            *(number(float(largest_stable_delay(t, tau, "full", order)), digits=3) for order in ORDERS),
        ]
        for t in times
    ]
    body = section(
        "Gain along a pass (figure 5.6)",
        "Negative: stable. On the approach it is minus one over the time to the closest point, whichever way they pass"
        " (the three lines are one).",
        svg(figures["gain"], "Gain K against the distance ahead"),
    )
    body += section(
        "Where oscillation begins (tables 5.1 to 5.3)",
        f"Lag {tau:g} s. Below this K the two eigenvalues of the avoidance leave the real axis.",
        table(head, loci, text_columns=1) + svg(figures["root_locus"], "Eigenvalues as K falls"),
    )
    body += section(
        "Largest stable delay (figure 5.10)",
        "The straight line 2 t* comes of approximating the delay to first order; the loop itself tolerates less.",
        svg(figures["delay"], "Largest stable delay against the time to the closest point")
        + table(["t*, s", "Padé 1, s", "Padé 2, s", "Padé 4, s", "exact, s"], delays),
    )
    columns = ["amplitude, predicted", "rad/s, predicted"]
    flown = ["amplitude, flown", "rad/s, flown"]
    body += section(
        "Limit cycles of limited commands (5.3.2)",
        f"Commands within {LIMIT_FT_PER_S:g} ft/s, {CYCLES_T_STAR:g} s before the closest point. Beyond the largest"
        " stable delay the limits turn instability into an oscillation, in ft/s.",
        svg(figures["limit_cycle"], "A command that grows into its limit cycle")
        + table(["of the limit of stability", "delay, s", *columns, *flown], saturation_rows(tau)),
    )
    body += section(
        "Limit cycles of the switch between avoidance and return (5.3.2)",
        f"At {LIMIT_FT_PER_S:g} ft/s up and down, {CYCLES_T_STAR:g} s before the closest point; amplitudes of the miss"
        " in ft. Where the describing function sees no cycle, the miss follows the command at once and the switch"
        " chatters across its band. The switch between the sides has two stable states and no cycle.",
        table(
            ["hysteresis, ft", "delay, s", *columns, "amplitude, exact", "rad/s, exact", *flown], switching_rows(tau)
        ),
    )
    limit = float(largest_stable_delay(5.0, tau))
    page = shell(
        "Stability of the vertical avoidance loop",
        "Sanders, chapter 5, with what its print lost put back",
        "good",
        f"5 s before the closest point the loop tolerates {limit:.2f} s of delay",
        f" with a lag of {tau:g} s; the printed rule says 10 s.",
        body + notes_footer([f"wideberth {__version__}"]),
    )
    write_files(out, {**{f"{name}.png": png(figure) for name, figure in figures.items()}, "report.html": page})
    return out / "report.html"


def roots_in_words(values: NDArray[np.complex128]) -> str:
    """Return eigenvalues as text, a pair of complex ones as one."""
    values = np.round(values, 6)  # where two meet on the real axis, rounding parts them
    real = [f"{value.real:.3g}" for value in values if value.imag == 0.0]
    pairs = [f"{value.real:.3g} ± {value.imag:.3g}i" for value in values if value.imag > 0.0]
    return ", ".join([*pairs, *real]).replace("-", "−")
