"""The package of `examples/plugin`, installed as a user installs it."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
import json
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from cohaptic import extensions
from cohaptic.errors import DeviceError, SettingError
from cohaptic.simulated.hand import Hand, HandScript, Intention
from cohaptic_client import DeviceConfig
from cohaptic_client.devices.catalogue import device_kind, names, open_device, read_device
from cohaptic_client.loop.added import chain_with, check_rules
from cohaptic_experiments import VirtualSession
from cohaptic_server import Body, CohapticServer, ServerSettings, Serving
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.routes import loaded, opened, read_wanted
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.testing import check_body
from cohaptic_server.testing.check_body import depth, press_vertex
from cohaptic_server.world.equilibrium import RestingHand, solve
from tests.patience import PATIENCE
from tests.server.shell.stage import visit

pytestmark = pytest.mark.live

PLUGIN = Path(__file__).parents[2] / "examples/plugin"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, source = tmp_path_factory.mktemp("site"), tmp_path_factory.mktemp("source") / "plugin"
    shutil.copytree(PLUGIN, source)  # a build leaves files beside the source
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    options = ["--no-build-isolation", "--target", str(folder), str(source)]
    subprocess.run([*install, *options], check=True)
    return folder


@pytest.fixture
def tracker(installed: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module of the device, with the package on the path."""
    monkeypatch.syspath_prepend(installed)  # pyright: ignore[reportUnknownMemberType]
    extensions.entries.cache_clear()
    yield importlib.import_module("cohaptic_example.tracker")
    extensions.entries.cache_clear()


@pytest.mark.usefixtures("tracker")
def test_the_drum_is_a_body_by_its_name_and_keeps_the_laws() -> None:
    check_body(build_body("drum"))
    assert build_body("drum", damping=1.0).name == "drum"
    with pytest.raises(SettingError, match="--nonlinear is 'drum'"):
        build_body("drum", nonlinear=True)


@pytest.mark.usefixtures("tracker")
def test_a_law_a_limit_and_a_filter_come_into_the_loop_by_their_names() -> None:
    names = ("hunt-crossley", "edge", "soften")
    check_rules(names)
    chain = [rule.name for rule in chain_with(names)]
    assert chain[chain.index("damping") - 1] == "hunt_crossley"
    assert "law" not in chain
    friction = chain.index("friction")
    assert chain[friction : friction + 3] == ["friction", "edge", "soften"]
    with pytest.raises(SettingError, match="given once"):
        check_rules(("edge", "edge"))


def test_the_tracker_goes_where_a_datagram_says(tracker: ModuleType) -> None:
    assert "tracker" in names()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
    choice = read_device(f"tracker:port={port},place=center")
    config = DeviceConfig(choice, (0.0, 0.0, 0.0), 0.1, Hand(), None)
    device = open_device(config)
    try:
        with pytest.raises(DeviceError, match=f"port {port} cannot be had"):
            tracker.Tracker(port)
        assert not device.read(0.0).fresh
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as camera:

            def say(words: bytes, now: float) -> tuple[float, float, float]:
                camera.sendto(words, ("127.0.0.1", port))
                sample = device.read(now)
                assert sample.fresh
                return sample.position

            assert say(b"0.01 0.02 0.03", 0.01) == pytest.approx((0.01, 0.02, 0.03))
            moved = say(b"0.011 0.02 0.03", 0.02)
            assert moved == pytest.approx((0.011, 0.02, 0.03))
            assert device.read(0.021).velocity == pytest.approx((0.1, 0.0, 0.0))
            for garbage in (b"", b"1 2", b"nan 0 0", b"inf 0 0", b"9 9 9", b"a b c", b"1 0 0"):
                assert say(garbage, 0.03) == moved
            assert not device.read(1.0).fresh
            # It may be anywhere by now, and nobody knows how fast it is.
            assert say(b"0.5 0 0", 2.0) == pytest.approx((0.5, 0.0, 0.0))
            assert device.read(2.001).velocity == (0.0, 0.0, 0.0)
            assert not device.read(3.0).fresh
    finally:
        device.close()
        device.close()


