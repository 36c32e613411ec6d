"""`cohaptic serve`."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
from threadpoolctl import threadpool_limits

from cohaptic.compiled import describe, is_complete, use
from cohaptic.errors import SettingError
from cohaptic.runtime.interrupt import until_interrupted
from cohaptic.runtime.scheduling import SERVER_PRIORITY, prefer_this_process
from cohaptic_server.bodies.body import Body
from cohaptic_server.cli.access_options import AccessOptions, in_words_of, takes_access
from cohaptic_server.cli.object_options import ObjectOptions, takes_object
from cohaptic_server.cli.progress_bar import progress_bar
from cohaptic_server.cli.resolved_object import SimulationHz, Users, resolved, wanted
from cohaptic_server.cli.rooms import serve_rooms
from cohaptic_server.cli.told_pages import tell_pages
from cohaptic_server.credentials.reloading import reload_changed
from cohaptic_server.guard.limits import Limits
from cohaptic_server.http.reachable import addresses_for_others, hosts_for_others
from cohaptic_server.monitoring.admin_port import AdminAddress, AdminPort, admin_address
from cohaptic_server.monitoring.logs import LogFormat, LogStyle, set_up_log
from cohaptic_server.monitoring.reporting import run_reported
from cohaptic_server.objects.catalogue import BODIES, build_body, is_file
from cohaptic_server.objects.prepare import KINDS
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.doors.own_addresses import machine_addresses
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.protection import Protection
from cohaptic_server.shell.server import CohapticServer
from cohaptic_server.shell.uploads.upload_desk import take_uploads
from cohaptic_server.upload.limits import UploadLimits, in_words

SWITCH_INTERVAL = 5e-4  # s after which a thread of Python yields to a waiting one

BodyName = Annotated[
    str,
    typer.Option(help=f"What is touched: {', '.join(BODIES)}, or a mesh file: {' '.join(KINDS)}."),
]
Nonlinear = Annotated[
    bool,
    typer.Option(
        "--nonlinear", help="Large deformation: the balloon or a file, on a coarser mesh."
    ),
]
Relaxation = Annotated[
    float, typer.Option(help="Relaxation time of a viscous body in seconds; 0 is elastic.")
]
AllowFixedGains = Annotated[
    bool,
    typer.Option(
        "--allow-fixed-gains",
        help="Let clients choose their own gains, unstable ones too: experiments only.",
    ),
]
AllowLatency = Annotated[
    bool,
    typer.Option("--allow-latency", help="Let pages inject latency between users and the server."),
]
AllowOrigin = Annotated[
    list[str] | None,
    typer.Option(help="Of a page from elsewhere that may connect: https://lab.example."),
]
AllowHost = Annotated[
    list[str] | None,
    typer.Option(help="Another name of this server that browsers may use: lab.example."),
]
AllowFrame = Annotated[
    list[str] | None,
    typer.Option(help="Of a page that may show this one in a frame: https://lab.example."),
]
WatchersPoint = Annotated[
    bool,
    typer.Option(
        "--watchers-point/--no-watchers-point",
        help="Whether who only watches may point at the surface, too.",
    ),
]
Limit = Annotated[
    list[str] | None,
    typer.Option(
        help="Change how much a connection or an address may ask for: open=500, joins=5:100 for"
        " 5 a second and 100 at once. All: docs/protocol.md."
    ),
]
Admin = Annotated[
    str | None,
    typer.Option(
        metavar="PORT",
        help="Metrics, health and what `cohaptic top` shows, on this port of 127.0.0.1; or"
        " ADDRESS:PORT, for whoever reaches it.",
    ),
]
LogForm = Annotated[
    LogFormat, typer.Option(help="Lines for people, or for machines one JSON object each.")
]
Config = Annotated[
    Path | None,
    typer.Option(
        help="Serve the rooms of this TOML file, each in a process of its own, in place of one;"
        " no other option goes with it but --quiet"
        " and --log-format."
    ),
]
AllowUpload = Annotated[
    bool,
    typer.Option(
        "--allow-upload",
        help="Let a page of this machine bring a mesh, which becomes everybody's object.",
    ),
]


# Above 60 lines: every option of the command is a parameter.
@takes_access
@takes_object
def serve(
    context: typer.Context,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="TCP port; 0 takes any free one.")] = 8765,
    simulation_hz: SimulationHz = 60.0,
    body: BodyName = "balloon",
    *,
    options: ObjectOptions,
    access: AccessOptions,
    nonlinear: Nonlinear = False,
    relaxation: Relaxation = 0.0,
    max_users: Annotated[int, typer.Option(help="Who may touch at once.")] = 16,
    users: Users = None,
    allow_fixed_gains: AllowFixedGains = False,
    allow_latency: AllowLatency = False,
    max_watchers: Annotated[int, typer.Option(help="Who may watch at once.")] = 100,
    max_waiting: Annotated[int, typer.Option(help="Who may wait for a place; 0: nobody.")] = 16,
    allow_origin: AllowOrigin = None,
    allow_host: AllowHost = None,
    allow_upload: AllowUpload = False,
    allow_frame: AllowFrame = None,
    watchers_point: WatchersPoint = True,
    limit: Limit = None,
    admin: Admin = None,
    config: Config = None,
    log_format: LogForm = LogFormat.TEXT,
    quiet: Annotated[bool, typer.Option("--quiet", help="Log warnings only.")] = False,
    lifeline: Annotated[bool, typer.Option("--lifeline", hidden=True)] = False,
) -> None:
    """Own a soft object that everybody can touch; ends with Ctrl-C.

    On 127.0.0.1 anybody of this machine may touch. On another address it asks for a decision: who
    comes in (--keys or --open), and how it is secured (--tls-cert and --tls-key, or --insecure).
    """
    style = LogStyle(logging.WARNING if quiet else logging.INFO, log_format)
    set_up_log(style)
    if config is not None:
        serve_rooms(context, config, style, lifeline=lifeline)
        return
    settings = ServerSettings(
        host, port, simulation_hz, body, max_users, allow_fixed_gains, allow_latency, max_watchers,
        tuple(allow_origin or ()), allow_upload, tuple(allow_host or ()),
        Limits().changed(limit or ()), max_waiting=max_waiting,
        allow_frames=tuple(allow_frame or ()), watchers_point=watchers_point,
    )  # fmt: skip
    protection = access.protection(host)
    demand = wanted(users, simulation_hz, nonlinear=nonlinear)
    if users is not None and users > max_users:
        raise SettingError("--users", users, f"at most --max-users, {max_users}")
    damping = relaxation * simulation_hz
    # Told at once, and not to the first who brings a file.
    if allow_upload and nonlinear and not use("kernels"):
        without = f"given without --nonlinear here: {describe('kernels')}"
        raise SettingError("--allow-upload", "given with --nonlinear", without)
    # A large object takes seconds; a terminal without a sign would look like a server that hangs.
    with progress_bar(f"preparing {body}") as progress:
        source = options.of(Path(body))
        if is_file(body):
            source = resolved(source.path, options, progress, logging.info, demand)
        touched = build_body(
            body,
            source,
            nonlinear=nonlinear,
            damping=damping,
            hz=simulation_hz,
            demand=demand,
            progress=progress,
            late=True,  # a process of its own solves with the factor
        )
    watched = None if admin is None else admin_address(admin, settings.allow_hosts)
    serving = _serve(touched, settings, protection, damping, watched, nonlinear=nonlinear)
    asyncio.run(until_interrupted(serving, lifeline=lifeline))


async def _serve(
    body: Body,
    settings: ServerSettings,
    protection: Protection,
    damping: float,
    watched: AdminAddress | None,
    *,
    nonlinear: bool,
) -> None:
    served = ServedBody(body)
    again: asyncio.Future[None] | None = None
    admin = None if watched is None else AdminPort(watched)
    try:
        # First: the process gets ready while this one does, and hands need not wait for it.
        served.start()
        server = CohapticServer(body, settings, served.solve, protection)
        if settings.allow_upload:
            take_uploads(server, served, damping, nonlinear=nonlinear)
        url = await server.start()
        if admin is not None:
            await admin.open()
        again = asyncio.ensure_future(reload_changed(protection.watched))
        await _run(server, url, settings, served.pump, admin)
    finally:
        if again is not None:
            again.cancel()
        if admin is not None:
            await admin.close()
        served.stop()


async def _run(
    server: CohapticServer,
    url: str,
    settings: ServerSettings,
    before_tick: Callable[[], None] | None,
    admin: AdminPort | None,
) -> None:
    """Say where the server is, tick until interrupted, then say how that went."""
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
    if settings.allow_upload:
        logging.info("%s", in_words(UploadLimits()))
    if admin is not None:
        logging.info("admin port %s; see it with: cohaptic top %s", admin.url, admin.url)
    for line in in_words_of(server.protection, settings.host):
        logging.warning("%s", line)
    # So soon the thread that solves for columns yields to the tick; the default is 5 ms.
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        # A tick's products are small. Spread over threads they wait for the slowest, and beside
        # real-time haptic loops on the same cores that can be long (docs/decisions/0006).
        prefer_this_process(SERVER_PRIORITY)
        with threadpool_limits(limits=1):
            await run_reported(server, before_tick, admin)
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
        if server.audience.came:
            logging.info(
                "%d watched, %d times one was slow; they took %.2f ms a tick in the median",
                server.audience.came,
                server.audience.slow,
                1e3 * meters.watch_cost.quantile(0.5),
            )
