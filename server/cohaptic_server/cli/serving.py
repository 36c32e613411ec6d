"""Serves one object, for `cohaptic serve`, until the process is interrupted."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from cohaptic.compiled import describe, is_complete
from cohaptic.runtime.interrupt import until_interrupted
from cohaptic.runtime.scheduling import SERVER_PRIORITY, prefer_this_process
from cohaptic_server.bodies.body import Body
from cohaptic_server.cli.access_options import in_words_of
from cohaptic_server.cli.object_options import ObjectOptions, made_from_options
from cohaptic_server.cli.told_pages import tell_pages
from cohaptic_server.credentials.reloading import reload_changed
from cohaptic_server.http.reachable import addresses_for_others, hosts_for_others
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.room.input_record import ColumnRecord
from cohaptic_server.routes import Route, Serving, loaded, opened, read_wanted
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.limiter import Protection
from cohaptic_server.shell.own_addresses import machine_addresses
from cohaptic_server.shell.server import CohapticServer
from cohaptic_server.touchable import is_file

SWITCH_INTERVAL = 5e-4  # s after which a Python thread yields to a waiting thread


def serve_object(
    settings: ServerSettings,
    protection: Protection,
    options: ObjectOptions,
    users: int | None,
    relaxation: float,
    admin: str | None,
    given: Sequence[str],
    *,
    nonlinear: bool,
    lifeline: bool,
) -> None:
    """Build the body that the settings name, and serve it until the process is interrupted.

    Args:
        protection: Access control and encryption.
        options: Options of an object from a file.
        users: Number of users for whom the mesh of a file is chosen; None if the option is missing.
        relaxation: Relaxation time of a viscous body [s].
        admin: Text of `--admin`, the port for metrics and health; None opens no such port.
        given: Texts of `--route`, one for each route of another package.
        nonlinear: Whether the body is nonlinear (finite deformation).
        lifeline: Whether the server also ends when standard input closes.

    Raises:
        CohapticError: An option does not fit the body, the object in the file cannot be touched, or
            a port is not available.
    """
    wanted = read_wanted(given)
    if settings.allow_upload:
        wanted["upload"] = ""
    if admin is not None:
        wanted["admin"] = admin
    routes = loaded(wanted)
    damping = relaxation * settings.simulation_hz
    touched = build_served(settings, options, users, damping, nonlinear=nonlinear)
    made_from = made_from_options(settings.body, options, users, relaxation, nonlinear=nonlinear)
    settings = replace(settings, made_from=made_from)
    serving = _serve(touched, settings, protection, damping, routes, wanted, nonlinear=nonlinear)
    asyncio.run(until_interrupted(serving, lifeline=lifeline))


def build_served(
    settings: ServerSettings,
    options: ObjectOptions,
    users: int | None,
    damping: float,
    *,
    nonlinear: bool,
) -> Body:
    """Build the body that the settings name; the arguments are those of `serve_object`.

    Args:
        damping: Relaxation time over simulation period.
    """
    name, hz = settings.body, settings.simulation_hz
    if not is_file(name) and users is None and options == ObjectOptions():
        return build_body(name, nonlinear=nonlinear, damping=damping, hz=hz)
    # These imports take long, and a body that is not a file starts without them.
    from cohaptic_server.cli.progress_bar import progress_bar
    from cohaptic_server.cli.resolved_object import resolved, wanted

    demand = wanted(users, hz, nonlinear=nonlinear)
    # A large object takes seconds; without a progress bar the server would seem to hang.
    with progress_bar(f"preparing {name}") as progress:
        source = options.of(Path(name))
        if is_file(name):
            source = resolved(source.path, options, progress, logging.info, demand)
        return build_body(
            name,
            source,
            nonlinear=nonlinear,
            damping=damping,
            hz=hz,
            demand=demand,
            progress=progress,
            late=True,  # a separate process solves with the factor
        )


async def _serve(
    body: Body,
    settings: ServerSettings,
    protection: Protection,
    damping: float,
    routes: Mapping[str, Route],
    wanted: Mapping[str, str],
    *,
    nonlinear: bool,
) -> None:
    served = ServedBody(body)
    async with contextlib.AsyncExitStack() as stack:
        # The solving process starts first, so that it gets ready while this process prepares the
        # server, and users need not wait.
        stack.callback(served.stop)
        served.start()
        server = CohapticServer(body, settings, served.solve, protection)
        serving = Serving(server, served, damping, nonlinear)
        url = await server.start()
        # A port in use is reported first; the address is printed once the routes are open.
        try:
            lines = await stack.enter_async_context(opened(routes, wanted, serving))
        except BaseException:
            await server.stop()
            raise
        again = asyncio.ensure_future(reload_changed(protection.watched))
        stack.callback(again.cancel)
        await _run(server, url, settings, served.pump, lines)


async def _run(
    server: CohapticServer,
    url: str,
    settings: ServerSettings,
    before_tick: Callable[[ColumnRecord | None], None] | None,
    lines: Sequence[str],
) -> None:
    """Print the address, run the ticks until interrupted, then log their statistics."""
    # The first line is for scripts that start a server and wait for its address.
    print(f"listening {url}", flush=True)
    hosts = hosts_for_others(settings.host, settings.allow_hosts, machine_addresses())
    others = addresses_for_others(url, hosts)
    logging.info(
        "%s at %g Hz; touch it with: cohaptic touch %s --name NAME",
        settings.body,
        settings.simulation_hz,
        others[0] if others else url,
    )
    tell_pages(url, others)
    if not is_complete("kernels"):
        logging.info("ticks take longer than they need: %s", describe("kernels"))
    for line in lines:
        logging.info("%s", line)
    for line in in_words_of(server.protection, settings.host):
        logging.warning("%s", line)
    # A thread that solves Green's functions for a page then yields to the tick after this interval;
    # the default is 5 ms.
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        # The matrix products of a tick are small. Several BLAS threads would wait for the slowest,
        # which beside real-time haptic loops on the same cores can be long (docs/design/loop.md).
        prefer_this_process(SERVER_PRIORITY)
        with threadpool_limits(limits=1):
            await server.run(before_tick)
    finally:
        meters = server.meters
        logging.info(
            "stopped after %d ticks, %d missed, %d of them left out; a tick took %.2f ms in the"
            " median, %.2f ms at the 99th percentile",
            meters.ticks,
            meters.missed,
            meters.left_out,
            1e3 * meters.cost.quantile(0.5),
            1e3 * meters.cost.quantile(0.99),
        )
        if server.scene_broadcast.came:
            logging.info(
                "%d watched, %d times one was slow; they took %.2f ms a tick in the median",
                server.scene_broadcast.came,
                server.scene_broadcast.slow,
                1e3 * meters.watch_cost.quantile(0.5),
            )
