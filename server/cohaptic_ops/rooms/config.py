"""Reads the configuration of a server with many rooms: a TOML file and environment variables."""

from __future__ import annotations

import logging
import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError, create_model
from pydantic_settings import (
    BaseSettings,
    EnvSettingsSource,
    InitSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    SettingsError,
)

from cohaptic.control.law import Law
from cohaptic.errors import SettingError
from cohaptic.room_address import BASES, NAMES, base_path, is_room_name
from cohaptic.written import at_home, text_of
from cohaptic_ops.rooms.config_errors import ConfigError, KeyProblem, problems_of
from cohaptic_ops.rooms.tables import AccessTable, AdminTable, ClusterTable, Table
from cohaptic_server.guard.limits import Limits
from cohaptic_server.objects.fix_mesh import FixMesh
from cohaptic_server.objects.object_file import OPTIONS
from cohaptic_server.settings import ServerSettings
from cohaptic_server.touchable import is_file

PREFIX = "COHAPTIC_SERVER_"  # of environment variables
DIVIDER = "__"
# Names, after PREFIX, of variables that Kubernetes and Docker set for a service that is called
# cohaptic-server. They also set PORT, which then contains an address.
_OF_A_SERVICE = re.compile(
    r"SERVICE_(HOST|PORT(_\w+)?)|PORT_\d+_(TCP|UDP|SCTP)(_(PROTO|PORT|ADDR))?"
)
_ADDRESS = re.compile(r"(tcp|udp|sctp)://\S*")
log = logging.getLogger("cohaptic.server")
MAX_ROOMS = 1000  # each open one is a process; the list of all has 200 kB


def _check_limits(limits: dict[str, str]) -> dict[str, str]:
    """Return the limits; raises KeyProblem for the first invalid one."""
    for name, value in limits.items():
        try:
            Limits().changed([f"{name}={value}"])
        except SettingError as error:
            raise KeyProblem(name, value, error.limit) from error
    return limits


def _named(name: str) -> str:
    if not is_room_name(name):
        raise ValueError(f"named with {NAMES}")
    return name


def _base(said: str) -> str:
    try:
        return base_path(said)
    except SettingError:
        raise ValueError(BASES) from None


def _check_record(folder: str) -> str:
    if folder.endswith(".mcap"):
        raise ValueError("a folder: each run of the room gets a file of its own in it")
    return folder


LimitTable = Annotated[dict[str, str], AfterValidator(_check_limits)]


if TYPE_CHECKING:  # the keys come from a table, which a type checker cannot read

    class ObjectTable(Table):
        """Options of an object from a file; the names and meanings are as in `cohaptic serve`.

        A modulus is a number, or a list with the moduli of parts: `["3e3", "tumour=60e3"]`.
        """

        auto: bool = False

else:
    ObjectTable = create_model(
        "ObjectTable",
        __base__=Table,
        __module__=__name__,
        **{option.name: (option.table_hint, option.absent) for option in OPTIONS},
        auto=(bool, False),
    )


class RoomTable(Table):
    """Configuration of one room.

    Args:
        body: Name in the catalogue, or path of a mesh file; a relative path starts at the folder of
            the configuration file.
        title: Title for people who choose a room; if it is empty they see the name.
        rate: Ticks per second.
        laws: Control laws that the room's users may choose.
        max_users: Number of users who may touch at once.
        max_watchers: Number of watchers at once.
        max_waiting: Places in the queue while the room is full; 0 for no queue.
        nonlinear: Whether the body is nonlinear (finite deformation).
        relaxation: Relaxation time of a viscous body [s]; 0 for an elastic body.
        users: Number of users for whom the mesh of a file is chosen; None as without --users.
        allow_fixed_gains: Whether clients may choose their own gains.
        allow_latency: Whether pages may inject latency.
        watchers_point: Whether watchers may point at the surface, too.
        object: Options of an object from a file.
        limits: Budgets of the room's connections, in addition to the budgets of the server.
        record: Folder in which each run of the room is recorded, from its beginning; relative as
            `body` is; empty for none.
        recordings: Folder in which the room's administrators can record; empty for none.
        start: Whether the room starts at once, with the server, or on demand, when somebody comes.
        end_after: Time that a room with start on demand stays open without anybody in it [s].
        cores: Processors that a node of a cluster keeps free for the room.
    """

    body: str = Field(min_length=1)
    title: str = Field(default="", max_length=80)
    rate: float = Field(default=60.0, ge=10.0, le=200.0)
    laws: tuple[Law, ...] = Field(default=tuple(Law), min_length=1)
    max_users: int = Field(default=16, ge=1, le=64)
    max_watchers: int = Field(default=100, ge=0, le=1000)
    max_waiting: int = Field(default=16, ge=0, le=64)
    nonlinear: bool = False
    relaxation: float = Field(default=0.0, ge=0.0, le=60.0)
    users: int | None = Field(default=None, ge=1, le=64)
    allow_fixed_gains: bool = False
    allow_latency: bool = False
    watchers_point: bool = True
    object: ObjectTable = ObjectTable()
    limits: LimitTable = Field(default_factory=dict)
    # A folder, since a room may run more than once, and no recording is overwritten.
    record: Annotated[str, AfterValidator(_check_record)] = ""
    recordings: str = ""
    start: Literal["at once", "on demand"] = "at once"
    # Long enough for a user who closes the page for a short break: names, places and sessions exist
    # only in the process.
    end_after: float = Field(default=600.0, ge=10.0, le=604_800.0)
    # A balloon with six users takes a fifth of a core (docs/results.md).
    cores: float = Field(default=0.25, ge=0.01, le=64.0)

    @property
    def idle(self) -> float | None:
        """Time that the room may be empty before it ends [s]; None if it does not end so."""
        return self.end_after if self.start == "on demand" else None


