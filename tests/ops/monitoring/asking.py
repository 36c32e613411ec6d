"""Asks an admin port, as a probe or Prometheus does."""

from __future__ import annotations

import asyncio
import itertools
import json
import urllib.error
import urllib.request
from collections.abc import Callable
from typing import Any

from cohaptic_ops.monitoring.admin_port import AdminPort
from tests.ops.monitoring.some import health, room
from tests.patience import PATIENCE


async def ask(url: str, **headers: str) -> tuple[int, bytes]:
    """Status and body."""

    def get() -> tuple[int, bytes]:
        request = urllib.request.Request(url, headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
                return answer.status, answer.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.read()

    return await asyncio.to_thread(get)


async def status_once(url: str, condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """The state, once it is as it should be; also while nobody answers."""
    async with asyncio.timeout(PATIENCE):
        while True:
            try:
                reported: dict[str, Any] = json.loads((await ask(f"{url}/status"))[1])
                if condition(reported):
                    return reported
            except OSError:
                pass
            await asyncio.sleep(0.1)


async def told_until(port: AdminPort, state: str, **more: Any) -> dict[str, Any]:
    """What a port tells once it is in a state; it hears of a room again, as all it knows soon is
    old.
    """
    ticks = itertools.count(1)

    def reached(reported: dict[str, Any]) -> bool:
        port.tell(health())
        port.tell(room(ticks=next(ticks), **more))
        return bool(reported[state])

    return await status_once(port.url, reached)
