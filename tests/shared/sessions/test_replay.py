from __future__ import annotations

import json
import struct
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.protocol.scene_users import decode_users
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Watching, decode_watch_control
from cohaptic.recording.why import why
from cohaptic.sessions import replay
from cohaptic.sessions.codec import table_of
from cohaptic.sessions.entries import (
    Happened,
    Joined,
    Left,
    Mark,
    Mesh,
    Rows,
    SessionInfo,
    Shown,
    Written,
)
from cohaptic.sessions.reader import read_entries
from cohaptic.sessions.replay import Replay
from cohaptic.sessions.schemas import CHANNELS
from cohaptic.sessions.writer import SessionFile
from tests.recorded_sessions import record
from tests.shared.sessions.made import T, info, rows, session

KINDS = [channel.entry for channel in CHANNELS]


def write(path: Path, entries: Iterable[Written], first: SessionInfo | None = None) -> Path:
    first = first or replace(info(), protocol=PROTOCOL_VERSION)
    file = SessionFile("--record", path, first)
    for entry in entries:
        file.add(entry)
    file.close()
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("replay") / "lab.mcap", session(5.0))


def frames_in(body: bytes) -> tuple[float, list[bytes]]:
    """What a page reads in a stretch."""
    (until,) = struct.unpack_from("<d", body)
    found, at = list[bytes](), 8
    while at < len(body):
        (length,) = struct.unpack_from("<I", body, at)
        found.append(body[at + 4 : at + 4 + length])
        at += 4 + length
    assert at == len(body)
    return until, found


def all_scenes(path: Path) -> list[bytes]:
    return [entry.frame for entry in read_entries(path) if isinstance(entry, Shown)]


@given(chosen=st.sets(st.sampled_from(KINDS)), start=st.floats(-1.0, 6.0))
def test_some_kinds_of_entries_are_what_is_left_of_all(
    path: Path, chosen: set[type[Written]], start: float
) -> None:
    of_all = [entry for entry in read_entries(path, T + start) if type(entry) in chosen]
    assert list(read_entries(path, T + start, only=chosen)) == of_all


@given(cuts=st.lists(st.floats(0.05, 4.9), max_size=4))
def test_stretches_together_have_each_scene_once_and_in_order(
    path: Path, cuts: list[float]
) -> None:
    ends = [0.0, *sorted(set(cuts)), 5.1]
    found = list[bytes]()
    opened = Replay.of(path)
    for start, end in pairwise(ends):
        until, frames = frames_in(opened.scenes(T + start, T + end))
        assert until == T + end
        found += frames
    assert found == all_scenes(path)


def test_a_stretch_that_is_too_large_ends_early_and_the_next_goes_on(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replay, "MAX_BYTES", 3 * len(all_scenes(path)[0]))
    opened, at, found, asked = Replay.of(path), T, list[bytes](), 0
    while at < T + 5.0:
        at, frames = frames_in(opened.scenes(at, T + 5.0))
        assert 0 < len(frames) <= 4
        found, asked = found + frames, asked + 1
    assert found == all_scenes(path)
    assert asked > 10


@pytest.mark.parametrize("end", [T, T - 1.0, T + 10.1, float("inf"), float("nan")])
def test_a_stretch_that_nobody_needs_is_refused(path: Path, end: float) -> None:
    with pytest.raises(SettingError, match=r"it must be a stretch of more than 0 s and at most 10"):
        Replay.of(path).scenes(T, end)


def test_why_is_that_of_the_rows_of_this_user_and_time(path: Path) -> None:
    opened = Replay.of(path)
    for user, t in ((1, T + 1.0123), (2, T + 2.51), (1, T + 0.0)):
        block = next(
            entry
            for entry in read_entries(path)
            if isinstance(entry, Rows) and entry.user == user and 0.0 <= t - entry.t < 0.05
        )
        table = table_of(block)
        columns = dict(zip(block.columns, table.T, strict=True))
        found = opened.why(user, t)
        assert found is not None
        expected = why(columns, t - block.t)
        assert (found.force, found.entries) == (expected.force, expected.entries)
        assert t - 0.0011 < found.t <= t + 1e-9


def test_where_there_are_no_rows_nobody_knows_why(path: Path) -> None:
    opened = Replay.of(path)
    assert opened.why(3, T + 1.0) is None
    assert opened.why(1, T - 5.0) is None
    assert opened.why(1, T + 60.0) is None


