"""Command `cohaptic replay`: shows a recorded session in a browser."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cohaptic.cli.session_words import chosen_session
from cohaptic.errors import SettingError
from cohaptic_server.cli.access_options import Exposure
from cohaptic_server.logs import LogStyle, set_up_log

if TYPE_CHECKING:
    from cohaptic.sessions.replay import Replay
    from cohaptic_server.shell.session_web import SessionWeb


# Above 60 lines: every option of the command is a parameter.
def replay(
    file: Annotated[
        Path,
        typer.Argument(
            help="A session, as `cohaptic serve --record` writes it, or a folder with one."
        ),
    ],
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="TCP port; 0 takes any free one.")] = 0,
    open_to_all: Annotated[
        bool,
        typer.Option(
            "--open",
            help="With --host of other machines: let anybody who reaches it see the session, its"
            " names and forces, without encryption.",
        ),
    ] = False,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Do not open the page, only say where it is.")
    ] = False,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Show nothing, but compute every patch again from what the room heard, and compare"
            " them. The exit status is 1 if they differ.",
        ),
    ] = False,
    body_file: Annotated[
        Path | None,
        typer.Option(
            "--body", help="With --verify: the file of the object, if it is one of your own."
        ),
    ] = None,
    lifeline: Annotated[bool, typer.Option("--lifeline", hidden=True)] = False,
) -> None:
    """Look at a recorded session in a browser.

    The page shows object, hands and forces at any moment, with joins, marks and events on its time
    line, and says why a force was as it was. Nothing is simulated, and nobody can touch.
    """
    set_up_log(LogStyle(logging.INFO))
    if body_file is not None and not verify:
        raise SettingError("--body", body_file, "given with --verify")
    file = chosen_session(file)
    if verify:
        from cohaptic_tools.verifying import in_words as of_verdict
        from cohaptic_tools.verifying import verify_file

        verdict = verify_file(file, body_file)
        typer.echo(of_verdict(verdict))
        raise typer.Exit(0 if verdict.holds else 1)
    if not (open_to_all or Exposure(host).is_local):
        limit = "127.0.0.1, for this machine alone, or given with --open, for anybody to see it all"
        raise SettingError("--host", host or "every address", limit)
    import asyncio

    from cohaptic.clock import SystemClock
    from cohaptic.runtime.interrupt import until_interrupted
    from cohaptic.sessions.replay import Replay as Opened
    from cohaptic_server.objects.recorded_body import recorded_body
    from cohaptic_server.settings import ServerSettings
    from cohaptic_server.shell.limiter import ConnectionLimiter
    from cohaptic_server.shell.session_web import SessionWeb

    found = Opened.of(file)
    body, unshown = None, ""
    if not found.surfaces:
        body, unshown = recorded_body(found.info.settings, found.watching.body, found.mesh)
    settings = ServerSettings(host, port)
    limiter = ConnectionLimiter(settings.limits, SystemClock())
    web = SessionWeb(found, body, unshown, settings, limiter)
    logging.info("%s", in_words(found))
    if unshown:
        logging.warning("%s", unshown)
    asyncio.run(until_interrupted(_serve(web, browser=not no_browser), lifeline=lifeline))


def in_words(found: Replay) -> str:
    """Return what a session holds, in a sentence."""
    people = len(found.users)
    words = (
        f"{found.path.name}: {found.last - found.first:.1f} s of"
        f" {people} {'person' if people == 1 else 'people'},"
        f" {len(found.moments) + found.further} joins, leaves, marks and events"
    )
    return words if found.complete else f"{words}; its recording was cut short"


async def _serve(web: SessionWeb, *, browser: bool) -> None:
    """Serve the session until cancelled."""
    import asyncio

    from cohaptic_server.http.session_routes import MARKED
    from cohaptic_server.shell.listener import page_address
    from cohaptic_tools.browser import open_page

    listener, url = await web.listen()
    try:
        address = f"{page_address(url)}{MARKED}"
        print(f"page {address}", flush=True)  # for scripts that start a replay and wait for it
        if browser:
            await asyncio.to_thread(open_page, address)
        await asyncio.Event().wait()
    finally:
        web.close()
        listener.close()
        await listener.wait_closed()
