"""One whole client against a small server in the tests' process; real time, a second at most."""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import pytest

from cohaptic.errors import CloseCode, RemoteProtocolError, ServerLost
from cohaptic.protocol.messages import Bye, Error, FixedGains, GeometryName, Hello
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.simulated.hand import HandScript
from cohaptic.status.report import TouchStatus
from cohaptic.status.row import Row, rows_in
from cohaptic.vec import ZERO, norm
from cohaptic_client import client as runner
from cohaptic_client.client import Client
from cohaptic_client.network.conversation import Refused
from cohaptic_client.settings import ClientSettings
from tests.client.plane_server import BODY, PERIOD, Visit, plane_server
from tests.patience import PATIENCE

pytestmark = pytest.mark.alone

CHANGED = Error(code=CloseCode.OBJECT_CHANGED.value, message="there is another object now")
TAKEN = Error(code=CloseCode.NAME_TAKEN.value, message="name is 'left'; expected one that is free")

STOPS = Error(code=CloseCode.SERVER_STOPS.value, message="it stops")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Where the clients' shared memory is; nothing may stay behind there."""
    monkeypatch.setattr("cohaptic_client.loop.memory._IN_MEMORY", str(tmp_path))
    yield tmp_path
    assert list(tmp_path.iterdir()) == []


@dataclass
class Reported:
    """News and rows of a client, and its state at the end."""

    news: list[str] = field(default_factory=list[str])
    rows: list[Row] = field(default_factory=list[Row])
    first: TouchStatus | None = None
    last: TouchStatus | None = None


async def visit(
    reported: Reported,
    url: str,
    *,
    duration: float | None,
    patience: float = 0.0,
    patience_lost: float | None = None,
    geometry: GeometryName = "plane",
    passivity: bool = True,
    gains: FixedGains | None = None,
) -> None:
    script = HandScript(angle=math.pi, depth=0.01, approach_at=0.1)
    settings = ClientSettings(
        url=url,
        name="left",
        script=script,
        duration=duration,
        patience=patience,
        patience_lost=patience_lost,
        geometry=geometry,
        passivity=passivity,
        fixed_gains=gains,
    )
    client = Client(
        settings, tell=reported.news.append, keep=lambda rows: reported.rows.extend(rows_in(rows))
    )
    reported.first = client.status()
    try:
        await client.run()
    finally:
        reported.last = client.status()


def felt(hosted: Visit) -> bool:
    """Whether the hand has pressed on it."""
    return any(norm(sample.force) > 0.1 for sample in hosted.samples)


def play(
    *visits: Visit,
    duration: float | None = None,
    patience: float = 0.0,
    patience_lost: float | None = None,
    geometry: GeometryName = "plane",
    passivity: bool = True,
    gains: FixedGains | None = None,
    until: Callable[[], bool] | None = None,
) -> Reported:
    """A client at a server that hosts these visits in turn; to its end, or until `until` holds."""
    reported = Reported()

    async def work() -> None:
        async with plane_server(*visits) as url:
            going = asyncio.ensure_future(
                visit(
                    reported,
                    url,
                    duration=duration,
                    patience=patience,
                    patience_lost=patience_lost,
                    geometry=geometry,
                    passivity=passivity,
                    gains=gains,
                )
            )
            if until is not None:
                while not (until() or going.done()):
                    await asyncio.sleep(0.02)
                if not going.done():
                    going.cancel()
                    with contextlib.suppress(asyncio.CancelledError):
                        await going
            await asyncio.wait([going])
            if not going.cancelled():
                going.result()

    asyncio.run(asyncio.wait_for(work(), PATIENCE))
    return reported


def test_a_client_greets_sends_samples_and_leaves_with_zero_force_and_a_farewell() -> None:
    hosted = Visit()
    reported = play(hosted, until=lambda: felt(hosted) and len(hosted.samples) > 20)
    hello, *_, bye = hosted.heard
    assert isinstance(hello, Hello)
    assert (hello.name, hello.max_force, hello.max_stiffness) == ("left", 10.0, 2000.0)
    assert bye == Bye()
    samples = hosted.samples
    assert len(samples) == len(hosted.heard) - 2  # nothing before the one, nothing after the other
    assert [sample.seq for sample in samples] == list(range(1, len(samples) + 1))
    assert all(a.t_client <= b.t_client for a, b in pairwise(samples))
    assert max(norm(sample.force) for sample in samples) > 0.1
    assert samples[-1].force == ZERO
    # One for each tick while the loop runs; on a busy machine some are left out.
    times = sorted({sample.t_client for sample in samples})
    assert 5 < len(times) <= (times[-1] - times[0]) / PERIOD + 3
    assert reported.news == ["touching plane with nobody else"]
    assert reported.first == TouchStatus(name="left", state="connecting")
    assert reported.last is not None
    assert (reported.last.state, reported.last.force, reported.last.fault) == ("stopped", 0.0, "")
    assert reported.last.round_trip > 0.0
    # One machine, one wall clock, whatever the origins of the two processes' own.
    assert abs(reported.last.clock_offset) <= reported.last.clock_error + 0.05
    assert reported.rows[-1].fx == reported.rows[-1].fy == reported.rows[-1].fz == 0.0
    assert reported.rows[-1].tick > 1


