import pytest

from wideberth.errors import InputError
from wideberth.live.autopilot import AutopilotLink
from wideberth.live.hand_over_note import HandOverNote
from wideberth.live.packet_queue import PacketQueue


def test_a_note_is_there_for_the_next_program_until_control_is_given_back(tmp_path):
    first = HandOverNote("udp:127.0.0.1:14550", tmp_path)
    assert first.left() is None
    assert first.keep("{}") == ""
    second = HandOverNote("udp:127.0.0.1:14550", tmp_path)
    assert HandOverNote("udp:127.0.0.1:14551", tmp_path).left() is None
    assert second.left() == "{}"
    # Given back before anything changed: the note goes all the same.
    assert second.keep(None) == ""
    assert not list(tmp_path.iterdir())
    assert HandOverNote("udp:127.0.0.1:14550", tmp_path).left() is None


def test_what_cannot_be_kept_or_read_is_said_once(tmp_path):
    (tmp_path / "file").write_text("")
    note = HandOverNote("x", tmp_path / "file")
    assert "not kept" in note.keep("a")
    assert note.keep("b") == ""
    other = HandOverNote("x", tmp_path)
    other.path.mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        other.left()


class Taking:
    """An autopilot that is to be taken over: known when it is asked what to send."""

    def __init__(self):
        self.hand_over = None

    def outgoing(self, t):
        self.hand_over = "taken"
        return b"mode"


def test_the_note_is_on_disk_before_the_first_command_is_on_the_wire(tmp_path):
    note, autopilot, sent = HandOverNote("x", tmp_path), Taking(), []

    def send(data):
        sent.append((data, note.path.read_text()))
        return True

    link = AutopilotLink(autopilot, PacketQueue(), send, lambda: 0.0, lambda: note.keep(autopilot.hand_over))
    assert link.pump() and sent == [(b"mode", "taken")]
