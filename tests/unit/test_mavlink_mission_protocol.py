"""Mission download and upload, message by message."""

from collections import Counter

import pytest

from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import Item, item_message, waypoint
from wideberth.links.mavlink.mission_protocol import MissionDownload, MissionUpload, reason_in_words

US, THEM = (245, 196), (1, 1)
ITEMS = [waypoint(0.7, -1.9, 100.0 + k) for k in range(3)]


class Peer:
    """What was sent, and both transfers."""

    def __init__(self, retries: int = 3) -> None:
        self.sent: list = []
        self.counts: Counter[str] = Counter()
        self.retries = retries

    def download(self, **options) -> MissionDownload:
        transfer = MissionDownload(self.sent.append, THEM, 1.0, self.retries, self.counts, **options)
        transfer.start(0.0)
        return transfer

    def upload(self, items=ITEMS) -> MissionUpload:
        transfer = MissionUpload(self.sent.append, THEM, 1.0, self.retries, self.counts, items)
        transfer.start(0.0)
        return transfer

    def last(self) -> str:
        message = self.sent[-1]
        return (
            f"{message.get_type()} {getattr(message, 'seq', getattr(message, 'count', getattr(message, 'type', '')))}"
        )


def count(n: int):
    return mavlink.MAVLink_mission_count_message(*US, n, 0)


def item(seq: int, **options):
    return item_message(ITEMS[seq], seq, *US, **options)


def ack(result: int, mission_type: int = 0):
    return mavlink.MAVLink_mission_ack_message(*US, result, mission_type)


def request(seq: int, old: bool = False):
    kind = mavlink.MAVLink_mission_request_message if old else mavlink.MAVLink_mission_request_int_message
    return kind(*US, seq, 0)


def test_a_download() -> None:
    peer = Peer()
    transfer = peer.download()
    assert peer.last().startswith("MISSION_REQUEST_LIST")
    transfer.take(count(3), 0.1)
    for k in range(3):
        assert peer.last() == f"MISSION_REQUEST_INT {k}"
        transfer.take(item(k), 0.2)
    assert transfer.done and transfer.items == ITEMS
    assert peer.last() == "MISSION_ACK 0"


def test_an_empty_mission() -> None:
    transfer = Peer().download()
    transfer.take(count(0), 0.1)
    assert transfer.done and transfer.items == []


def test_items_twice_or_out_of_sequence_do_no_harm() -> None:
    peer = Peer()
    transfer = peer.download()
    transfer.take(count(3), 0.1)
    for k in (0, 0, 2, 1, 1, 0, 2):
        transfer.take(item(k), 0.2)
    assert transfer.done and transfer.items == ITEMS
    assert peer.counts["mission item out of sequence"] == 4


def test_what_is_not_answered_is_asked_again_and_given_up_in_the_end() -> None:
    peer = Peer(retries=3)
    transfer = peer.download()
    transfer.take(count(3), 0.0)
    for t in (0.5, 1.0, 1.5, 2.0, 3.0):
        transfer.step(t)
    assert [m.get_type() for m in peer.sent].count("MISSION_REQUEST_INT") == 3
    assert peer.last() == "MISSION_REQUEST 0"  # the old form, as the new one is not answered
    transfer.step(4.0)
    assert transfer.failure == "item 0 of 3 was not sent, asked 4 times"
    assert peer.last() == f"MISSION_ACK {mavlink.MAV_MISSION_OPERATION_CANCELLED}"


def test_items_of_old_autopilots_come_as_floats() -> None:
    peer = Peer(retries=6)
    transfer = peer.download()
    transfer.take(count(2), 0.0)
    for t in (1.0, 2.0, 3.0):
        transfer.step(t)
    transfer.take(item(0, as_floats=True), 3.1)
    transfer.take(item(1, as_floats=True), 3.2)
    assert transfer.done
    assert [abs(a.x - b.x) < 50 and a.z == b.z for a, b in zip(transfer.items, ITEMS, strict=False)] == [True, True]


def test_floats_are_thrown_away_where_integers_come_after_all() -> None:
    peer = Peer(retries=6)
    transfer = peer.download()
    transfer.take(count(2), 0.0)
    for t in (1.0, 2.0, 3.0):
        transfer.step(t)
    transfer.take(item(0, as_floats=True), 3.1)
    transfer.take(item(1), 3.2)
    assert peer.last() == "MISSION_REQUEST_INT 0"
    transfer.take(item(0), 3.3)
    transfer.take(item(1), 3.4)
    assert transfer.items == ITEMS[:2]


def test_too_many_items_are_refused() -> None:
    transfer = Peer().download()
    transfer.take(count(60_000), 0.1)
    assert transfer.failure is not None and "60000 items" in transfer.failure


