"""Command `cohaptic serve`, which serves one object or the rooms of a file."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated

import typer

from cohaptic.compiled import describe, is_complete
from cohaptic.errors import SettingError
from cohaptic.room_address import base_path as read_base_path
from cohaptic_server.cli.access_options import AccessOptions, takes_access
from cohaptic_server.cli.object_options import ObjectOptions, SimulationHz, Users, takes_object
from cohaptic_server.guard.limits import Limits
from cohaptic_server.logs import LogFormat, LogStyle, set_up_log
from cohaptic_server.settings import ServerSettings
from cohaptic_server.touchable import KINDS, names

# Chapters of the help, after the options that most people need.
_PEOPLE, _WEB, _LOG = "People in the room", "Browsers and proxies", "Log"
_RECORD = "Recordings"

BodyName = Annotated[
    str,
    typer.Option(help=f"The object: {', '.join(names())}, or a mesh file: {' '.join(KINDS)}."),
]
Nonlinear = Annotated[
    bool,
    typer.Option(
        "--nonlinear", help="Large deformation: the balloon or a file, on a coarser mesh."
    ),
]
Relaxation = Annotated[
    float, typer.Option(help="Relaxation time of a viscous object [s]; 0 is elastic.")
]
AllowFixedGains = Annotated[
    bool,
    typer.Option(
        "--allow-fixed-gains",
        help="Let clients choose their own gains, unstable ones too: experiments only.",
        rich_help_panel=_PEOPLE,
    ),
]
AllowLatency = Annotated[
    bool,
    typer.Option(
        "--allow-latency",
        help="Let pages delay any user's connection: experiments only.",
        rich_help_panel=_PEOPLE,
    ),
]
AllowOrigin = Annotated[
    list[str] | None,
    typer.Option(
        help="Origin of another server's page that may connect: https://lab.example.",
        rich_help_panel=_WEB,
    ),
]
AllowHost = Annotated[
    list[str] | None,
    typer.Option(
        help="Further name of this server that browsers may use: lab.example.",
        rich_help_panel=_WEB,
    ),
]
AllowFrame = Annotated[
    list[str] | None,
    typer.Option(
        help="Origin of pages that may show this one in a frame: https://lab.example.",
        rich_help_panel=_WEB,
    ),
]
BasePath = Annotated[
    str,
    typer.Option(
        metavar="PATH",
        help="Path of a proxy below which page, streams and rooms are: /haptics.",
        rich_help_panel=_WEB,
    ),
]
WatchersPoint = Annotated[
    bool,
    typer.Option(
        "--watchers-point/--no-watchers-point",
        help="Whether people who only watch may point at the surface.",
        rich_help_panel=_PEOPLE,
    ),
]
Limit = Annotated[
    list[str] | None,
    typer.Option(
        help="Change how much a connection or an address may ask for: open=500, joins=5:100 for"
        " 5 a second and 100 at once. All limits: docs/protocol.md.",
        rich_help_panel=_PEOPLE,
    ),
]
Admin = Annotated[
    str | None,
    typer.Option(
        metavar="PORT",
        help="Serve metrics and health on this port of 127.0.0.1, or on ADDRESS:PORT; see them"
        " with `cohaptic top`.",
    ),
]
RecordTo = Annotated[
    str | None,
    typer.Option(
        metavar="FILE.mcap",
        help="Record the session to this file, or in a folder to one with the time in its name."
        " Everybody in the room is told.",
        rich_help_panel=_RECORD,
    ),
]
RecordingsIn = Annotated[
    str | None,
    typer.Option(
        metavar="FOLDER",
        help="Let an administrator of the room begin and end recordings, in this folder.",
        rich_help_panel=_RECORD,
    ),
]
LogForm = Annotated[
    LogFormat,
    typer.Option(
        help="Lines for people, or for machines a JSON object each.", rich_help_panel=_LOG
    ),
]
Config = Annotated[
    Path | None,
    typer.Option(
        help="Serve the rooms of this TOML file, each in a process of its own. Of the other"
        " options only --cluster, --quiet and --log-format go with it."
    ),
]
Cluster = Annotated[
    str,
    typer.Option(
        metavar="HOST:PORT",
        help="With --config: share the rooms with other machines through the engine (Ray) at this"
        " address, which is one of theirs. Needs the extra cluster.",
    ),
]
Routes = Annotated[
    list[str] | None,
    typer.Option(
        "--route",
        metavar="NAME[=TEXT]",
        help="Offer a route that an installed package adds.",
        rich_help_panel=_WEB,
    ),
]
AllowUpload = Annotated[
    bool,
    typer.Option(
        "--allow-upload",
        help="Let a page of this machine bring a mesh file, which becomes everybody's object.",
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
    max_users: Annotated[int, typer.Option(help="How many may touch at once.")] = 16,
    users: Users = None,
    allow_fixed_gains: AllowFixedGains = False,
    allow_latency: AllowLatency = False,
    max_watchers: Annotated[
        int, typer.Option(help="How many may watch at once.", rich_help_panel=_PEOPLE)
    ] = 100,
    max_waiting: Annotated[
        int,
        typer.Option(help="How many may wait for a place in a full room.", rich_help_panel=_PEOPLE),
    ] = 16,
    allow_origin: AllowOrigin = None,
    allow_host: AllowHost = None,
    allow_upload: AllowUpload = False,
    allow_frame: AllowFrame = None,
    base_path: BasePath = "",
    watchers_point: WatchersPoint = True,
    limit: Limit = None,
    admin: Admin = None,
    route: Routes = None,
    record: RecordTo = None,
    recordings: RecordingsIn = None,
    config: Config = None,
    cluster: Cluster = "",
    log_format: LogForm = LogFormat.TEXT,
    quiet: Annotated[
        bool, typer.Option("--quiet", help="Log warnings only.", rich_help_panel=_LOG)
    ] = False,
    lifeline: Annotated[bool, typer.Option("--lifeline", hidden=True)] = False,
) -> None:
    """Serve a soft object that everybody can touch.

    On 127.0.0.1 anybody of this machine may touch. On another address it asks for a decision: who
    comes in (--keys or --open), and how it is secured (--tls-cert and --tls-key, or --insecure).
    """
    style = LogStyle(logging.WARNING if quiet else logging.INFO, log_format)
    set_up_log(style)
    if config is not None:
        from cohaptic_ops.rooms_cli import serve_rooms  # only this command uses both packages

        serve_rooms(context, config, style, cluster, lifeline=lifeline)
        return
    if cluster:
        raise SettingError("--cluster", cluster, "given with --config FILE, which names the rooms")
    settings = ServerSettings(
        host, port, simulation_hz, body, max_users, allow_fixed_gains, allow_latency, max_watchers,
        tuple(allow_origin or ()), allow_upload, tuple(allow_host or ()),
        Limits().changed(limit or ()), max_waiting=max_waiting,
        allow_frames=tuple(allow_frame or ()), watchers_point=watchers_point,
        base_path=read_base_path(base_path), record=_place("--record", record),
        recordings=_place("--recordings", recordings),
    )  # fmt: skip
    protection = access.protection(host)
    if users is not None and users > max_users:
        raise SettingError("--users", users, f"at most --max-users, {max_users}")
    # Checked at the start, since the error would otherwise come when the first visitor brings a
    # file.
    if allow_upload and nonlinear and not is_complete("kernels"):
        without = f"given without --nonlinear here: {describe('kernels')}"
        raise SettingError("--allow-upload", "given with --nonlinear", without)
    from cohaptic_server.cli.serving import serve_object

    serve_object(
        settings, protection, options, users, relaxation, admin, route or [],
        nonlinear=nonlinear, lifeline=lifeline,
    )  # fmt: skip


def _place(option: str, path: str | None) -> str:
    """Return where recordings go, empty for nowhere; an empty path is a script's empty variable."""
    if path == "":
        raise SettingError(option, path, "the name of a file or of a folder")
    return path or ""
