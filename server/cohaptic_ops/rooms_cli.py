"""Command `cohaptic serve --config FILE`, which serves the rooms of a configuration file."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import sys
import tempfile
import threading
from collections.abc import Generator
from functools import partial
from pathlib import Path

import typer

from cohaptic.errors import CohapticError, SettingError
from cohaptic.runtime.interrupt import on_hangup
from cohaptic_ops.rooms.config import (
    ObjectTable,
    RoomsConfig,
    RoomTable,
    is_plain_balloon,
    load_config,
)
from cohaptic_ops.rooms.config_errors import ConfigError
from cohaptic_ops.rooms.rooms_server import RoomsServer
from cohaptic_ops.rooms.tables import AccessTable
from cohaptic_server.bodies.body import Body
from cohaptic_server.cli.access_options import AccessOptions, in_words_of
from cohaptic_server.cli.object_options import ObjectOptions
from cohaptic_server.cli.resolved_object import resolved, wanted
from cohaptic_server.cli.told_pages import tell_pages
from cohaptic_server.http.reachable import addresses_for_others, hosts_for_others
from cohaptic_server.logs import LogStyle
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.objects.store import shared
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.limiter import Protection
from cohaptic_server.shell.own_addresses import machine_addresses
from cohaptic_server.touchable import is_file, names

_WITH_CONFIG = ("config", "cluster", "quiet", "log_format", "lifeline")
# Environment variable that makes `cohaptic serve` with one room ask everybody for a token. If it
# were ignored here, rooms would be open although their owner believes that they are not.
_KEYS = "COHAPTIC_KEYS"
_ENDED_AT_ONCE = 130  # exit status of a command that Ctrl-C has ended


def serve_rooms(
    context: typer.Context, path: Path, style: LogStyle, cluster: str, *, lifeline: bool
) -> None:
    """Serve the rooms of a configuration file until the process is interrupted.

    Args:
        context: Context of the command, with the options that the user has written.
        path: Path of the configuration file.
        style: Style of the log.
        cluster: Address of the engine of a cluster, HOST:PORT; empty for a single machine.
        lifeline: Whether the server also ends when standard input closes.

    Raises:
        CohapticError: The configuration is wrong, the port is not available, or no room opens.
    """
    _refuse_other_options(context)
    config = load_config(path)
    _check_objects(path, config)
    shared.check()
    _check_access(path, config)
    if cluster and not config.cluster.witnesses:
        missing = "cluster.witnesses is missing, the addresses of the machines that grant rooms"
        raise ConfigError(path, [f'{missing}: witnesses = ["10.0.0.1"], and better three of them'])
    config = config.model_copy(
        update={"cluster": config.cluster.model_copy(update={"engine": cluster})}
    )
    with _state_folder(config.access) as access:
        config = config.model_copy(update={"access": access})
        asyncio.run(_serve(config, style, lifeline=lifeline))


@contextlib.contextmanager
def _state_folder(access: AccessTable) -> Generator[AccessTable]:
    """Yield the access table with a state folder; a temporary one if the table has none."""
    if access.state is not None:
        yield access
        return
    # After a second Ctrl-C, which ends the server at once, the folder with a few bytes for each
    # room stays.
    with tempfile.TemporaryDirectory(prefix="cohaptic-state-", ignore_cleanup_errors=True) as name:
        yield access.model_copy(update={"state": Path(name)})


def _refuse_other_options(context: typer.Context) -> None:
    for parameter in context.command.params:
        name = parameter.name or ""
        source = context.get_parameter_source(name)
        if name not in _WITH_CONFIG and source is not None and source.name == "COMMANDLINE":
            limit = "left out beside --config: its file says it, or the environment"
            raise SettingError(f"--{name.replace('_', '-')}", "given", limit)


def build_room(table: RoomTable, settings: ServerSettings) -> Body:
    """Return the body of a room; called in the process of the room.

    Args:
        table: Table of the room in the configuration.
        settings: Settings of the room's server, made from the table.

    Raises:
        CohapticError: The body cannot be made.
    """
    prebuilt = sys.modules.get("cohaptic_ops.rooms.process.prebuilt")
    if is_plain_balloon(table) and prebuilt is not None:
        made: Body = prebuilt.BALLOON
        return made
    options = object_options(table.object)
    demand = wanted(table.users, table.rate, nonlinear=table.nonlinear)
    source = options.of(Path(table.body))
    if is_file(table.body):
        source = resolved(source.path, options, lambda phase, fraction: None, logging.info, demand)
    return build_body(
        table.body,
        source,
        nonlinear=table.nonlinear,
        damping=table.relaxation * settings.simulation_hz,
        hz=settings.simulation_hz,
        demand=demand,
        late=True,  # a separate process solves with the factor
    )


def object_options(table: ObjectTable) -> ObjectOptions:
    """Return the options of an object that a table of the configuration describes."""
    return ObjectOptions.read(**dict(table))


def protect(table: AccessTable, host: str) -> Protection:
    """Return the access control of a room, as the configuration describes it.

    Args:
        table: Access table of the configuration.
        host: Host name or address that the server listens on.

    Raises:
        SettingError: The owner has not decided whether strangers may come in, or a key file cannot
            be used.
    """
    options = AccessOptions(
        keys=table.keys,
        insecure_key_file=table.insecure_key_file,
        open=table.open,
        single_use=table.single_use,
        session_valid=table.session_valid,
        insecure=table.insecure,
        trust_proxy=list(table.trust_proxy),
        state=table.state,
    )
    return options.protection(host)


def _check_access(path: Path, config: RoomsConfig) -> None:
    """Check the access table before any process is started.

    Raises:
        ConfigError: The table is invalid; the error says how to correct it.
    """
    if os.environ.get(_KEYS) and config.access.keys is None and not config.access.open:
        missing = f"access.keys is missing while the environment variable {_KEYS} is set, which is"
        sentence = (
            f"{missing} not for --config; write keys = FILE, or open = true to let in anybody"
        )
        raise ConfigError(path, [sentence])
    try:
        protect(config.access, config.host)
    except SettingError as error:
        keys = f"here they are keys of [access]: {' '.join(AccessTable.model_fields)}"
        raise ConfigError(path, [f"{error}; {keys}; TLS is a proxy's"]) from error


def _check_objects(path: Path, config: RoomsConfig) -> None:
    """Check the objects of all rooms before any process is started.

    Raises:
        ConfigError: Some settings are invalid; the error names their keys in the file.
    """
    problems: list[str] = []
    for name, table in config.rooms.items():
        key = f"rooms.{name}"
        if not is_file(table.body) and table.body not in names():
            known = ", ".join(names())
            problems.append(f"{key}.body is {table.body!r}; it must be one of: {known}, or a file")
        if table.users is not None and table.users > table.max_users:
            problems.append(f"{key}.users is {table.users}; it must be at most {key}.max_users")
        try:
            object_options(table.object).of(Path(table.body))
            demand = wanted(table.users, table.rate, nonlinear=table.nonlinear)
            if demand is not None:
                demand.check()
        except SettingError as error:
            option = error.name.removeprefix("--").replace("-", "_")
            inner = f"object.{option}" if option in ObjectTable.model_fields else option
            problems.append(f"{key}.{inner} is {error.value}; it must be {error.limit}")
    if problems:
        raise ConfigError(path, problems)


async def _serve(config: RoomsConfig, style: LogStyle, *, lifeline: bool) -> None:
    builds = {name: partial(build_room, table) for name, table in config.rooms.items()}
    rooms_server = RoomsServer(config, builds, style, partial(protect, config.access, config.host))
    stop = asyncio.Event()
    _on_signals(rooms_server, stop, lifeline=lifeline)
    try:
        starting = asyncio.ensure_future(_start(rooms_server, config))
        stopped = asyncio.ensure_future(stop.wait())
        await asyncio.wait({starting, stopped}, return_when=asyncio.FIRST_COMPLETED)
        if starting.done():
            starting.result()
            running = asyncio.ensure_future(rooms_server.run())
            await asyncio.wait({running, stopped}, return_when=asyncio.FIRST_COMPLETED)
            if running.done():
                running.result()
    finally:
        await rooms_server.drain()


async def _start(rooms_server: RoomsServer, config: RoomsConfig) -> None:
    """Open the rooms, and print their addresses."""
    url = await rooms_server.start()
    broken = {
        name: k.problem for name, k in rooms_server.supervisors.items() if k.state == "broken"
    }
    for name, problem in broken.items():
        logging.error("room %s cannot be opened: %s", name, problem)
    if broken and len(broken) == len(config.rooms):
        listed = "; ".join(f"rooms.{name}: {problem}" for name, problem in broken.items())
        raise CohapticError(f"no room can be opened: {listed}")
    # The first line is for scripts that start a server and wait for its address.
    print(f"listening {url}", flush=True)
    logging.info("%d rooms: %s", len(config.rooms), " ".join(config.rooms))
    hosts = hosts_for_others(config.host, config.allow_hosts, machine_addresses())
    tell_pages(url, addresses_for_others(url, hosts))
    if rooms_server.admin is not None:
        admin = rooms_server.admin.url
        logging.info("admin port %s; see it with: cohaptic top %s", admin, admin)
    for line in in_words_of(protect(config.access, config.host), config.host):
        logging.warning("%s", line)


def _on_signals(rooms_server: RoomsServer, stop: asyncio.Event, *, lifeline: bool) -> None:
    """Handle signals: the first Ctrl-C or SIGTERM makes the rooms end, the second kills them.

    SIGHUP makes the rooms read their keys again, as on a server with one room; after the terminal
    has closed, SIGHUP acts as SIGTERM. Without a handler SIGHUP would end this process at once,
    without a message to the clients.
    """
    loop = asyncio.get_running_loop()
    asked = False

    def interrupted(*_: object) -> None:
        nonlocal asked
        if asked:
            rooms_server.kill()
            os._exit(_ENDED_AT_ONCE)
        asked = True
        loop.call_soon_threadsafe(stop.set)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupted)
    if sys.platform != "win32":
        loop.add_signal_handler(signal.SIGHUP, on_hangup(rooms_server.read_again))

    def watch() -> None:
        while os.read(sys.stdin.fileno(), 4096):
            pass
        with contextlib.suppress(RuntimeError):  # the event loop has ended already
            loop.call_soon_threadsafe(stop.set)

    if lifeline:
        threading.Thread(target=watch, daemon=True).start()