class RoomsConfig(BaseSettings):
    """Configuration of a server with many rooms.

    Args:
        host: Address to listen on.
        port: TCP port; 0 takes any free one.
        max_users: Number of users who may touch at once, in all rooms together.
        max_watchers: Number of watchers at once, in all rooms together.
        drain: Time for the rooms to end when the server stops [s].
        lease: Time without a report after which a room is ended and started again [s].
        allow_hosts: Further names of the server.
        allow_origins: Further origins whose pages may connect.
        allow_frames: Origins whose pages may show the rooms' pages in a frame.
        base_path: Path below which a proxy offers the server.
        limits: Budgets for the connections of all rooms together.
        access: Access control of all rooms.
        admin: Address of the admin port, with metrics and health.
        cluster: Machines of a cluster, for `--cluster`.
        rooms: Tables of the rooms, by name.
    """

    model_config = SettingsConfigDict(
        env_prefix=PREFIX, env_nested_delimiter=DIVIDER, extra="forbid", frozen=True,
        coerce_numbers_to_str=True,
    )  # fmt: skip

    host: str = Field(default="127.0.0.1", min_length=1)
    port: int = Field(default=8765, ge=0, le=65535)
    max_users: int = Field(default=256, ge=1, le=10_000)
    max_watchers: int = Field(default=1000, ge=0, le=10_000)
    drain: float = Field(default=5.0, ge=0.5, le=300.0)
    # A loaded machine may delay a process for a second or two, so that a lease must be longer. The
    # clients of a hanging room release their users' hands after 0.1 s already.
    lease: float = Field(default=10.0, ge=2.0, le=3600.0)
    allow_hosts: tuple[str, ...] = ()
    allow_origins: tuple[str, ...] = ()
    allow_frames: tuple[str, ...] = ()
    base_path: Annotated[str, AfterValidator(_base)] = ""
    limits: LimitTable = Field(default_factory=dict)
    access: AccessTable = AccessTable()
    admin: AdminTable = AdminTable()
    cluster: ClusterTable = ClusterTable()
    rooms: dict[Annotated[str, AfterValidator(_named)], RoomTable] = Field(
        min_length=1, max_length=MAX_ROOMS
    )

    def settings_of(self, room: str) -> ServerSettings:
        """Settings of the server in the process of a room."""
        table = self.rooms[room]
        return ServerSettings(
            self.host, self.port, table.rate, table.body, table.max_users,
            table.allow_fixed_gains, table.allow_latency, table.max_watchers, self.allow_origins,
            allow_hosts=self.allow_hosts, limits=limits_of(table.limits), laws=table.laws,
            room=room, max_waiting=table.max_waiting,
            allow_frames=self.allow_frames, watchers_point=table.watchers_point,
            base_path=self.base_path, record=table.record, recordings=table.recordings,
            made_from=_made_from(table),
        )  # fmt: skip

    @property
    def router(self) -> ServerSettings:
        """Settings that all rooms share."""
        return ServerSettings(
            self.host, self.port, allow_origins=self.allow_origins, allow_hosts=self.allow_hosts,
            limits=limits_of(self.limits), room=None, allow_frames=self.allow_frames,
            base_path=self.base_path,
        )  # fmt: skip


def _made_from(table: RoomTable) -> dict[str, Any]:
    """Return how the body of a room is made, as `cli/object_options.py` does for one object."""
    known = table.model_dump(mode="json", include={"body", "nonlinear", "relaxation", "users"})
    options = table.object
    given = options.model_dump(mode="json", exclude_defaults=True, exclude={"auto"})
    return {**known, "auto": options.auto, "object": given}


def limits_of(table: Mapping[str, str]) -> Limits:
    """Default budgets with the changes in a table."""
    return Limits().changed(f"{name}={value}" for name, value in table.items())


