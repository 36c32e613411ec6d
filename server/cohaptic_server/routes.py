"""Services that a server of one room offers, by the entry points `cohaptic.routes`.

A route may open a port of its own, or add an `Endpoint` to the server. It lasts as long as the
server.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncGenerator, Callable, Generator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass

from cohaptic.errors import CohapticError, SettingError
from cohaptic.extensions import OURS, ExtensionError, added, adder, load
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.server import CohapticServer

log = logging.getLogger("cohaptic.server")

GROUP = "cohaptic.routes"
ENDING = 5.0  # s for all routes to end; a server that somebody ends must end


@dataclass(frozen=True, eq=False)
class Serving:
    """A server whose address is not told yet.

    Args:
        server: The server.
        served: Its body, and the process that solves for it.
        damping: B_o over K_o of each object that it serves.
        nonlinear: Whether each object is a nonlinear solid.
    """

    server: CohapticServer
    served: ServedBody
    damping: float = 0.0
    nonlinear: bool = False


def no_text(text: str) -> None:
    """Raise SettingError unless the text is empty."""
    if text:
        raise SettingError("text of a route", repr(text[:60]), "left out: it takes none")


@dataclass(frozen=True, slots=True)
class Route:
    """A service beside hands and watchers.

    Args:
        open: Called with the server and the text of its option. It lasts as long as the server,
            and yields a line for the log, or an empty one.
        check: Called with the same text before the object is built; raises SettingError for one
            that cannot be used. Without it no text can.
    """

    open: Callable[[Serving, str], AbstractAsyncContextManager[str]]
    check: Callable[[str], object] = no_text


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
            limit = "one that an installed package adds: " + (", ".join(others()) or "none does")
            if name in added(GROUP):
                limit += "; ours have options of their own"
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
        with _blamed(name):
            routes[name].check(text)
    return routes


@contextlib.asynccontextmanager
async def opened(
    routes: Mapping[str, Route], wanted: Mapping[str, str], serving: Serving
) -> AsyncGenerator[list[str]]:
    """Have all routes open; yields their lines for the log.

    Raises:
        CohapticError: One cannot be opened.
    """
    lines: list[str] = []
    stack = contextlib.AsyncExitStack()
    try:
        for name, route in routes.items():
            with _blamed(name):
                lines.append(await stack.enter_async_context(route.open(serving, wanted[name])))
        yield [line for line in lines if line]
    finally:
        try:
            async with asyncio.timeout(ENDING):
                await stack.aclose()
        except TimeoutError:
            log.warning("a route does not end within %g s: %s", ENDING, ", ".join(routes))


@contextlib.contextmanager
def _blamed(name: str) -> Generator[None]:
    """Whatever the code of another package raises is one sentence that names the package."""
    try:
        yield
    except CohapticError:
        raise
    except Exception as error:
        if adder(GROUP, name) == OURS:
            raise
        why = f"{type(error).__name__}: {error}"
        raise ExtensionError(GROUP, name, adder(GROUP, name), why) from error
