"""The tables of a sensor's sizing as text, for the terminal and the report."""

import math
from dataclasses import dataclass

import numpy as np

from wideberth.analysis.escapes import ESCAPES, escape_range
from wideberth.analysis.ground_sizing import GroundProtection
from wideberth.analysis.sensor_reach import CLOSING_SPEEDS, SECTIONS, adsb_reach, radar_reach
from wideberth.analysis.sizing_answer import Intruder, SizingAnswer
from wideberth.analysis.sizing_config import AdsbSizingConfig, AircraftConfig, SensorConfig
from wideberth.evaluation.sizing_words import answer_text, bearings_text, ground_text

Rows = tuple[list[str], list[list[str]]]


@dataclass(frozen=True, slots=True)
class Sizing:
    """All that a report needs.

    Attributes
    ----------
    sensor_name : str
    sensor : RadarConfig or AdsbSizingConfig
    aircraft : AircraftConfig
    intruders : tuple of Intruder
    rcs : float
        m2.
    answer : SizingAnswer or GroundProtection
        Of a sensor on board, or of a radar on the ground.
    """

    sensor_name: str
    sensor: SensorConfig
    aircraft: AircraftConfig
    intruders: tuple[Intruder, ...]
    rcs: float
    answer: SizingAnswer | GroundProtection

    @property
    def words(self) -> str:
        """The answer in a sentence or two."""
        if isinstance(self.answer, GroundProtection):
            return ground_text(self.answer, self.intruders)
        return answer_text(self.answer)


def cross_sections(rcs: float) -> tuple[float, ...]:
    """Return the cross-sections that are shown: the usual ones and that of the intruders, m2."""
    return tuple(sorted({*SECTIONS, rcs}))


def metres(value: float) -> str:
    """Return a range in whole metres, without the unit; a word where no range is enough."""
    return "never" if math.isinf(value) else f"{value:,.0f}"


def reach_rows(sizing: Sizing) -> Rows:
    """Return the head and rows of the table of a sensor's reach."""
    tracks_head = [f"track, m\n{v:g} m/s" for v in CLOSING_SPEEDS]
    if isinstance(sizing.sensor, AdsbSizingConfig):
        return ["class", "range, m", *tracks_head], [
            [name + (" (this)" if name == sizing.sensor.power_class else ""), metres(far), *map(metres, tracks)]
            for name, (far, tracks) in adsb_reach(sizing.sensor).items()
        ]
    found = radar_reach(sizing.sensor, sections=cross_sections(sizing.rcs))
    head = ["cross-section", *(f"SNR, dB,\nat {r:.0f} m" for r in found.ranges)]
    head += [f"seen, m\n({100 * found.detection_probability:.0f} %)", *tracks_head]
    rows = []
    for k, rcs in enumerate(found.sections):
        tracks = [
            f"{track:,.0f} {-lost:+,.0f}".replace("-", "−") if track > 0 else "none"
            for track, lost in zip(found.confirmed[k], found.lost[k], strict=True)
        ]
        cells = [signed(snr, 1) for snr in found.snr[k]]
        rows.append([f"{rcs:g} m²", *cells, metres(float(found.detection[k])), *tracks])
    return head, rows


def escape_rows(sizing: Sizing) -> Rows:
    """Return the head and rows of the table of the aircraft's escapes: the range that each takes head-on."""
    aircraft, count = sizing.aircraft, len(sizing.intruders)
    pick = np.unique(np.round(np.linspace(0, count - 1, min(4, count))).astype(int))
    speeds = np.array([sizing.intruders[k].speed for k in pick])
    what = {
        "turn": f"turn {aircraft.turn_deg:g}°, bank {aircraft.bank_max_deg:g}°",
        "climb": f"climb {aircraft.climb_rate_max_mps:g}, sink {aircraft.sink_rate_max_mps:g} m/s",
        "slow_down": f"slow down to {aircraft.speed_min_mps:g} m/s",
    }
    rows = [
        [
            what[name],
            "yes" if name in aircraft.escapes else "no",
            *(metres(float(r)) for r in escape_range(name, 0.0, speeds, aircraft)),
        ]
        for name in ESCAPES
    ]
    return ["escape", "counted", *(f"m, against\n{v:g} m/s" for v in speeds)], rows


def protection_rows(sizing: Sizing) -> Rows:
    """Return the head and rows of the table of the intruders; of a radar on the ground, its volumes."""
    if isinstance(sizing.answer, GroundProtection):
        return _volume_rows(sizing, sizing.answer)
    head = ["intruder", "m/s", "protected\nfrom", "head-on:\nneeds, m", "has, m", "lacks,\nm", "at"]
    rows = []
    for one in sizing.answer.intruders:
        lacks = [metres(one.shortfall), f"{signed(math.degrees(one.worst_bearing))}°"]
        rows.append(
            [
                one.intruder.name,
                f"{one.intruder.speed:.3g}",
                bearings_text(one.protected),
                metres(one.required_head_on),
                metres(one.available_head_on),
                *(lacks if one.shortfall > 0.0 else ["–", "–"]),
            ]
        )
    return head, rows


def cure_rows(answer: SizingAnswer) -> Rows:
    """Return the head and rows of the table of what would protect from the intruders that are not protected from.

    The first range, the cross-section and the time are for the present field of view.
    """
    head = ["m/s", "in view:\ntrack at, m", "or intruder\nof, m²", "or decide\nwithin, s"]
    head += ["all round:\ntrack at, m", "and view\nof"]
    rows = []
    for one in answer.intruders:
        if one.shortfall == 0.0:
            continue
        in_view = ["–", "–", "–"] if one.shortfall_in_view == 0.0 else [
            metres(one.needed_range),
            "none" if one.needed_rcs is None else f"{one.needed_rcs:.2g}",
            "none" if one.needed_decision_time is None else f"{one.needed_decision_time:.1f}",
        ]  # fmt: skip
        view = f"{math.degrees(one.needed_field_of_view):.0f}°"
        rows.append([f"{one.intruder.speed:.3g}", *in_view, metres(one.needed_range_all_round), view])
    return head, rows


def signed(value: float, digits: int = 0) -> str:
    """Return a number with a proper minus sign."""
    return f"{value:.{digits}f}".replace("-", "−")


def _volume_rows(sizing: Sizing, found: GroundProtection) -> Rows:
    head = [
        "intruder",
        "m/s",
        "needs, m",
        "surveillance:\nradius, m",
        "height, m",
        "operation:\nradius, m",
        "height, m",
    ]
    rows = []
    for k, one in enumerate(sizing.intruders):
        seen, volume = found.surveillance[k], found.operation[k]
        rows.append(
            [
                one.name,
                f"{one.speed:.3g}",
                metres(float(found.required_range[k])),
                *(["none", "–"] if seen is None else [metres(seen.radius), metres(seen.height)]),
                *(["none", "–"] if volume is None or volume.radius == 0.0 else
                  [metres(volume.radius), metres(volume.height)]),
            ]
        )  # fmt: skip
    return head, rows
