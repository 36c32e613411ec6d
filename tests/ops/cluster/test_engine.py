"""What runs of the engine on a machine, and that nothing of it is imported."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.testing.manual_clock import ManualClock
from cohaptic_ops.cluster import engine
from cohaptic_ops.cluster.addresses import own_address
from cohaptic_ops.cluster.engine import Engine, environment, start_command
from cohaptic_ops.cluster.lines import Placed
from tests.patience import PATIENCE

HEAD = "10.0.0.1:6379"


def test_the_head_is_on_the_machine_of_its_address_alone() -> None:
    head = start_command(HEAD, "10.0.0.1", leads=True)
    assert {"--head", "--port=6379", "--node-ip-address=10.0.0.1", "--block"} <= set(head)
    settings = next(word for word in head if word.startswith("--system-config="))
    noticed = json.loads(settings.partition("=")[2])
    # A machine that is lost is noticed within the 5 s that its users may wait.
    checks = noticed["health_check_failure_threshold"]
    assert checks * noticed["health_check_period_ms"] < 2500.0
    other = start_command(HEAD, "10.0.0.2", leads=False)
    assert "--head" not in other
    assert f"--address={HEAD}" in other


def test_news_of_one_room_are_added_and_a_whole_list_replaces_what_was_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(engine, "_program", lambda: Path(sys.executable))
    there = Engine(HEAD, "10.0.0.1", SystemClock(), leads=True, watches=True)
    assert not there.reached
    assert not there.hear(b"RuntimeError: the head is gone\n")
    assert not there.reached
    for line, known in (
        (Placed(rooms={"a": "10.0.0.1"}), {"a": "10.0.0.1"}),
        (Placed(rooms={"b": "10.0.0.2"}, more=True), {"a": "10.0.0.1", "b": "10.0.0.2"}),
        (Placed(rooms={"b": ""}), {"b": ""}),
    ):
        assert there.hear(line.model_dump_json().encode())
        assert there.placed == known
    assert there.reached


def test_it_is_away_only_after_the_time_that_it_has_to_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(engine, "_program", lambda: Path(sys.executable))
    clock = ManualClock(100.0)
    there = Engine(HEAD, "10.0.0.1", clock, leads=True, watches=True)
    clock.sleep_until(122.0)
    assert not there.reached
    assert not there.away
    clock.sleep_until(123.5)
    assert there.away
    there.hear(Placed().model_dump_json().encode())
    assert there.reached
    assert not there.away
    clock.sleep_until(127.0)
    assert not there.reached
    assert there.away


def test_all_machines_use_rays_token_where_there_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    assert environment({"A": "b"}) == {"A": "b", "RAY_AUTH_MODE": "disabled"}
    assert environment({"RAY_AUTH_TOKEN": "x"})["RAY_AUTH_MODE"] == "token"
    (tmp_path / ".ray").mkdir()
    (tmp_path / ".ray/auth_token").write_text("x")
    assert environment({})["RAY_AUTH_MODE"] == "token"
    assert environment({"RAY_AUTH_MODE": "disabled"})["RAY_AUTH_MODE"] == "disabled"


@pytest.mark.live
def test_a_wrong_address_of_the_engine_is_refused_by_name() -> None:
    for wrong in ("6379", "10.0.0.1:", "10.0.0.1:port", "no.such.name.invalid:1"):
        with pytest.raises(SettingError, match="HOST:PORT of the first machine's engine"):
            own_address(wrong)
    assert own_address("127.0.0.1:6379") == "127.0.0.1"


@pytest.mark.live
@pytest.mark.skipif(sys.platform == "win32", reason="rooms are handed sockets over")
def test_what_a_server_started_for_the_engine_ends_when_the_server_is_killed() -> None:
    script = (
        "import subprocess, sys, time; subprocess.Popen([sys.executable, '-m',"
        " 'cohaptic_ops.cluster.machine', sys.executable, '-c',"
        " 'import os, time; print(os.getpid(), flush=True); time.sleep(600)'],"
        " stdin=subprocess.PIPE); time.sleep(600)"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) as server:
        assert server.stdout is not None
        started = int(server.stdout.readline())
        server.send_signal(signal.SIGKILL)
        # Its output is open for as long as it lives.
        assert server.stdout.read() == b""
    clock = SystemClock()
    until = clock.now() + PATIENCE
    while Path(f"/proc/{started}").exists() and clock.now() < until:
        clock.sleep_until(clock.now() + 0.02)
    assert not Path(f"/proc/{started}").exists()
