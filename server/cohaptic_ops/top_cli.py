"""Command `cohaptic top`, which shows a server with its rooms and users in a terminal."""

from __future__ import annotations

import contextlib
from collections import deque
from typing import TYPE_CHECKING, Annotated
from urllib.parse import urlsplit

import typer

from cohaptic.errors import ServerLost, SettingError, one_line

if TYPE_CHECKING:
    from cohaptic_ops.monitoring.overview import Status

TIMEOUT = 5.0  # s for an answer, which normally comes within 0.1 s
LARGEST = 16 * 2**20  # bytes of an answer; 200 rooms of 64 users have 3 MB
WINDOW = 10  # number of readings over which ticks are counted


def top(
    url: Annotated[
        str, typer.Argument(help="Of the admin port of `cohaptic serve --admin PORT`.")
    ] = "http://127.0.0.1:9100",
    once: Annotated[bool, typer.Option("--once", help="Print one table and end.")] = False,
    every: Annotated[
        float, typer.Option(min=0.2, max=60.0, help="Seconds between two readings.")
    ] = 1.0,
) -> None:
    """Watch the rooms, users and ticks of a server, live."""
    address = status_address(url)
    import threading

    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    from cohaptic_ops.monitoring.overview import overview

    console = Console()
    if once:
        console.print(overview(read_status(address), None, console.width))
        return
    read_status(address)  # a server that does not answer at the beginning is an error
    stop = threading.Event()
    past: deque[Status] = deque(maxlen=WINDOW)
    with (
        contextlib.suppress(KeyboardInterrupt),
        Live(console=console, screen=console.is_terminal, auto_refresh=False) as live,
    ):
        while True:
            try:
                status = read_status(address)
                live.update(
                    overview(status, past[0] if past else None, console.width), refresh=True
                )
                past.append(status)
            except ServerLost as error:
                past.clear()
                live.update(Text(f"{error}; trying again", "red"), refresh=True)
            stop.wait(every)


def status_address(url: str) -> str:
    """Return the URL of a server's status, from the address of its admin port.

    Args:
        url: `http://HOST:PORT`, `HOST:PORT`, or only a port of this machine.

    Raises:
        SettingError: The text is not such an address.
    """
    whole = f"127.0.0.1:{url}" if url.isdigit() else url
    whole = whole if "://" in whole else f"http://{whole}"
    try:
        parts = urlsplit(whole)
        good = parts.scheme in ("http", "https") and parts.hostname and parts.port is not None
    except ValueError:
        good = False
    if not good or any(not c.isprintable() or c.isspace() for c in whole):
        limit = "the address of an admin port: http://127.0.0.1:9100"
        raise SettingError("url", one_line(repr(url), 80), limit)
    return f"{whole.partition('?')[0].rstrip('/')}/status"


def read_status(address: str) -> Status:
    """Request the status of a server once from its admin port, and return it.

    Args:
        address: URL from `status_address`.

    Raises:
        ServerLost: Nothing answers, or the answer is not from a server's admin port.
    """
    import http.client
    import urllib.error
    import urllib.request

    from pydantic import ValidationError

    from cohaptic_ops.monitoring.overview import Status

    place = address.removesuffix("/status")
    try:
        # Bypasses proxies of the environment, since the port is on this machine or a tunnel's end.
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(address, timeout=TIMEOUT) as answer:
            return Status.model_validate_json(answer.read(LARGEST))
    except (ValidationError, urllib.error.HTTPError) as error:
        sentence = f" ({error.code})" if isinstance(error, urllib.error.HTTPError) else ""
        why = f"not the admin port of a cohaptic server{sentence}; see cohaptic serve --admin"
        raise ServerLost(place, why) from error
    except (OSError, http.client.HTTPException) as error:
        why = "no admin port answers; start one with: cohaptic serve --admin 9100"
        raise ServerLost(place, why) from error
