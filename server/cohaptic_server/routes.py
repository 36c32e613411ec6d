"""Loads and opens routes: services that packages add to the server of one room.

A package registers a route as an entry point of the group `cohaptic.routes`. A route may open a
port of its own, or add an `Endpoint` to the server. A route stays open as long as the server runs.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass

from cohaptic.errors import CohapticError, SettingError
from cohaptic.extensions import OURS, ExtensionError, added, adder, load
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.server import CohapticServer

log = logging.getLogger("cohaptic.server")

GROUP = "cohaptic.routes"
OPENING = 90.0  # s for one route to open; the admin port waits up to 60 s for its process
ENDING = 5.0  # s for all routes to end by themselves, so that no route keeps a server from ending


@dataclass(frozen=True, eq=False)
class Serving:
    """Argument of every route: a server that listens but has not announced its address yet.

    Args:
        server: Server of one room.
        served: Manager of the process that solves for the columns of the server's body.
        damping: Ratio B_o / K_o of damping to stiffness in eq. (9), the same for every object:
            relaxation time over simulation period.
        nonlinear: Whether each object is a nonlinear solid.
    """

    server: CohapticServer
    served: ServedBody
    damping: float = 0.0
    nonlinear: bool = False


Open = Callable[[Serving, str], AbstractAsyncContextManager[str]]


def no_text(text: str) -> None:
    """Check the option of a route without settings: raise SettingError unless it is empty."""
    if text:
        raise SettingError("text of a route", repr(text[:60]), "left out: it takes none")


@dataclass(frozen=True, slots=True)
class Route:
    """A service that a server offers beside its connections to users and watchers.

    Args:
        open: Function of the server and the text of the route's option. It returns a context
            manager that stays open while the server runs, and that yields a line for the log, or an
            empty text.
        check: Function of the same text, called before the object is built; it raises SettingError
            if the route cannot use the text. The default accepts only an empty text.
    """

    open: Open
    check: Callable[[str], object] = no_text


def others() -> list[str]:
    """Return the names of the routes that installed packages other than this one add."""
    return [name for name in added(GROUP) if adder(GROUP, name) != OURS]


def read_wanted(given: Sequence[str]) -> dict[str, str]:
    """Parse options of the form `--route NAME=TEXT`; return each text by the name of its route.

    Args:
        given: Values of the options, each `NAME=TEXT`, or `NAME` for an empty text.

    Raises:
        SettingError: No other package adds a route of this name, or a name is given twice.
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
    """Import routes by their names, and let each check the text of its option.

    Args:
        wanted: Text of each route's option, by the name of the route.

    Raises:
        ExtensionError: A route cannot be imported, or its check fails with an unexpected error.
        SettingError: A route cannot use its text.
    """
    routes = {name: load(GROUP, name, Route) for name in wanted}
    for name, text in wanted.items():
        try:
            routes[name].check(text)
        except Exception as error:
            raise _blamed(name, error) from error
    return routes


@contextlib.asynccontextmanager
async def opened(
    routes: Mapping[str, Route], wanted: Mapping[str, str], serving: Serving
) -> AsyncGenerator[list[str]]:
    """Open all routes, and end them when the context ends; yields their lines for the log.

    Each route is opened and ended in a task of its own, so that an error in one route ends neither
    the server nor another route.

    Raises:
        CohapticError: A route cannot be opened.
    """
    end = asyncio.Event()
    tasks: dict[str, asyncio.Task[None]] = {}
    lines: list[str] = []
    try:
        for name, route in routes.items():
            line: asyncio.Future[str] = asyncio.get_running_loop().create_future()
            try:
                context = route.open(serving, wanted[name])
            except Exception as error:
                raise _blamed(name, error) from error
            tasks[name] = asyncio.ensure_future(_keep_open(name, context, line, end))
            try:
                async with asyncio.timeout(OPENING):
                    lines.append(await line)
            except TimeoutError as error:
                limit = f"opened within {OPENING:g} s"
                raise SettingError("route", name, limit) from error
        yield [line for line in lines if line]
    finally:
        end.set()
        await _have_ended(tasks)


async def _keep_open(
    name: str,
    route: AbstractAsyncContextManager[str],
    line: asyncio.Future[str],
    end: asyncio.Event,
) -> None:
    """Open a route, set the result of `line`, and end the route when the event `end` is set.

    An error before the result is set becomes the exception of `line`; a later one is logged.
    """
    try:
        async with route as said:
            if not line.done():
                line.set_result(said)
            await end.wait()
    except Exception as error:
        if not line.done():
            line.set_exception(_blamed(name, error))
        else:
            log.error("the route %s has failed: %r", name, error, exc_info=error)


async def _have_ended(tasks: Mapping[str, asyncio.Task[None]]) -> None:
    """Wait up to `ENDING` for the routes to end, cancel the others, and wait as long again."""
    for _ in range(2):
        pending = {name: task for name, task in tasks.items() if not task.done()}
        if not pending:
            return
        await asyncio.wait(pending.values(), timeout=ENDING)
        for name, task in pending.items():
            if not task.done():
                log.warning("the route %s has not ended within %g s", name, ENDING)
                task.cancel()


def _blamed(name: str, error: Exception) -> Exception:
    """Return the error of a route; an unexpected one becomes an error that names its package."""
    if isinstance(error, CohapticError) or adder(GROUP, name) == OURS:
        return error
    why = f"{type(error).__name__}: {error}"
    return ExtensionError(GROUP, name, adder(GROUP, name), why)
