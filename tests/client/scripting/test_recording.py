"""A session that a script keeps, of a server somewhere."""

from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic import record
from cohaptic.errors import CloseCode, CohapticError, ServerLost, SettingError
from cohaptic.sessions.entries import Rows
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic_client import joined
from cohaptic_client.network.conversation import Refused
from cohaptic_server import serve
from cohaptic_server.access.admission import Admission
from cohaptic_server.access.keys import Grants
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.shell.limiter import Protection
from cohaptic_server.shell.verification import Verdict, verify
from tests.client.test_admin import invitation, now
from tests.server.access.some import ALL, RING, token

pytestmark = pytest.mark.live


def secret_of(grants: Grants) -> str:
    return token(grants, jti="recorder", iat=now(), exp=now() + 600.0)


def test_a_script_keeps_what_happens_in_its_block(tmp_path: Path) -> None:
    with serve("balloon", port=0) as room:
        with record(tmp_path / "s01", room) as kept:
            with joined(room.url, name="ann") as hand:
                samples = hand.samples()
                next(row for row in samples if hand.recorded)
                kept.mark("stimulus on", trial=3)
                for _ in range(500):
                    next(samples)
            assert kept.recording
        with joined(room.url, name="bob") as hand:
            assert not hand.recorded
    (path,) = (tmp_path / "s01").iterdir()
    assert path == kept.path
    outline = Outline.of(path)
    assert outline.complete
    assert outline.users == {1: "ann"}
    assert [(mark.text, mark.fields, mark.by) for mark in outline.marks] == [
        ("stimulus on", {"trial": 3}, None)
    ]
    assert sum(len(e.block) for e in read_entries(path) if isinstance(e, Rows)) > 300 * 51 * 8
    verdict = Verdict()
    for _, so_far in verify(read_entries(path), build_body("balloon")):
        verdict = so_far
    assert verdict.holds


def test_one_session_is_recorded_once_at_a_time(tmp_path: Path) -> None:
    with serve("balloon", port=0) as room, record(tmp_path / "a.mcap", room.url):
        with pytest.raises(CohapticError, match="nothing else records"):
            with record(tmp_path / "b.mcap", room.url):
                pytest.fail("it is recorded twice")
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


def test_a_file_that_is_there_stays_as_it_is_and_nobody_is_recorded(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"a recording")
    with serve("balloon", port=0) as room:
        with pytest.raises(SettingError, match="path is"):
            with record(tmp_path / "a.mcap", room):
                pytest.fail("it is overwritten")
        with record(tmp_path / "b.mcap", room):  # the server knows that the first is over
            pass
    assert (tmp_path / "a.mcap").read_bytes() == b"a recording"


def test_a_server_that_ends_leaves_a_file_that_opens(tmp_path: Path) -> None:
    served = serve("balloon", port=0)
    with served as room:
        recording = record(tmp_path / "a.mcap", room)
        kept = recording.__enter__()
        kept.mark("before the end")
    with pytest.raises(ServerLost):
        recording.__exit__(None, None, None)
    assert Outline.of(tmp_path / "a.mcap").complete


def test_an_error_of_the_block_is_the_one_that_is_seen(tmp_path: Path) -> None:
    with serve("balloon", port=0) as room, pytest.raises(ZeroDivisionError):
        with record(tmp_path / "a.mcap", room):
            _ = 1 / 0
    assert Outline.of(tmp_path / "a.mcap").complete


def test_where_there_are_tokens_only_one_that_says_so_may_record(tmp_path: Path) -> None:
    protection = Protection(admission=Admission(RING, admits_anybody=True))
    grants = ALL.model_copy(update={"room_record": True})
    with serve("balloon", port=0, protection=protection) as room:
        for secret in ("", invitation("ann")):
            with pytest.raises(Refused, match="roomRecord") as refused:
                with record(tmp_path / "a.mcap", room, token=secret):
                    pytest.fail("it is recorded")
            assert refused.value.code == CloseCode.FORBIDDEN.value
        assert not list(tmp_path.iterdir())
        with record(tmp_path / "a.mcap", room, token=secret_of(grants)):
            pass
    assert (tmp_path / "a.mcap").exists()