def test_an_upload() -> None:
    peer = Peer()
    transfer = peer.upload()
    assert peer.last() == "MISSION_COUNT 3"
    for k in range(3):
        transfer.take(request(k), 0.1)
        assert peer.last() == f"MISSION_ITEM_INT {k}"
        assert not transfer.done
    transfer.take(ack(0), 0.2)
    assert transfer.done and not transfer.unsure


def test_an_upload_to_an_old_autopilot() -> None:
    peer = Peer()
    transfer = peer.upload()
    transfer.take(request(0, old=True), 0.1)
    assert peer.last() == "MISSION_ITEM 0"


def test_an_upload_repeats_count_and_items() -> None:
    peer = Peer(retries=2)
    transfer = peer.upload()
    transfer.step(1.1)
    assert [m.get_type() for m in peer.sent] == ["MISSION_COUNT", "MISSION_COUNT"]
    transfer.take(request(0), 1.2)
    transfer.step(2.3)
    assert peer.last() == "MISSION_ITEM_INT 0"
    transfer.take(request(0), 2.4)  # asked again
    assert peer.last() == "MISSION_ITEM_INT 0"
    for t in (3.5, 4.6, 5.7):
        transfer.step(t)
    assert transfer.failure == "no more asked for after item 0, waited 3 times"
    assert transfer.touched and not transfer.unsure


def test_an_acknowledgement_from_before_does_not_end_an_upload() -> None:
    peer = Peer()
    transfer = peer.upload()
    transfer.take(ack(0), 0.0)
    transfer.take(request(0), 0.1)
    transfer.take(ack(0), 0.1)
    assert not transfer.finished
    transfer.take(ack(0, mission_type=1), 0.1)  # of a geofence
    transfer.take(ack(mavlink.MAV_MISSION_INVALID_SEQUENCE), 0.1)  # ArduPilot, of an item that came twice
    assert not transfer.finished
    transfer.take(request(9), 0.2)
    assert peer.counts["mission request out of sequence"] == 1


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (mavlink.MAV_MISSION_NO_SPACE, "no space for so many items"),
        (mavlink.MAV_MISSION_UNSUPPORTED_FRAME, "a coordinate frame is not supported"),
        (mavlink.MAV_MISSION_DENIED, "this station is not allowed to"),
        (mavlink.MAV_MISSION_INVALID_PARAM7, "the altitude of an item is invalid"),
        (mavlink.MAV_MISSION_ERROR, "error, without a reason"),
    ],
)
def test_refusals_have_their_reason(result: int, words: str) -> None:
    transfer = Peer().upload()
    transfer.take(request(0), 0.1)
    transfer.take(ack(result), 0.2)
    assert transfer.failure == words
    assert reason_in_words(99) == "result 99"


def test_a_lost_last_acknowledgement_leaves_it_open() -> None:
    for answer in (None, mavlink.MAV_MISSION_ERROR):
        peer = Peer(retries=1)
        transfer = peer.upload()
        for k in range(3):
            transfer.take(request(k), 0.1)
        if answer is None:
            transfer.step(2.0)
            transfer.step(4.0)
        else:
            transfer.take(ack(answer), 0.5)  # ArduPilot, to the last item said again
        assert transfer.failure == "the last acknowledgement did not come"
        assert transfer.unsure


def test_cancelling_is_told() -> None:
    for start in (Peer.download, Peer.upload):
        peer = Peer()
        transfer = start(peer)
        transfer.cancel()
        assert peer.last() == f"MISSION_ACK {mavlink.MAV_MISSION_OPERATION_CANCELLED}"
        assert transfer.failure == "cancelled"
        transfer.take(count(3) if start is Peer.download else request(0), 1.0)
        assert len(peer.sent) == 2


def test_nothing_of_an_unknown_item_is_lost() -> None:
    odd = Item(99, 31_999, (1.5, float("nan"), -3.0, 4.0), -5, 6, -7.5, 0)
    message = item_message(odd, 4, *US)
    sender, receiver = mavlink.MAVLink(None, 1, 1), mavlink.MAVLink(None, 2, 1)
    decoded = receiver.parse_buffer(message.pack(sender))[0]
    transfer = Peer().download()
    transfer.take(count(1), 0.0)
    decoded.seq = 0
    transfer.take(decoded, 0.1)
    got = transfer.items[0]
    assert (got.frame, got.command, got.x, got.y, got.z, got.autocontinue) == (99, 31_999, -5, 6, -7.5, 0)
    assert got.params[0] == 1.5 and got.params[1] != got.params[1] and got.params[2:] == (-3.0, 4.0)
