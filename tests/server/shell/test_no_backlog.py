"""A acceptor where the system has no set of those who are silent: everybody comes out at once."""

from __future__ import annotations

import socket
from typing import Any

import pytest

from cohaptic_server.shell import acceptor as door_module
from cohaptic_server.shell.limiter import Taken
from tests.server.shell.stage import REQUEST
from tests.server.shell.test_acceptor import standing

pytestmark = pytest.mark.live


@pytest.mark.parametrize("said", [b"", REQUEST])
def test_where_nobody_can_be_held_all_come_out_at_once_counted_and_a_few_in_a_turn(
    said: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on other systems, where a acceptor has no backlog."""
    monkeypatch.setattr(door_module, "CAN_HOLD", False)
    with standing("open=30", "connections=1000:1000") as stand:
        given: list[socket.socket] = []
        guests = stand.come(40, said)
        turns = stand.until(lambda: stand.limiter.sources.refused == 10, given)
        assert turns >= 7
        assert (len(given), stand.limiter.sources.open, stand.acceptor.silent) == (30, 30, 0)
        assert all(isinstance(one, Taken) for one in given)
        refused = [guest for guest in guests if guest.getsockname() not in _peers(given)]
        assert len(refused) == 10
        for guest in refused:
            assert guest.recv(12) == b"HTTP/1.1 429"
        for one in given:
            one.close()
        assert stand.limiter.sources.open == 0
        given.clear()
        stand.come(1, said)
        stand.until(lambda: bool(given), given)
        given[0].close()


def _peers(given: list[socket.socket]) -> list[Any]:
    return [one.getpeername() for one in given]
