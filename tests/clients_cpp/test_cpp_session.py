"""A live session of a hand in C++ and one in Python, on one object: they feel the same."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import math
import signal
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
import pytest
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from cohaptic.protocol.messages import BodyInfo, Welcome, encode_control
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.vec import Vec3, add, norm
from tests.client.plane_server import BODY, CLOCK, SURFACE
from tests.client.plane_server import PERIOD as PERIOD_OF_PLANE
from tests.clients_cpp.programs import build, compiler
from tests.clients_cpp.python_hand import PythonHand
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

DEPTH = 0.008  # m behind the resting surface
HOLD = 4.0  # s; far more than a room's lag
AGREE = 0.01  # of the force
STEADY = 10  # lines of the program, each 0.1 s, at the end of its hold
# As in press.cpp: where the tip waits [m], how fast it presses [m/s], and from when on [s].
CLEARANCE, SPEED, ENGAGED = 0.01, 0.01, 1.3


@pytest.fixture(scope="module")
def press(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(compiler("g++"), "press.cpp", tmp_path_factory.mktemp("cpp") / "press")


@pytest.fixture
def server() -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A server on loopback, with the balloon: its address and its process."""
    command = [sys.executable, "-m", "cohaptic", "serve", "--port", "0", "--lifeline"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("listening ws://"), line
        yield line.removeprefix("listening ").strip(), process
        process.stdin.close()
        process.wait(PATIENCE)


def opposite(body: BodyInfo, t: float) -> Vec3:
    """The tip of a hand that presses as press.cpp does, on the other side of the object."""
    way = min(CLEARANCE + DEPTH, SPEED * max(0.0, t - ENGAGED)) - CLEARANCE
    return add(body.center, (body.radius - way, 0.0, 0.0))


async def together(press: Path, url: str) -> tuple[list[dict[str, Any]], list[Vec3], Vec3]:
    """Both press at once.

    Returns:
        Lines of the program in C++, the force on the hand in Python at each [N], and that force
        once it is alone.
    """
    hand = PythonHand(url, "python", opposite)
    touching = asyncio.ensure_future(hand.run())
    words = (url, "cpp", str(HOLD), str(DEPTH))
    program = await asyncio.create_subprocess_exec(press, *words, stdout=asyncio.subprocess.PIPE)
    assert program.stdout is not None
    lines, forces = list[dict[str, Any]](), list[Vec3]()
    async with asyncio.timeout(PATIENCE):
        async for line in program.stdout:
            lines.append(json.loads(line))
            forces.append(hand.force)
        assert await program.wait() == 0
        await asyncio.sleep(2.0)  # the object comes back to one hand
    alone = hand.force
    assert not touching.done()
    touching.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await touching
    return lines, forces, alone


def test_a_hand_in_cpp_and_one_in_python_feel_the_same_object(
    press: Path, server: tuple[str, subprocess.Popen[str]]
) -> None:
    """They press from two sides, as deep: the balloon is its own image in a mirror between."""
    lines, forces, alone = asyncio.run(together(press, server[0]))
    held = [i for i, line in enumerate(lines) if line["phase"] == "holds"][-STEADY:]
    assert len(held) == STEADY
    cpp = np.array([lines[i]["force"] for i in held])
    python = np.array([forces[i] for i in held])
    ours, theirs = (float(np.linalg.norm(f, axis=1).mean()) for f in (cpp, python))
    print(f"cpp {ours:.5f} N, python {theirs:.5f} N, alone {norm(alone):.5f} N")
    assert ours > 1.0
    assert ours == pytest.approx(theirs, rel=AGREE)
    mirrored = python[-1] * np.array([-1.0, 1.0, 1.0])
    assert cpp[-1] == pytest.approx(mirrored, abs=AGREE * theirs)
    assert cpp[-1][0] < 0.0  # out of the object
    # What the one did the other felt.
    assert abs(norm(alone) - theirs) > 2.0 * AGREE * theirs
    # It leaves with a ramp, and with no force.
    last = [norm(tuple(line["force"])) for line in lines if line["phase"] == "leaves"]
    assert last[0] > 0.5 * ours
    assert last[-1] == 0.0
    assert lines[-1]["k_o"] == pytest.approx(250.0, rel=0.2)  # of the balloon, at its equator


def fades(rows: list[dict[str, Any]]) -> None:
    """Judge a press whose end was the server's fault: the force fades, and makes no step."""
    forces = [norm(tuple(row["force"])) for row in rows]
    assert max(forces) > 1.0
    assert forces[-1] < max(forces)
    # In the 100 periods between two lines, each of which counts for two at most, at 10 N/s.
    steps = [after - before for before, after in itertools.pairwise(forces)]
    assert min(steps) > -2.0 - 1e-6


NAN = struct.pack("<f", math.nan)
BROKEN: dict[str, tuple[Callable[[bytes], str | bytes | list[bytes]], str]] = {
    "nan": (lambda patch: patch[:32] + NAN + patch[36:], "length of x_free is nan m;"),
    "short": (lambda patch: patch[:-1], "patch length is 115; expected 116 bytes"),
    "fragments": (lambda patch: [patch[:50], patch[50:]], "frame is a fragment;"),
    "long": (lambda _: bytes(2000), "bytes of a frame is 2000; expected from 0 to 1536"),
    "text": (lambda _: '{"type":"scene"}', "message is scene; expected patch,"),
    "json": (lambda _: '{"type":', "JSON at character 8 is no value;"),
    "put out": (
        lambda _: '{"type":"error","code":4403,"field":"","message":"an administrator did it"}',
        "the server refused: an administrator did it",
    ),
}


async def break_the_protocol(ws: ServerConnection) -> None:
    """Serve a plane until the hand has pressed for a while; then send what the path names."""
    await ws.recv()
    period = PERIOD_OF_PLANE
    welcome = Welcome(user=1, name="cpp", simulation_period=period, body=BODY, users=())
    await ws.send(encode_control(welcome))
    start = CLOCK.now()
    tick, frame = 0, b""
    while (now := CLOCK.now()) < start + ENGAGED + (CLEARANCE + DEPTH) / SPEED + 0.5:
        tick += 1
        frame = replace(SURFACE, tick=tick, t_server=now).encode()
        await ws.send(frame)
        await asyncio.sleep(period)
    assert ws.request is not None
    broken, _ = BROKEN[unquote(ws.request.path[1:])]
    await ws.send(broken(frame))
    with contextlib.suppress(ConnectionClosed):  # as the client closes it
        async for _ in ws:
            pass


async def press_on(press: Path, url: str) -> tuple[int | None, list[dict[str, Any]], str]:
    """Exit status of a press, its lines, and its last words."""
    program = await asyncio.create_subprocess_exec(
        press, url, "cpp", "30", str(DEPTH), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    async with asyncio.timeout(PATIENCE):
        out, error = await program.communicate()
    return program.returncode, [json.loads(line) for line in out.splitlines()], error.decode()


def test_a_server_that_breaks_the_protocol_leaves_the_hand_with_a_ramp_and_a_reason(
    press: Path,
) -> None:
    async def all_of_them() -> list[tuple[int | None, list[dict[str, Any]], str]]:
        protocols = [Subprotocol(SUBPROTOCOL)]
        async with serve(break_the_protocol, "127.0.0.1", 0, subprotocols=protocols) as server:
            port = server.sockets[0].getsockname()[1]
            urls = [f"ws://127.0.0.1:{port}/{quote(name)}" for name in BROKEN]
            return await asyncio.gather(*(press_on(press, url) for url in urls))

    ends = asyncio.run(all_of_them())
    for (_, reason), (status, rows, words) in zip(BROKEN.values(), ends, strict=True):
        assert words.startswith(f"press: {reason}")
        assert status == 1
        fades(rows)


def test_a_server_that_dies_leaves_the_hand_with_a_ramp_and_a_reason(
    press: Path, server: tuple[str, subprocess.Popen[str]]
) -> None:
    url, process = server
    words = [str(press), url, "cpp", "30", str(DEPTH)]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout is not None
        assert program.stderr is not None
        rows = list[dict[str, Any]]()
        for line in program.stdout:
            rows.append(json.loads(line))
            if len([row for row in rows if row["phase"] == "holds"]) == STEADY:
                process.send_signal(signal.SIGKILL)
        assert program.wait(PATIENCE) == 1
        assert "press: the " in program.stderr.read()
    fades(rows)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("wss://127.0.0.1:1", "cpp", "1", "0.008"), "this client has no TLS"),
        (("ws://127.0.0.1:1", "cpp", "1", "0.008"), "no server answers at 127.0.0.1 port 1"),
        (("ws://127.0.0.1:1", "cpp", "1"), "usage: press"),
    ],
)
def test_a_mistake_is_told_in_words(press: Path, words: tuple[str, ...], reason: str) -> None:
    done = subprocess.run([str(press), *words], capture_output=True, text=True, check=False)
    assert done.returncode in (1, 2)
    assert reason in done.stderr


def test_a_refusal_of_the_server_is_told_in_its_words(
    press: Path, server: tuple[str, subprocess.Popen[str]]
) -> None:
    words = [str(press), server[0], " ", "1", "0.008"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "press: the server refused: " in done.stderr
    words = [str(press), f"{server[0].rstrip('/')}/r/nowhere", "cpp", "1", "0.008"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "nowhere" in done.stderr or "4404" in done.stderr
