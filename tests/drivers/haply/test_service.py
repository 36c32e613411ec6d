"""What is told when the device or its service cannot be had, over real sockets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from socket import socket
from threading import Event, Thread

import pytest
from websockets.sync.server import ServerConnection, serve

from cohaptic.clock import SystemClock
from cohaptic.errors import DeviceError
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_drivers.haply.service import Service, ServiceSilent
from tests.client.plane import CONFIG
from tests.drivers.haply.haply_bench import Bench

pytestmark = pytest.mark.live


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("flag", "value", "words"),
    [
        ("power_supply", False, "has no power: it senses, and gives no force; plug its power"),
        ("calibrated", False, "is not calibrated; put its arms into the resting position"),
        ("ready", False, "is not ready"),
        ("started", False, "is not ready"),
        ("in_use", True, "is in use by another program; quit that program"),
    ],
)
def test_what_keeps_it_from_giving_force_is_told_with_what_to_do(
    bench: Bench, flag: str, value: bool, words: str
) -> None:
    bench.arm.status[flag] = value
    assert words in bench.complaint()


def test_a_frame_that_is_not_the_devices_own_is_refused(bench: Bench) -> None:
    bench.arm.config["basis"] = {"permutation": "XZY"}
    assert "another frame: its axes are permuted (XZY)" in bench.complaint()
    bench.arm.config.clear()
    bench.arm.transform = {"scale": {"x": 2.0}}
    assert "another frame: its scale is transformed" in bench.complaint()


def other_address(url: str) -> str:
    with pytest.raises(DeviceError) as caught:
        open_device(replace(CONFIG.device, choice=read_device(f"haply:url={url}")))
    return str(caught.value)


def test_no_service_is_told_with_what_to_install() -> None:
    with socket() as unheard:  # nobody else can listen there meanwhile
        unheard.bind(("127.0.0.1", 0))
        port = unheard.getsockname()[1]
        reported = other_address(f"ws://127.0.0.1:{port}")
    assert f"the Haply service does not run: nothing answers at ws://127.0.0.1:{port}" in reported


def test_another_websocket_at_the_address_is_not_the_service() -> None:
    with serve(lambda c: c.send('{"type": "welcome"}'), "127.0.0.1", 0) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        reported = other_address(f"ws://127.0.0.1:{server.socket.getsockname()[1]}")
        server.shutdown()
        thread.join()
    assert "is not the Haply service (its first message lists no inverse3)" in reported


def test_an_answer_that_came_while_the_own_process_stood_still_counts() -> None:
    answered = Event()

    def answer(connection: ServerConnection) -> None:
        for _ in connection:
            connection.send("answer")
            answered.set()

    with serve(answer, "127.0.0.1", 0) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        service = Service(f"ws://127.0.0.1:{server.socket.getsockname()[1]}", SystemClock())
        service.send("question")
        assert answered.wait(30.0)
        over = -1.0  # s; the time for it was over a second ago
        assert service.receive(over) == "answer"
        with pytest.raises(ServiceSilent):
            service.receive(over)
        service.close()
        server.shutdown()
        thread.join()
