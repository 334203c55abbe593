"""Reports: complete, self-contained, and honest about what they show."""

import dataclasses
import itertools
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from tests.made_runs import FRAME, MISSION, made_steps
from wideberth.conflict.well_clear import WellClearVolume
from wideberth.errors import InputError
from wideberth.evaluation.flight_log import FlightLog, encounters
from wideberth.evaluation.metrics import RunMetrics
from wideberth.evaluation.report import write_report
from wideberth.evaluation.report_page import verdict
from wideberth.evaluation.report_style import clock
from wideberth.recording import Recorder, read_recording
from wideberth.types import AlertLevel
from wideberth.units import FOOT

PICTURES = ("map.png", "altitude.png", "separation.png", "timeline.png")
_VOID = {"meta", "br", "circle", "path", "img", "link", "hr"}


class Checker(HTMLParser):
    """Balanced tags and every address that a browser would fetch."""

    def __init__(self):
        super().__init__()
        self.open, self.fetched, self.words = [], [], []

    def handle_starttag(self, tag, attributes):
        if tag not in _VOID:
            self.open.append(tag)
        self.fetched += [v for k, v in attributes if k in ("src", "href", "xlink:href", "srcset", "data")]
        assert tag not in ("script", "link", "iframe", "img", "object")

    def handle_startendtag(self, tag, attributes):
        self.fetched += [v for k, v in attributes if k in ("src", "href", "xlink:href")]

    def handle_endtag(self, tag):
        if tag not in _VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def record(path, count, aircraft, change=lambda snapshot: snapshot, with_truth=True, mission=MISSION):
    metrics = RunMetrics(WellClearVolume(500 * FOOT, 100 * FOOT), "astm_f3442")
    with Recorder(path, {"name": "a <b> & c"}, mission=mission, frame=FRAME) as recorder:
        for made, scans, truth in made_steps(count, aircraft):
            snapshot, known = change(made), truth if with_truth else None
            recorder.write(snapshot, scans, known)
            metrics.update(snapshot.t, snapshot.ownship.position, snapshot.ownship.velocity, known)
            metrics.observe(snapshot)
    return metrics.summary(seed=3, mission=mission, mission_completed=True)


def report(tmp_path, *args, **options):
    summary = record(tmp_path / "r.mcap", *args, **options)
    page = write_report(tmp_path / "out", read_recording(tmp_path / "r.mcap"), summary)
    text = page.read_text(encoding="utf-8")
    checker = Checker()
    checker.feed(text)
    assert checker.open == []
    return text, checker, tmp_path / "out", summary


def test_a_whole_report(tmp_path):
    text, checker, out, _ = report(tmp_path, 900, 8)
    for name in PICTURES:
        with Image.open(out / name) as picture:
            assert picture.width > 1000
            # Something is drawn: the picture is not one colour.
            assert np.asarray(picture.convert("L")).std() > 5
    words = " ".join(checker.words)
    assert "a <b> & c" in words and "<b> & c" not in text.replace("&lt;b&gt;", "")
    assert "intruder 3A0000 25 s ahead, miss 120 m, turn right 34 deg" in words
    assert "Well clear of all traffic" in words
    assert "ASTM F3442" in words and "frozen position: 17" in words
    assert text.count("<svg role=") == 4
    assert "3A0000" in words and "TEST01" in words


def test_the_page_asks_nothing_of_the_network(tmp_path):
    text, checker, out, _ = report(tmp_path, 60, 2)
    assert all(address.startswith("#") for address in checker.fetched)
    assert not re.search(r"url\(\s*['\"]?(?!#)", text) and "@import" not in text
    # Addresses may only name XML vocabularies.
    assert set(re.findall(r"https?://[^\"'\s<]+", text)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }
    assert (out / "report.html").stat().st_size < 1_500_000


def test_colours_follow_light_and_dark(tmp_path):
    text, *_ = report(tmp_path, 60, 2)
    assert "prefers-color-scheme:dark" in text
    svg = text[text.index("<svg role=") :]
    used = set(re.findall(r"var\((--c\d+)\)", svg))
    defined = set(re.findall(r"(--c\d+):#", text))
    assert used and used <= defined
    # No colour of the light theme was left fixed in a picture.
    assert "#1b2430" not in svg and "#0b5cad" not in svg


