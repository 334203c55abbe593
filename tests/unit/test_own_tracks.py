"""Which tracks stay the ownship's, and that nobody avoids himself."""

import dataclasses

import numpy as np

from tests.unit.test_pipeline import MISSION, FakeDetector, FakePlanner, FakeTracker, ownship, pipeline, scan, track
from wideberth.tracking.lost_traffic import LostTraffic
from wideberth.tracking.own_tracks import HOLD_RADIUS, MOTION_UNKNOWN, NEWBORN, NEWS, SECOND_ECHO, OwnTracks
from wideberth.types import AlertLevel

ORIGIN = np.zeros(3)


def at(t, distance, own=False, name="7"):
    return dataclasses.replace(track(t, name), position=np.array([distance, 0.0, 0.0]), is_ownship=own)


def marks(own_tracks, *tracks):
    return [one.is_ownship for one in own_tracks.step(tracks, ORIGIN)]


def test_a_track_that_telemetry_no_longer_explains_stays_ours_while_it_is_near():
    own = OwnTracks()
    assert marks(own, at(0.0, 3.0)) == [False]
    assert marks(own, at(0.1, 3.0, True)) == [True]
    assert marks(own, at(0.2, HOLD_RADIUS - 1.0)) == [True]
    assert marks(own, at(0.3, HOLD_RADIUS + 1.0)) == [False]
    assert marks(own, at(0.4, 3.0)) == [False]


def test_a_track_without_news_stays_ours_wherever_it_flies_on():
    own = OwnTracks()
    marks(own, at(5.0, 2.0, True))
    gone = dataclasses.replace(at(9.0, 400.0), t_last_update=5.0)
    assert marks(own, gone) == [True] and marks(own, gone) == [True]
    assert marks(own, at(9.5, 400.0)) == [False]
    assert marks(own, gone) == [False]


def test_another_track_found_to_be_ours_frees_the_old_one():
    own = OwnTracks()
    marks(own, at(0.0, 2.0, True))
    assert marks(own, at(0.1, 2.0), at(0.1, 1.0, True, "8")) == [False, True]
    assert marks(own, at(0.2, 2.0), at(0.2, 1.0, False, "8")) == [False, True]


def test_one_plot_makes_no_intruder_of_a_track_that_flew_on_beside_ours():
    own = OwnTracks()
    marks(own, at(5.0, 2.0, True))

    def old(updated):
        return dataclasses.replace(at(9.9, 40.0), t_last_update=updated)

    for updated in (5.0, 9.0, 9.0, 9.0, 9.1):
        assert marks(own, old(updated), at(9.9, 1.0, True, "8")) == [True, True]
    # Explained by telemetry again, it begins anew.
    marks(own, dataclasses.replace(old(9.1), is_ownship=True), at(9.9, 1.0, True, "8"))
    for i in range(NEWS - 1):
        assert marks(own, old(19.2 + 0.1 * i), at(19.9, 1.0, True, "8")) == [True, True]
    assert marks(own, old(19.8), at(19.9, 1.0, True, "8")) == [False, True]


def test_one_plot_makes_no_intruder_of_a_track_while_all_of_ours_fly_on_without_news():
    own = OwnTracks()
    marks(own, at(5.0, 2.0, True))

    def old(distance, updated):
        return dataclasses.replace(at(17.0, distance), t_last_update=updated)

    flies_on = dataclasses.replace(at(17.0, 9.0, False, "8"), t_last_update=15.0)
    assert marks(own, old(40.0, 5.0), dataclasses.replace(flies_on, is_ownship=True)) == [True, True]
    # The ownship's plots may be this one's now: it leads back to the ownship, or away as an intruder.
    assert marks(own, old(40.0, 17.0), flies_on) == [True, True]
    assert marks(own, old(5.0, 18.5), flies_on) == [True, True]
    for i in range(NEWS - 1):
        assert marks(own, old(40.0, 30.0 + 0.1 * i), flies_on) == [True, True]
    assert marks(own, old(40.0, 30.2), flies_on) == [False, True]


def test_a_number_that_is_gone_is_forgotten():
    own = OwnTracks()
    marks(own, at(0.0, 2.0, True))
    marks(own)
    assert marks(own, at(0.0, 2.0)) == [False]


def test_the_ownships_track_is_shown_but_neither_assessed_nor_avoided():
    detector, planner = FakeDetector(AlertLevel.WARNING), FakePlanner()
    made = pipeline(FakeTracker([track(0.0, "1", is_ownship=True), track(0.0, "2")], []), detector, planner)
    snapshot = made.step(0.0, ownship(0), [scan(0.0)], MISSION)
    assert [one.id for one in snapshot.tracks] == ["1", "2"]
    assert detector.seen == [("2",)] and [one.id for one in planner.given[0]] == ["2"]
    assert [threat.track_id for threat in snapshot.threats] == ["2"]
    # Lost, it leaves no ghost; the other does.
    assert [one.id for one in made.step(1.0, ownship(1), [scan(1.0)], MISSION).tracks] == ["2"]


def test_lost_traffic_does_not_remember_the_ownship():
    lost = LostTraffic(60.0)
    lost.step(0.0, [track(0.0, "1", is_ownship=True)])
    assert lost.step(1.0, []) == ()


def test_the_tracker_is_told_of_the_ownship():
    class Listens(FakeTracker):
        def step(self, t, scans, ownship=None):
            self.told = ownship
            return (), ()

    tracker = Listens()
    pipeline(tracker).step(3.0, ownship(3), [scan(3.0)], MISSION)
    assert tracker.told is not None and tracker.told.t == 3


