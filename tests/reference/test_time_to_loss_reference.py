"""Times to loss of separation and to collision against figure 3 of the ADS-B paper, as printed and recomputed."""

import csv
from pathlib import Path

import pytest

from wideberth.analysis.time_to_loss import SCENARIOS, times_to_loss
from wideberth.units import FOOT, KNOT, NAUTICAL_MILE

TABLE = Path(__file__).resolve().parents[2].parent / "shared" / "reference" / "data" / "adsb_fig3.csv"
OWNSHIPS = {"Raven": (43 * KNOT, 15.0), "ScanEagle": (80 * KNOT, 31.0), "Phantom": (19 * KNOT, 9.0)}
INTRUDERS_KT = {"F-35": 1042, "B747": 533, "TTX": 240, "Skyhawk": 126, "ScanEagle": 80, "Raven": 43}
MISPRINT = ("F-35", "ScanEagle", "head-on")  # 32.2 s to collision for 31.2 s


@pytest.fixture(scope="module")
def rows() -> list[dict[str, str]]:
    if not TABLE.exists():
        pytest.skip(f"reference data absent: {TABLE.name}")
    with TABLE.open() as file:
        return list(csv.DictReader(file))


def times(row: dict[str, str], *, rounded: bool, separation: float, collision: float) -> tuple[float, float, float]:
    """Closing speed, time to loss of separation and time to collision of a row."""
    own, cruise = OWNSHIPS[row["ownship"]]
    intruder = INTRUDERS_KT[row["intruder"]] * KNOT
    if rounded:
        own, intruder = round(own), round(intruder)
    found = times_to_loss(
        own, cruise, intruder, detection_range=10 * NAUTICAL_MILE, separation=separation, collision=collision
    )
    k = SCENARIOS.index(row["scenario"])
    return found.closing_speed[k], found.to_loss_of_separation[k], found.to_collision[k]


def test_every_cell_of_the_figure(rows: list[dict[str, str]]) -> None:
    assert len(rows) == 36
    for row in rows:
        closing, loss, touch = times(row, rounded=True, separation=4000 * FOOT, collision=500.0)
        assert closing == float(row["v_close_mps_used"])
        if not row["TLOS_printed_s"]:
            assert closing < 0
            continue
        # One decimal is printed; one cell, 188.05, is rounded down there.
        assert loss == pytest.approx(float(row["TLOS_printed_s"]), abs=0.0525)
        if (row["intruder"], row["ownship"], row["scenario"]) == MISPRINT:
            assert touch == pytest.approx(float(row["TC_printed_s"]) - 1, abs=0.05)
        else:
            assert touch == pytest.approx(float(row["TC_printed_s"]), abs=0.0501)


def test_every_recomputed_value(rows: list[dict[str, str]]) -> None:
    for row in rows:
        if row["TLOS_repro_s"]:
            _, loss, touch = times(row, rounded=True, separation=4000 * FOOT, collision=500.0)
            assert loss == pytest.approx(float(row["TLOS_repro_s"]), abs=0.00501)
            assert touch == pytest.approx(float(row["TC_repro_500m_s"]), abs=0.00501)
            _, _, touch = times(row, rounded=True, separation=4000 * FOOT, collision=500 * FOOT)
            assert touch == pytest.approx(float(row["TC_500ft_s"]), abs=0.00501)


def test_exact_speeds(rows: list[dict[str, str]]) -> None:
    """These columns take loss of separation as 0.66 nmi, as the text says it, instead of 4000 ft."""
    for row in rows:
        if row["TLOS_kn_s"]:
            _, loss, touch = times(row, rounded=False, separation=0.66 * NAUTICAL_MILE, collision=500 * FOOT)
            assert loss == pytest.approx(float(row["TLOS_kn_s"]), abs=0.00501)
            assert touch == pytest.approx(float(row["TC_kn_500ft_s"]), abs=0.00501)