@pytest.mark.parametrize(
    ("count", "aircraft", "options"),
    [
        (1, 1, {}),
        (2, 0, {}),
        (40, 3, {"with_truth": False}),
        (40, 3, {"mission": None}),
        (40, 40, {}),
    ],
    ids=["one step", "empty sky", "no truth", "no mission", "many aircraft"],
)
def test_odd_runs_still_give_a_report(tmp_path, count, aircraft, options):
    text, checker, out, summary = report(tmp_path, count, aircraft, **options)
    assert all((out / name).stat().st_size > 3000 for name in PICTURES)
    if options.get("with_truth") is False:
        assert summary["nmac_count"] is None and "Separation not scored" in " ".join(checker.words)
    if aircraft == 0:
        assert "Nothing had to be decided" in text


def test_tracks_with_a_broken_covariance_are_drawn_without_ellipse(tmp_path):
    def spoil(snapshot):
        bad = np.full((9, 9), np.nan)
        return dataclasses.replace(
            snapshot, tracks=tuple(dataclasses.replace(track, covariance=bad) for track in snapshot.tracks)
        )

    text, *_ = report(tmp_path, 60, 2, change=spoil)
    assert "nan" not in text[text.index("<svg role=") :].lower().replace("covariance", "")


def test_a_torn_recording_is_reported_and_said_so(tmp_path):
    summary = record(tmp_path / "r.mcap", 60, 3)
    data = (tmp_path / "r.mcap").read_bytes()
    (tmp_path / "r.mcap").write_bytes(data[: len(data) * 2 // 3])
    text = write_report(tmp_path / "out", read_recording(tmp_path / "r.mcap"), summary).read_text(encoding="utf-8")
    assert "The recording is not whole" in text


def test_a_recording_without_steps_and_a_folder_in_the_way_are_refused(tmp_path):
    with Recorder(tmp_path / "r.mcap", {}, mission=None, frame=FRAME):
        pass
    with pytest.raises(InputError, match="no steps"):
        write_report(tmp_path / "out", read_recording(tmp_path / "r.mcap"), {})
    summary = record(tmp_path / "s.mcap", 20, 1)
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot write the report"):
        write_report(tmp_path / "file" / "out", read_recording(tmp_path / "s.mcap"), summary)


@pytest.mark.parametrize(
    ("nmac", "losses", "done", "state", "words"),
    [
        (0, 0, True, "good", "Well clear of all traffic"),
        (0, 0, False, "warn", "not completed"),
        (0, 2, True, "warn", "Well clear lost 2 times"),
        (1, 1, True, "bad", "1 near mid-air collision"),
        (3, 3, False, "bad", "3 near mid-air collisions"),
        (None, None, True, "warn", "not scored"),
    ],
)
def test_the_verdict(nmac, losses, done, state, words):
    got, headline, sentence = verdict(
        {
            "nmac_count": nmac,
            "loss_of_well_clear_count": losses,
            "mission_completed": done,
            "intruders": 4,
            "well_clear_volume": "sarp",
        }
    )
    assert got == state and words in headline
    assert ("was completed" in sentence) == done


def test_the_log_finds_what_came_near_and_when_maneuvers_were_flown():
    log = FlightLog()
    for snapshot, _, truth in made_steps(900, 6):
        log.add(snapshot, truth)
    near = encounters(log)
    assert near[0].id == "3a0000" and [e.ratio for e in near] == sorted(e.ratio for e in near)
    assert all(np.any((e.horizontal <= 5000) & (np.abs(e.above) <= 500)) for e in near)
    (span,) = log.maneuvers
    assert span.t_start - log.own.t[0] == pytest.approx(40.0)
    assert span.t_end - log.own.t[0] == pytest.approx(75.0)
    levels = log.levels["3a0000"]
    assert all(a[1] != b[1] for a, b in itertools.pairwise(levels))
    assert max(level for _, level in levels) == AlertLevel.WARNING


@pytest.mark.parametrize(
    ("seconds", "text"), [(0, "0:00"), (59.6, "1:00"), (-3, "-0:03"), (3725, "1:02:05"), (-0.2, "0:00")]
)
def test_clock(seconds, text):
    assert clock(seconds) == text