def load_config(path: Path) -> RoomsConfig:
    """Read a configuration file; environment variables of this process override its values.

    Raises:
        ConfigError: The configuration is invalid; the error names every invalid key.
    """
    try:
        written = tomllib.loads(text_of(path.read_bytes()))
    except OSError as error:
        raise ConfigError(path, [f"cannot be read: {error.strerror}"]) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(path, [f"is not TOML: {error}"]) from error
    if passed_over := [name for name, value in os.environ.items() if _is_of_a_service(name, value)]:
        sentence = ", ".join(sorted(passed_over))
        log.info("passed over what tells of a service called cohaptic-server: %s", sentence)
    _check_environment(path, os.environ)
    try:
        sourced: Any = _sourced(written)  # called without arguments: its values come from sources
        config: RoomsConfig = sourced()
        # Names of hosts and origins are checked by the settings that use them.
        _ = config.router
    except ValidationError as error:
        raise ConfigError(path, problems_of(error, PREFIX, DIVIDER, os.environ)) from error
    except SettingsError as error:
        raise ConfigError(path, [f"{error}: {error.__cause__}"]) from error
    except SettingError as error:
        raise ConfigError(path, [f"allow_{error.name}s: {error}"]) from error
    placed = {name: _placed(table, path.parent) for name, table in config.rooms.items()}
    access = config.access
    files = {"keys": access.keys, "state": access.state}
    access = access.model_copy(
        update={key: path.parent / at_home(file) for key, file in files.items() if file is not None}
    )
    missing = [
        f"rooms.{name}.{key} is {file}; it must be {expected}"
        for name, table in placed.items()
        for key, file in _files(table)
        if (expected := _expected(file, in_frame=key == "object.fix_mesh"))
    ]
    if missing:
        raise ConfigError(path, missing)
    return config.model_copy(update={"rooms": placed, "access": access})


def _sourced(written: dict[str, Any]) -> type[RoomsConfig]:
    """Make a `RoomsConfig` class that takes values from the environment first, then from a file."""

    class Sourced(RoomsConfig):
        @classmethod
        def settings_customise_sources(
            cls,
            settings_cls: type[BaseSettings],
            init_settings: PydanticBaseSettingsSource,
            env_settings: PydanticBaseSettingsSource,
            dotenv_settings: PydanticBaseSettingsSource,
            file_secret_settings: PydanticBaseSettingsSource,
        ) -> tuple[PydanticBaseSettingsSource, ...]:
            assert isinstance(env_settings, EnvSettingsSource)
            env_settings.env_vars = {
                name: value
                for name, value in env_settings.env_vars.items()
                if not _is_of_a_service(name, value or "")
            }
            return (env_settings, InitSettingsSource(settings_cls, written))

    return Sourced


def _check_environment(path: Path, environment: Mapping[str, str]) -> None:
    """Raise ConfigError for environment variables that would otherwise be ignored silently."""
    known = set(RoomsConfig.model_fields)
    unknown = [
        f"the environment variable {name} names no key; known: {', '.join(sorted(known))}"
        for name, value in environment.items()
        if name.upper().startswith(PREFIX)
        and not _is_of_a_service(name, value)
        and name[len(PREFIX) :].lower().split(DIVIDER)[0] not in known
    ]
    if unknown:
        raise ConfigError(path, unknown)


def _is_of_a_service(name: str, value: str) -> bool:
    """Whether Kubernetes or Docker has set an environment variable; it is no key of ours then."""
    key = name.upper().removeprefix(PREFIX)
    if key == name.upper():
        return False
    of_port = key == "PORT" and _ADDRESS.fullmatch(value) is not None
    return of_port or _OF_A_SERVICE.fullmatch(key) is not None


def is_plain_balloon(room: RoomTable) -> bool:
    """Whether the body of a room is the balloon in `prebuilt`."""
    return room.body == "balloon" and not room.nonlinear and room.relaxation == 0.0


def _placed(table: RoomTable, folder: Path) -> RoomTable:
    """Resolve the file names in a room's table against the folder of the configuration."""

    def resolved(written: str | Path) -> Path:
        return folder / at_home(Path(written))

    body = str(resolved(table.body)) if is_file(table.body) else table.body
    placed = {name: resolved(path) for name, path in _object_files(table.object)}
    folders = ("record", "recordings")
    where = {name: str(resolved(path)) for name in folders if (path := getattr(table, name))}
    files = table.object.model_copy(update=placed)
    return table.model_copy(update={"body": body, "object": files, **where})


def _files(table: RoomTable) -> list[tuple[str, Path]]:
    files = [("body", Path(table.body))] if is_file(table.body) else []
    return files + [(f"object.{name}", path) for name, path in _object_files(table.object)]


def _expected(file: Path, *, in_frame: bool) -> str:
    """What a file that is not there should be; empty for one that exists.

    Args:
        in_frame: Whether a unit and axes may follow the name, as with `--fix-mesh`.
    """
    try:
        path = FixMesh.of(file).path if in_frame else file
    except SettingError as error:
        return error.limit
    return "" if path.is_file() else "a file that exists"


def _object_files(table: ObjectTable) -> list[tuple[str, Path]]:
    return [(name, value) for name, value in table if isinstance(value, Path)]