def test_a_page_is_told_whose_session_it_is_and_what_happened(path: Path) -> None:
    opened = Replay.of(path)
    told = json.loads(json.dumps(opened.overview("0" * 32, "")))
    watching = decode_watch_control(told["watching"])
    assert isinstance(watching, Watching)
    assert watching.model == "0" * 32
    assert not watching.can_touch
    assert told["name"] == "lab.mcap"
    assert told["users"] == [{"user": 1, "name": "u1"}, {"user": 2, "name": "u2"}]
    times = [moment["t"] for moment in told["moments"]]
    assert times == sorted(times)
    assert [moment["kind"] for moment in told["moments"]] == [
        "joined", "joined", "mark", "mark", "event", "left",
    ]  # fmt: skip
    assert told["moments"][-1]["text"] == "u2 left: left"
    first = decode_users(all_scenes(path)[0])
    assert told["first"] == first.t_server
    assert told["complete"]


def test_only_so_many_moments_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay, "MAX_MOMENTS", 3)
    opened = Replay.of(write(tmp_path / "x.mcap", session(1.0)))
    assert (len(opened.moments), opened.further) == (3, 3)


def test_words_of_strangers_become_one_short_line(tmp_path: Path) -> None:
    long = "a\nb\x1b[31m" + "x" * 10_000
    strange: list[Written] = [Mark(T, long, {}), Happened(T, "k", None, long), Left(T, 1, long)]
    entries = [*session(0.5), Joined(T, 9, long, {}, 1.0), *strange]
    opened = Replay.of(write(tmp_path / "x.mcap", entries))
    texts = [*(moment.text for moment in opened.moments), *opened.users.values()]
    assert max(map(len, texts)) < 300
    assert all(text.isprintable() for text in texts)


def test_a_file_of_a_killed_process_is_replayed_as_far_as_it_goes(
    path: Path, tmp_path: Path
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[: int(0.7 * path.stat().st_size)])
    opened = Replay.of(cut)
    assert not opened.complete
    _, frames = frames_in(opened.scenes(opened.first, opened.first + 1.0))
    assert frames == all_scenes(path)[: len(frames)]
    assert len(frames) == 20


@pytest.mark.parametrize(
    ("first", "left_out", "words"),
    [
        ({"protocol": 1}, (), "a session of version 5 of the protocol, not 1"),
        ({"body": {"name": "balloon"}}, (), "one whose object is described"),
        ({"simulation_period": 99.0}, (), "one whose object is described"),
        ({}, (Mesh,), "one with the resting mesh of its object"),
        ({}, (Shown,), "one with scenes"),
    ],
)
def test_a_session_that_cannot_be_shown_says_why(
    tmp_path: Path, first: dict[str, Any], left_out: tuple[type, ...], words: str
) -> None:
    wanted: dict[str, Any] = {"protocol": PROTOCOL_VERSION, **first}
    entries = [entry for entry in session(1.0) if not isinstance(entry, left_out)]
    made = write(tmp_path / "x.mcap", entries, replace(info(), **wanted))
    with pytest.raises(SettingError, match=words.replace("5", str(PROTOCOL_VERSION))):
        Replay.of(made)


def test_a_damaged_mesh_is_refused_before_a_page_gets_it(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="one whose mesh is right"):
        Replay.of(write(tmp_path / "x.mcap", [Mesh(T, b"no mesh"), *session(0.5)]))


def test_a_scene_that_is_none_is_refused_before_a_page_gets_it(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="one whose scenes are right"):
        Replay.of(write(tmp_path / "x.mcap", [Shown(T - 1.0, 1, b"none"), *session(0.5)]))


@pytest.mark.parametrize("surfaces", [False, True])
def test_whether_scenes_bring_their_surface_is_known(tmp_path: Path, surfaces: bool) -> None:
    opened = Replay.of(record(tmp_path / "x.mcap", 0.2, surfaces=surfaces))
    assert opened.surfaces is surfaces


def test_rows_of_another_version_have_no_ledger(tmp_path: Path) -> None:
    old = rows(T, 50, 1, columns=("t", "x", "y", "z"))
    opened = Replay.of(write(tmp_path / "x.mcap", [*session(0.2), old]))
    with pytest.raises(SettingError, match="a recording with a ledger"):
        opened.why(1, T + 0.02)
    assert np.isfinite(opened.first)
