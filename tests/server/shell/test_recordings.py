"""A server that records: what is in the file, who is told of it, and what becomes of a bad disk."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from cohaptic.errors import CohapticError, SettingError
from cohaptic.protocol.messages import Mark, Recorded, encode_control
from cohaptic.sessions.entries import Happened, Heard, Joined, Left, Patched, Rows, RowsLost
from cohaptic.sessions.entries import Mark as Marked
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic.status.row import COLUMNS, ROW
from cohaptic.status.row_batch import Clock, RowBatch
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.shell.verification import Verdict, verify
from tests.server.shell.stage import Client, Served, serving, visit
from tests.small_disk import fill, forbid_writing, small_disk

pytestmark = pytest.mark.live

AT_SURFACE = (0.09, 0.0, 0.0)


async def until(client: Client, *, on: bool) -> None:
    """Take patches until the client is told that the session is recorded, or no longer."""
    while not (client.news and client.news[-1] == Recorded(on=on)):
        await client.play(1)


async def pressing(served: Served, name: str, patches: int) -> Client:
    async with visit(served.url) as client:
        client.probe, client.force = AT_SURFACE, (1.0, 0.0, 0.0)
        await client.join(name)
        await client.play(patches)
    return client


def test_a_session_from_its_first_to_its_last_tick(small_balloon: Balloon, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"

    async def happens() -> None:
        async with serving(small_balloon, record=str(path)) as served:
            await asyncio.gather(pressing(served, "ann", 60), pressing(served, "bob", 40))

    asyncio.run(happens())
    outline = Outline.of(path)
    assert outline.complete
    assert sorted(outline.users.values()) == ["ann", "bob"]
    assert outline.counts["Patched"] >= 100
    assert outline.counts["Joined"] == outline.counts["Left"] == 2
    verdict = Verdict()
    for _, verdict in verify(read_entries(path), small_balloon):  # noqa: B007
        pass
    assert verdict.holds
    assert verdict.identical == verdict.patches == outline.counts["Patched"]


def test_everybody_is_told_when_a_recording_begins_and_ends(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    async def happens() -> list[bool]:
        async with serving(small_balloon) as served, visit(served.url) as early:
            await early.join("early")
            await early.play(2)
            recordings = served.server.recordings
            await recordings.begin(str(tmp_path))
            await until(early, on=True)
            with pytest.raises(SettingError, match="nothing else records"):
                await recordings.begin(str(tmp_path))
            async with visit(served.url) as late:
                await late.join("late")
                await late.play(1)
                assert Recorded(on=True) in late.news
            await recordings.end()
            await until(early, on=False)
            async with visit(served.url) as later:
                await later.join("later")
                await later.play(2)
                return [isinstance(news, Recorded) for news in later.news]

    assert not any(asyncio.run(happens()))
    (path,) = tmp_path.iterdir()
    assert path.name.startswith("main-20")
    people = [entry.name for entry in read_entries(path) if isinstance(entry, Joined)]
    assert people == ["early", "late"]  # also who was there before
    assert not Outline.of(path).info.settings["from_rest"]


def test_rows_and_marks_of_a_client_are_kept_and_what_is_missing_is_said(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    path, rest = tmp_path / "x.mcap", [0.0] * (len(COLUMNS) - 1)
    block = b"".join(ROW.pack(k * 1e-3, *rest) for k in range(20))

    async def happens() -> float:
        async with serving(small_balloon, record=str(path)) as served, visit(served.url) as client:
            await client.join("ann")
            await client.play(1)
            now = served.server.clock.now()
            far = block[: -ROW.size] + ROW.pack(9e8, *rest)  # one row of another decade
            for lost, offset, rows in (
                (0, now, block), (7, now, block), (0, now + 3600.0, block), (0, now, far),
                (3, now - 30.0, block),
            ):  # fmt: skip
                batch = RowBatch(lost, Clock(offset, 0.001, 0.004, 0.0005), rows)
                await client.ws.send(batch.encode())
            mark = Mark(text="stimulus on", fields={"trial": 3}, ago=0.5)
            await client.ws.send(encode_control(mark))
            await client.play(3)
            return now

    now = asyncio.run(happens())
    entries = list(read_entries(path))
    rows = [entry for entry in entries if isinstance(entry, Rows)]
    assert [(entry.user, entry.to_server, len(entry.block)) for entry in rows] == [
        (1, now, len(block)), (1, now, len(block)),
    ]  # fmt: skip
    assert [e.count for e in entries if isinstance(e, RowsLost)] == [
        7,
        20,
        20,
    ]  # of another hour, or decade
    (mark,) = [entry for entry in entries if isinstance(entry, Marked)]
    assert (mark.text, mark.fields, mark.by) == ("stimulus on", {"trial": 3}, 1)
    assert now - 0.5 <= mark.t < now + 60.0


def test_more_rows_than_a_loop_makes_are_not_kept_and_take_no_place_of_a_sample(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    path, rest = tmp_path / "x.mcap", [0.0] * (len(COLUMNS) - 1)
    block = b"".join(ROW.pack(k * 1e-3, *rest) for k in range(64))

    async def happens() -> int:
        async with serving(small_balloon, record=str(path)) as served, visit(served.url) as client:
            await client.join("ann")
            await client.play(1)
            now = served.server.clock.now()
            flood = RowBatch(0, Clock(now, 0.001, 0.004, 0.0005), block).encode()
            for k in range(1000):
                await client.ws.send(flood)
                if k % 100 == 0:
                    await client.touch()
            await client.play(3)
            return client.seq - 1  # the last one may come after the end

    samples = asyncio.run(happens())
    entries = list(read_entries(path))
    assert sum(isinstance(entry, Heard) for entry in entries) >= samples
    kept = sum(len(entry.block) // ROW.size for entry in entries if isinstance(entry, Rows))
    lost = sum(entry.count for entry in entries if isinstance(entry, RowsLost))
    assert kept + lost == 64_000
    assert lost > 0


def test_rows_that_break_the_protocol_end_the_session_of_their_sender_alone(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    async def happens() -> tuple[int, str, int]:
        async with (
            serving(small_balloon, record=str(tmp_path)) as served,
            visit(served.url) as good,
            visit(served.url) as bad,
        ):
            await good.join("good")
            await bad.join("bad")
            await bad.ws.send(bytes((6, 6, 0, 0)) + bytes(400))
            code, reason, _ = await bad.end()
            patches = await good.play(5)
            return code, reason, len(patches)

    code, reason, patches = asyncio.run(happens())
    assert (code, patches) == (4400, 5)
    assert "count of rows" in reason


def test_a_disk_that_is_full_ends_the_recording_and_nobody_s_session(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    with small_disk(tmp_path / "disk", "2m") as disk:
        path = disk / "x.mcap"

        async def happens() -> int:
            async with serving(small_balloon, record=str(path)) as served:
                async with visit(served.url) as client:
                    client.probe, client.force = AT_SURFACE, (1.0, 0.0, 0.0)
                    await client.join("ann")
                    await client.play(300)  # of 5 ms: longer than a chunk
                    fill(disk)
                    await until(client, on=False)
                    return len(await client.play(20))

        assert asyncio.run(happens()) == 20
        outline = Outline.of(path)
        assert not outline.complete
        assert outline.users == {1: "ann"}


@pytest.mark.parametrize("wrong", ["there.mcap", "no.mcap/x.mcap", "x.txt"])
def test_a_file_that_cannot_be_made_is_an_error_at_the_start(
    wrong: str, small_balloon: Balloon, tmp_path: Path
) -> None:
    (tmp_path / "there.mcap").write_bytes(b"a recording")
    (tmp_path / "no.mcap").write_bytes(b"a file")

    async def happens() -> None:
        async with serving(small_balloon, record=str(tmp_path / wrong)):
            pytest.fail("it is served")

    with pytest.raises(SettingError, match=r"--record"):
        asyncio.run(happens())
    assert (tmp_path / "there.mcap").read_bytes() == b"a recording"


def test_a_folder_that_is_read_only_costs_nobody_s_session(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    async def happens(disk: Path) -> int:
        async with serving(small_balloon) as served, visit(served.url) as client:
            client.probe, client.force = AT_SURFACE, (1.0, 0.0, 0.0)
            await client.join("ann")
            await client.play(5)
            for path in (disk / "x.mcap", disk / "folder"):
                with pytest.raises(CohapticError, match=r"[Rr]ead-only"):
                    await served.server.recordings.begin(str(path))
            return len(await client.play(20))

    with small_disk(tmp_path / "disk", "64k") as disk:
        forbid_writing(disk)
        assert asyncio.run(happens(disk)) == 20


def test_recordings_in_one_folder_have_different_names(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    async def happens() -> None:
        async with serving(small_balloon) as served:
            for _ in range(3):
                await served.server.recordings.begin(str(tmp_path / "new" / "folder"))
                await served.server.recordings.end()

    asyncio.run(happens())
    assert len(list((tmp_path / "new" / "folder").iterdir())) == 3


def test_what_an_administrator_does_is_in_the_file(small_balloon: Balloon, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"

    async def happens() -> None:
        async with serving(small_balloon, record=str(path)) as served:
            await pressing(served, "ann", 3)
            outcome = served.server.session_host.stop()
            outcome.say("moderated", "root: kick of ann", user="ann")
            served.server.carry_out(outcome)

    asyncio.run(happens())
    kinds = [type(entry) for entry in read_entries(path)]
    assert kinds.count(Heard) >= 3
    assert kinds.count(Patched) >= 3
    assert kinds.count(Left) == 1
    (event,) = [entry for entry in read_entries(path) if isinstance(entry, Happened)]
    assert (event.kind, event.text) == ("moderated", "root: kick of ann")


def test_changes_that_come_at_once_are_made_and_told_in_their_order(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    folder = str(tmp_path)

    async def happens() -> tuple[list[bool], bool]:
        async with serving(small_balloon) as served, visit(served.url) as client:
            await client.join("ann")
            await client.play(1)
            recordings = served.server.recordings
            for _ in range(5):
                await asyncio.gather(
                    recordings.begin(folder), recordings.end(),
                    recordings.begin(folder), recordings.end(),
                )  # fmt: skip
            await recordings.begin(folder)
            now = served.server.room.world.tick
            while client.tick <= now:  # patches and news of before come first
                await client.play(1)
            return [
                n.on for n in client.news if isinstance(n, Recorded)
            ], recordings.current is not None

    told, going_on = asyncio.run(happens())
    assert going_on
    assert told[-1]  # only the newest state need come
    assert len(list(tmp_path.iterdir())) == 11
