"""Services that a server offers while it serves an object, by the entry points `cohaptic.routes`.

A route may open a port of its own, or add an `Endpoint` to those of the server. It lasts as long
as the server.
"""

from __future__ import annotations

import contextlib
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass

from cohaptic.errors import SettingError
from cohaptic.extensions import OURS, added, adder, load
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.server import CohapticServer

GROUP = "cohaptic.routes"


@dataclass(frozen=True, eq=False)
class Serving:
    """A server that is about to listen.

    Args:
        server: The server.
        served: The process that solves for its body.
        damping: B_o over K_o of each object that it serves.
        nonlinear: Whether each object is a nonlinear solid.
    """

    server: CohapticServer
    served: ServedBody
    damping: float = 0.0
    nonlinear: bool = False


@dataclass(frozen=True, slots=True)
class Route:
    """A service beside hands and watchers.

    Args:
        open: Called with the server and the text that its option has. It lasts as long as the
            server; its value is a line for the log, or an empty one.
        check: Called with the same text before the object is built; raises SettingError for one
            that cannot be used.
    """

    open: Callable[[Serving, str], AbstractAsyncContextManager[str]]
    check: Callable[[str], object] = bool


def others() -> list[str]:
    """Names of the routes that other packages add."""
    return [name for name in added(GROUP) if adder(GROUP, name) != OURS]


def read_wanted(given: Sequence[str]) -> dict[str, str]:
    """Texts of routes of other packages, by their names, as `--route NAME=TEXT` gives them.

    Raises:
        SettingError: There is no such route, or it is given twice.
    """
    wanted: dict[str, str] = {}
    for each in given:
        name, _, text = each.partition("=")
        if name not in others():
            limit = ", ".join(others()) or "added by an installed package, and none adds one"
            raise SettingError("--route", repr(each[:60]), limit)
        if name in wanted:
            raise SettingError("--route", repr(each[:60]), f"given once for {name}")
        wanted[name] = text
    return wanted


def loaded(wanted: Mapping[str, str]) -> dict[str, Route]:
    """The routes of these names, each checked with its text.

    Raises:
        ExtensionError: One cannot be imported.
        SettingError: One cannot be used with its text.
    """
    routes = {name: load(GROUP, name, Route) for name in wanted}
    for name, text in wanted.items():
        routes[name].check(text)
    return routes


@contextlib.asynccontextmanager
async def opened(
    routes: Mapping[str, Route], wanted: Mapping[str, str], serving: Serving
) -> AsyncGenerator[list[str]]:
    """Have all routes open; the value is their lines for the log."""
    async with contextlib.AsyncExitStack() as stack:
        lines = [
            await stack.enter_async_context(route.open(serving, wanted[name]))
            for name, route in routes.items()
        ]
        yield [line for line in lines if line]
