"""Serial ports that are never waited for."""

from __future__ import annotations

import os
import sys
from types import SimpleNamespace

import pytest

from cohaptic_client.devices.serial_ports import NeverWaiting

if sys.platform == "win32":
    pytest.skip("ports have no file numbers there", allow_module_level=True)


def test_a_port_that_is_full_is_not_waited_for() -> None:
    """pyserial's own `write` would try for ever, in the loop and in its watchdog."""
    boards, ours = os.pipe()
    os.set_blocking(ours, False)
    port = NeverWaiting(SimpleNamespace(fileno=lambda: ours))
    while port.write(bytes(4096)):
        pass
    assert port.write(b"[0,0,0]\n") == 0
    for end in (boards, ours):
        os.close(end)


def test_a_command_that_was_cut_off_is_ended_before_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sent, room = list[bytes](), [3, 100, 100]

    def write(_number: int, data: bytes) -> int:
        sent.append(data[: room.pop(0)])
        return len(sent[-1])

    monkeypatch.setattr(os, "write", write)
    port = NeverWaiting(SimpleNamespace(fileno=lambda: 0))
    for _ in range(3):
        port.write(b"[1,2,3]\n")
    monkeypatch.undo()
    assert b"".join(sent) == b"[1,\n[1,2,3]\n[1,2,3]\n"