@pytest.mark.usefixtures("tracker")
def test_programs_read_the_forces_while_the_server_runs_and_not_more_than_may() -> None:
    async def read(url: str) -> dict[str, float]:
        kinds = [Subprotocol("example-forces.1")]
        async with connect(url, subprotocols=kinds, proxy=None) as ws:
            async for reported in ws:
                forces: dict[str, float] = json.loads(reported)["forces"]
                if any(forces.values()):
                    with pytest.raises(ConnectionClosed, match="as many as may, 1, read already"):
                        async with connect(url, subprotocols=kinds, proxy=None) as other:
                            await other.recv()
                    return forces
        raise AssertionError("it was closed")

    async def play() -> None:
        wanted = read_wanted(["forces=1"])
        server = CohapticServer(build_body("drum"), ServerSettings(port=0))
        serving = Serving(server, ServedBody(server.room.body))
        async with opened(loaded(wanted), wanted, serving) as lines:
            (line,) = lines
            assert line.startswith("programs of this machine may read forces")
            url = await server.start()
            running = asyncio.ensure_future(server.run())
            async with asyncio.timeout(PATIENCE), visit(url) as hand:
                await hand.join("ada")
                hand.probe, hand.force = (-0.01, 0.0, 0.0), (1.0, 0.0, 0.0)
                pressing = asyncio.ensure_future(hand.play(100_000))
                forces = await read(url)
                pressing.cancel()
            running.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await running
        assert forces.keys() == {"ada"}
        assert 0.0 < forces["ada"] <= 1.0 + 1e-9

    asyncio.run(play())


@pytest.mark.usefixtures("tracker")
def test_the_command_line_knows_them_all(installed: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    run = [sys.executable, "-m", "cohaptic"]
    reported = subprocess.run(
        [*run, "devices", "options", "tracker"], env=environment, capture_output=True, text=True
    )
    assert "port: on which it listens" in reported.stdout
    refused = subprocess.run(
        [*run, "serve", "--body", "drums"], env=environment, capture_output=True, text=True
    )
    assert refused.returncode == 2
    assert "one of: balloon, spring, drum, sheet, or a file" in refused.stderr
    refused = subprocess.run(
        [*run, "serve", "--route", "force"], env=environment, capture_output=True, text=True
    )
    assert refused.returncode == 2
    assert (
        "--route is 'force'; it must be one that an installed package adds: forces"
        in refused.stderr
    )
    assert device_kind("tracker").name == "tracker"


@pytest.fixture(scope="module")
def sheet() -> Body:
    spec = importlib.util.spec_from_file_location("sheet", PLUGIN / "cohaptic_example/sheet.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made: Body = module.Sheet()
    return made


def test_the_sheet_that_hardens_keeps_the_laws(sheet: Body) -> None:
    check_body(sheet)
    # Three times the force dent it by less than two and a half times as much.
    dents = [press_vertex(sheet, 112, force) for force in (1.0, 3.0)]
    depths = [depth(load, sheet.respond([load])) for load in dents]
    assert 0.0 < depths[1] < 2.5 * depths[0]


@pytest.mark.parametrize("delay", [0.0, 0.08])
def test_on_the_sheet_hands_get_no_models_and_rest_at_its_own_equilibrium(
    sheet: Body, delay: float
) -> None:
    session, deep = VirtualSession(sheet), (0.03, 0.02)
    hands = [
        session.join(
            name,
            HandScript(),
            intention=Intention((0.0, y, 0.0), (-1.0, 0.0, 0.0), depth, approach_at=0.5),
            delay=delay,
            models=True,
        )
        for name, y, depth in zip("ab", (-0.015, 0.015), deep, strict=True)
    ]
    session.run(6.0)
    assert session.room.world.wishes.weight == 0.0
    assert all(hand.state.replica is None or not hand.state.replica.news.weight for hand in hands)
    resting = [
        RestingHand((-depth, y, 0.0), Hand().stiffness)
        for depth, y in zip(deep, (-0.015, 0.015), strict=True)
    ]
    true = solve(sheet, resting).force
    felt = [hand.force[-1] for hand in hands]
    assert felt == pytest.approx(true.tolist(), rel=0.01)