GROUND = np.array([0.0, 0.0, 200.0])


def newborn(own_tracks, *tracks, radar=GROUND, sure=True):
    return [one.is_ownship for one in own_tracks.step(tracks, ORIGIN, sure, [radar])]


def test_a_radar_close_by_that_stays_while_the_ownship_moves_is_not_on_board():
    for follows in (False, True):
        own = OwnTracks()
        for k in range(4):
            place = np.array([0.0, 1.0 * k, 0.0])
            radar = place if follows else np.array([5.0, 0.0, 0.0])
            assert own.step([], place, True, [radar]) == ()
        # Begun close to the ownship: its own echo, but for a radar on board, which sees others only.
        (marked,) = own.step([at(0.4, 4.0)], place, True, [radar])
        assert marked.is_ownship is not follows


def test_a_track_that_begins_at_the_ownship_is_ours_for_a_while():
    own = OwnTracks()
    assert newborn(own, at(0.0, HOLD_RADIUS - 1.0), at(0.0, HOLD_RADIUS + 1.0, name="8")) == [True, False]
    assert newborn(own, at(NEWBORN - 0.1, 20.0), at(0.1, 20.0, name="8")) == [True, False]
    # Away from us, or too long without being found ours, it is somebody else.
    assert newborn(own, at(NEWBORN - 0.05, HOLD_RADIUS + 1.0)) == [False]
    assert newborn(own, at(NEWBORN, 20.0)) == [False]


def test_a_newborn_track_is_not_ours_beside_one_that_is_and_has_news():
    own = OwnTracks()
    assert newborn(own, at(0.0, 2.0, True)) == [True]
    assert newborn(own, at(0.1, 2.0, True), at(0.1, 10.0, name="8")) == [True, False]
    # The own track has lagged: it stays ours by nearness, and has news.
    assert newborn(own, at(0.2, 20.0), at(0.2, 10.0, name="8")) == [True, False]
    # Without news of it, what begins here is ours too.
    stale = dataclasses.replace(at(0.3, 90.0), t_last_update=0.2)
    assert newborn(own, stale, at(0.3, 10.0, name="9")) == [True, True]


def test_a_newborn_track_without_news_stays_ours_when_another_one_is_found():
    own = OwnTracks()
    first = at(0.0, 3.0)
    assert newborn(own, first) == [True]
    stale = dataclasses.replace(at(0.1, 4.0), t_last_update=first.t_last_update)
    assert newborn(own, stale, at(0.1, 2.0, True, "8")) == [True, True]
    assert newborn(own, at(0.2, 4.0), at(0.2, 2.0, True, "8")) == [False, True]


def test_a_newborn_track_takes_the_place_of_ours_that_flies_on_without_news():
    own = OwnTracks()
    assert newborn(own, at(0.0, 2.0, True)) == [True]

    def silent(t, found=True):
        return dataclasses.replace(at(t, 15.0, found), t_last_update=0.0)

    # Telemetry still explains the one that flies on, ever more uncertain: it has no plots, as the new one has them.
    assert newborn(own, silent(0.5), at(0.5, 5.0, name="8")) == [True, True]
    assert newborn(own, silent(2.0), at(2.0, 5.0, name="8")) == [True, True]
    for t in (NEWBORN + 1.0, NEWBORN + 30.0):
        assert newborn(own, silent(t), at(t, HOLD_RADIUS - 1.0, name="8")) == [True, True]
    # It is held by no more than any that was ours.
    assert newborn(own, silent(40.0), at(40.0, HOLD_RADIUS + 1.0, name="8")) == [True, False]


def test_a_track_that_begins_beside_ours_with_news_is_not_ours_for_having_lived():
    own = OwnTracks()
    for t in (0.0, 1.0, NEWBORN, 3 * NEWBORN):
        assert newborn(own, at(t, 2.0, True), at(t, 10.0, name="8")) == [True, False]


def test_a_second_echo_of_ours_is_ours_before_anything_is_known_of_its_motion():
    vague = np.diag([400.0] * 3 + [(MOTION_UNKNOWN + 1.0) ** 2] * 3 + [1.0] * 3)

    def second(t, distance=10.0, covariance=vague, name="8"):
        return dataclasses.replace(at(t, distance, name=name), covariance=covariance)

    own = OwnTracks()
    assert newborn(own, at(0.0, 2.0, True), second(0.0), second(0.0, HOLD_RADIUS + 1.0, name="9")) == [
        True,
        True,
        False,
    ]
    # Known, or alive for longer, it is somebody else.
    assert newborn(own, at(0.1, 2.0, True), second(0.1, covariance=np.eye(9))) == [True, False]
    assert newborn(own, at(0.2, 2.0, True), second(0.2)) == [True, True]
    assert newborn(own, at(SECOND_ECHO, 2.0, True), second(SECOND_ECHO)) == [True, False]


def test_what_only_receivers_tell_of_is_not_ours_for_being_newborn():
    for sources, ours in ((("adsb",), False), (("radar", "adsb"), True), (("radar",), True), ((), True)):
        one = dataclasses.replace(at(0.0, 10.0), sources=sources)
        assert OwnTracks().step((one,), ORIGIN, True, [GROUND], {"adsb"})[0].is_ownship is ours


def test_a_radar_on_board_sees_nobody_who_is_us():
    own = OwnTracks()
    assert newborn(own, at(0.0, 10.0), radar=ORIGIN) == [False]
    assert marks(own, at(0.1, 10.0)) == [False]


def test_a_newborn_track_is_not_ours_while_our_place_is_not_known():
    assert newborn(OwnTracks(), at(0.0, 10.0), sure=False) == [False]
