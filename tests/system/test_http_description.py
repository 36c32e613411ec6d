"""The description of the HTTP calls and a real server agree: schemathesis makes up the requests."""

from __future__ import annotations

import json
import re
import sys
import threading
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings

from cohaptic.clock import SystemClock
from cohaptic_tools.demo.processes import Process

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="hands sockets over"),
]
DESCRIBED = Path(__file__).parents[2] / "docs/openapi"
CONFIG = """
port = 0
[admin]
port = 0
[limits]
connections = "2000:20000"
[rooms.main]
body = "balloon"
[rooms.main.limits]
connections = "2000:20000"
[rooms.other]
body = "spring"
"""
CLOCK, PATIENCE = SystemClock(), 60.0
EXAMPLES = 20  # for each operation: 12 operations in a few seconds


@dataclass
class Addresses:
    """Of a server with two rooms."""

    server: str
    admin: str


@pytest.fixture(scope="module")
def addresses(tmp_path_factory: pytest.TempPathFactory) -> Generator[Addresses]:
    folder = tmp_path_factory.mktemp("described")
    path, log = folder / "rooms.toml", folder / "server.log"
    path.write_text(CONFIG)
    server = Process("serve", "--config", str(path), "--log-format", "json", log=log)
    url = server.first_line().removeprefix("listening ")
    deadline = CLOCK.now() + PATIENCE
    while (found := re.search(r"admin port (http://[0-9.:]+)", log.read_text())) is None:
        assert CLOCK.now() < deadline
        threading.Event().wait(0.05)
    # Before its rooms have told of their first ticks it answers 503, which counts as an error here.
    while not ready(found[1]):
        assert CLOCK.now() < deadline
        threading.Event().wait(0.05)
    yield Addresses(url.replace("ws", "http", 1), found[1])
    server.wait()
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    assert not [line for line in lines if "traceback" in line]
    assert {"room_open", "message"} <= {line["event"] for line in lines}


def ready(admin: str) -> bool:
    """Whether all rooms tick."""
    try:
        with urlopen(f"{admin}/readyz"):
            return True
    except HTTPError as error:
        error.close()
        return False


def described(name: str, address: str) -> Any:
    untyped: Any = schemathesis.openapi  # in parts
    schema = untyped.from_path(DESCRIBED / f"{name}.json")
    schema.config.update(base_url=address)
    return schema


@pytest.mark.parametrize("name", ["server", "admin"])
def test_every_answer_is_as_described(name: str, addresses: Addresses) -> None:
    schema = described(name, getattr(addresses, name))
    operations = [result.ok() for result in schema.get_all_operations()]
    assert len(operations) == {"server": 7, "admin": 5}[name]
    for operation in operations:

        @settings(
            max_examples=EXAMPLES,
            deadline=None,
            phases=[Phase.explicit, Phase.generate],
            suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
        )
        @given(case=operation.as_strategy())
        def check(case: Any) -> None:
            case.call_and_validate()

        check()