def test_a_server_that_was_started_anew_is_felt_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its ticks count from 1, whatever the one before had reached."""
    monkeypatch.setattr(runner, "RETRY", 0.2)  # s; still longer than a server may be silent
    anew = Visit()

    def felt_anew() -> bool:  # and no force that fades yet, from the server before
        return any(norm(s.force) > 0.1 and 0 < s.tick < 5000 for s in anew.samples)

    reported = play(Visit(first_tick=5000, ticks=20), anew, patience=PATIENCE, until=felt_anew)
    ticks = [row.tick for row in reported.rows]
    assert 5000 < max(ticks) < 5020
    assert 1 < ticks[-1] < 5000


@pytest.mark.parametrize(("geometry", "said"), [("plane", True), ("mesh", False)])
def test_when_the_object_changes_a_hand_lets_go_comes_back_and_presses_without_a_jump(
    geometry: GeometryName, said: bool
) -> None:
    """The loop that runs was made for the old one: its force fades, and a new one begins free."""
    meshes = (wall(0.1), wall(0.2)) if geometry == "mesh" else (None, None)
    another = BODY.model_copy(update={"name": "another", "contact_radius": 0.03})
    then = Visit(rest_mesh=meshes[1], body=another, period=0.02)
    # By a message, or by the close alone.
    first = Visit(
        rest_mesh=meshes[0],
        ticks=60,
        farewell=CHANGED if said else None,
        close=None if said else CHANGED,
    )
    reported = play(first, then, geometry=geometry, until=lambda: felt(then))
    assert reported.news.count("touching plane with nobody else") == 1
    assert reported.news.count("touching another with nobody else") == 1
    assert max(norm(sample.force) for sample in first.samples) > 0.1
    assert max(norm(sample.force) for sample in then.samples) > 0.1
    forces = [norm((row.fx, row.fy, row.fz)) for row in reported.rows]
    # What the hand's own motion causes too: 2,000 N/m at 0.1 m/s.
    assert max(abs(b - a) for a, b in pairwise(forces)) < 0.2
    # It was let go in between, and the new loop had no force before it was free.
    turn = next(k for k, (a, b) in enumerate(pairwise(reported.rows)) if b.tick < a.tick)
    assert forces[turn] == 0.0
    assert max(forces[turn:]) > 0.1
    assert reported.last is not None
    assert reported.last.fault == ""


@pytest.mark.parametrize("patience", [0.0, 0.3])
def test_a_lost_server_is_tried_again_for_a_while_and_then_it_is_said_how_it_was_lost(
    patience: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "RETRY", 0.05)
    reported = Reported()

    async def work() -> None:
        async with plane_server(Visit(ticks=3)) as url:
            going = asyncio.ensure_future(visit(reported, url, duration=None, patience=patience))
            await asyncio.wait([going], timeout=None if patience == 0.0 else 0.15)
        # Nobody answers any more.
        with pytest.raises(ServerLost, match="the connection was lost"):
            await going

    asyncio.run(asyncio.wait_for(work(), PATIENCE))


def test_who_was_in_the_room_waits_for_it_without_end_however_short_the_first_wait(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As on the page."""
    monkeypatch.setattr(runner, "RETRY", 0.05)
    back = Visit()
    visits = [Visit(ticks=20), *(Visit(refuse=STOPS) for _ in range(5)), back]
    reported = play(*visits, patience_lost=math.inf, until=lambda: bool(back.samples))
    assert back.samples
    again = [news for news in reported.news if "trying again" in news]
    assert again
    assert all(news.endswith("; trying again") for news in again)


@pytest.mark.parametrize("patience", [0.0, 0.15])
def test_without_a_server_a_client_gives_up_when_its_patience_ends(
    patience: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "RETRY", 0.05)
    reported = Reported()
    with socket.socket() as reserved:
        reserved.bind(("127.0.0.1", 0))  # and never listens
        url = f"ws://127.0.0.1:{reserved.getsockname()[1]}"
        with pytest.raises(ServerLost, match="no server answers"):
            asyncio.run(visit(reported, url, duration=None, patience=patience))
    assert all("no server answers" in news and "trying again" in news for news in reported.news)
    assert len(reported.news) == (1 if patience else 0)  # once, and not with each attempt


def test_what_a_server_says_reaches_a_terminal_as_printable_lines() -> None:
    drawn = "\x1b[2J\u202eroot"
    body = BODY.model_copy(update={"name": drawn})
    reported = play(Visit(body=body), duration=0.3)
    assert "touching ?[2J?root with nobody else" in reported.news
    assert str(Refused(4400, drawn)) == "the server refused: ?[2J?root"


def test_on_its_way_back_a_client_waits_until_its_old_name_is_free(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(runner, "RETRY", 0.05)
    first, back = Visit(ticks=3), Visit()
    reported = play(first, Visit(refuse=TAKEN), back, duration=0.6, patience=5.0)
    assert [news.partition(" ")[0] for news in reported.news].count("touching") == 2
    assert any("name is 'left'" in news and "trying again" in news for news in reported.news)
    assert back.samples
    keys = [said.key for said in (first.heard[0], back.heard[0]) if isinstance(said, Hello)]
    assert keys[0] == keys[1] is not None


@pytest.mark.parametrize("rubbish", ["{}", "no JSON", '{"type": "user_left"}'])
def test_a_server_that_breaks_the_protocol_ends_the_client_with_its_error(rubbish: str) -> None:
    with pytest.raises(RemoteProtocolError):
        play(Visit(refuse=rubbish), patience=5.0)


def wall(size: float) -> RestMesh:
    """Two triangles in the plane of `plane_server`."""
    y = size
    return RestMesh(
        ((-0.1, -y, -y), (-0.1, y, -y), (-0.1, y, y), (-0.1, -y, y)), ((0, 2, 1), (0, 3, 2))
    )
