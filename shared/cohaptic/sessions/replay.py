"""A session file as a replay shows it: an overview, stretches of scenes, and why a force was.

Everything is read from the file when it is asked for, so that a replay takes no more memory than
one stretch. All times are on the server's clock [s].
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from cohaptic.errors import RemoteProtocolError, SettingError, one_line
from cohaptic.protocol.messages import BodyInfo, encode_control
from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.scene_users import decode_users
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Watching
from cohaptic.recording.why import Columns, Why, check_ledger, why
from cohaptic.sessions.codec import table_of
from cohaptic.sessions.entries import (
    Damage,
    Entry,
    Happened,
    Joined,
    Left,
    Mark,
    Mesh,
    Rows,
    SessionInfo,
    Shown,
)
from cohaptic.sessions.reader import Outline, read_entries

MAX_STRETCH = 10.0  # s of one stretch of scenes
MAX_BYTES = 4 * 1024 * 1024  # of a stretch after which no further scene is added to it
MAX_MOMENTS = 5_000  # of one session; more would be neither drawn nor read
MAX_USERS = 4_096  # names of one session; a classroom that comes and goes all day has some hundreds
_MAX_NAME, _MAX_TEXT = 60, 200  # characters
# s before a moment in which the block with its row begins: blocks have a tenth of a second, a slow
# client's some more.
_BLOCK = 1.5
_END = struct.Struct("<d")
_LENGTH = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Moment:
    """A moment of a session to which people want to jump.

    Args:
        t: Time [s].
        kind: `joined`, `left`, `mark`, `event`, or `damage` for a stretch that cannot be read.
        user: Number of the user whom it concerns; None for nobody.
        text: What it is, in words.
    """

    t: float
    kind: str
    user: int | None
    text: str


@dataclass(frozen=True, eq=False)
class Replay:
    """A session file that was opened for a replay.

    Args:
        path: Path of the file.
        info: First entry of the session.
        watching: What a server would tell a page that begins to watch; nobody can touch.
        mesh: Frame of the resting mesh, which was checked.
        users: Names by number of the user.
        surfaces: Whether scenes bring their surface, as the first one does.
        first, last: Times of the first scene and of the last entry [s].
        moments: Joins, leaves, marks, events and damage, by rising time; those before the first
            scene have its time.
        further: Number of moments that were left out, since there are too many.
        complete: Whether the file was closed; if not, its process was killed.
    """

    path: Path
    info: SessionInfo
    watching: Watching
    mesh: bytes
    users: dict[int, str]
    surfaces: bool
    first: float
    last: float
    moments: tuple[Moment, ...]
    further: int
    complete: bool

    @classmethod
    def of(cls, path: Path) -> Replay:
        """Open a session file.

        Raises:
            SettingError: The file cannot be read, holds no session with a resting mesh, or its
                frames are of another version of the protocol.
        """
        outline = Outline.of(path)
        info = outline.info
        if info.protocol != PROTOCOL_VERSION:
            limit = (
                f"a session of version {PROTOCOL_VERSION} of the protocol, not {info.protocol}:"
                f" cohaptic {one_line(info.version, 20)} replays it"
            )
            raise SettingError("session", path, limit)
        try:
            watching = Watching(
                simulation_period=info.simulation_period, to_wall=info.to_wall,
                body=BodyInfo.model_validate(dict(info.body)), model=None, users=(),
                allow_latency=False, allow_fixed_gains=False, can_touch=False,
            )  # fmt: skip
        except ValidationError as error:
            limit = f"one whose object is described ({one_line(error.errors()[0]['msg'])})"
            raise SettingError("session", path, limit) from error
        scene = _first(path, Shown, "one with scenes, which are what a replay shows")
        first, surfaces = scene.t, _has_surface(path, scene)
        moments, further = _moments(path, outline.users, first)
        names = list(outline.users.items())[-MAX_USERS:]
        users = {user: one_line(name, _MAX_NAME) for user, name in names}
        mesh = _mesh(path)
        return cls(
            path, info, watching, mesh, users, surfaces, first, max(first, outline.last), moments,
            further, outline.complete,
        )  # fmt: skip

    def scenes(self, start: float, end: float) -> bytes:
        """Return the scenes of a stretch of time.

        Args:
            start: Earliest time of a scene [s].
            end: Time before which the scenes are [s], at most MAX_STRETCH later.

        Returns:
            The time up to which the stretch is complete, a little-endian 64-bit number [s], which
            is before `end` where its scenes have more than MAX_BYTES; then for each scene its
            length, 32 bits, and its frame.

        Raises:
            SettingError: The stretch is empty, too long or not finite, or the file cannot be read.
        """
        if not 0.0 < end - start <= MAX_STRETCH:
            limit = f"a stretch of more than 0 s and at most {MAX_STRETCH:g} s"
            raise SettingError("from, to", f"{start:g} s, {end:g} s", limit)
        parts, size, until = [b""], 0, end
        for entry in read_entries(self.path, start, end, (Shown,)):
            if not isinstance(entry, Shown):
                continue
            if size > MAX_BYTES:
                until = entry.t
                break
            parts += (_LENGTH.pack(len(entry.frame)), entry.frame)
            size += len(entry.frame)
        parts[0] = _END.pack(until)
        return b"".join(parts)

    def why(self, user: int, t: float) -> Why | None:
        """Return what the rules of a user's loop did to its force at a time.

        Args:
            user: Number of the user.
            t: Time [s].

        Returns:
            The ledger of the last period that had begun by then, with its time on the server's
            clock; None where the file has no rows of this user from then.

        Raises:
            SettingError: The file cannot be read, or its rows have no ledger.
        """
        found: Rows | None = None
        for entry in read_entries(self.path, t - _BLOCK, math.nextafter(t, math.inf), (Rows,)):
            if isinstance(entry, Rows) and entry.user == user:
                found = entry
        if found is None or not found.block:
            return None
        table = table_of(found)
        columns: Columns = dict(zip(found.columns, table.T, strict=True))
        check_ledger(self.path, columns)
        begun = columns["t"] + found.to_server
        at = min(t, float(begun[-1])) - float(begun[0])
        if not 0.0 <= at or t - float(begun[-1]) > _BLOCK:
            return None
        answer = why(columns, min(at, float(columns["t"][-1] - columns["t"][0])))
        return replace(answer, t=answer.t + float(begun[0]))

    def overview(self, model: str | None, unshown: str) -> dict[str, Any]:
        """Return what a page has to know before it shows the first scene, as JSON.

        Args:
            model: Name of the Green's functions from which the surface follows; None without any.
            unshown: Sentence that says why the deformation is not shown, where no scene has it;
                empty if it is.
        """
        return {
            "name": self.path.name,
            "room": one_line(self.info.room, _MAX_NAME),
            "first": self.first,
            "last": self.last,
            "watching": encode_control(self.watching.model_copy(update={"model": model})),
            "unshown": unshown,
            "users": [{"user": user, "name": name} for user, name in self.users.items()],
            "moments": [
                {"t": one.t, "kind": one.kind, "user": one.user, "text": one.text}
                for one in self.moments
            ],
            "further": self.further,
            "complete": self.complete,
        }


def vertices_and_faces(mesh: bytes) -> tuple[Any, Any]:
    """Return vertices, shape (n, 3) [m], and faces, shape (m, 3), of the frame of a resting mesh.

    Raises:
        RemoteProtocolError: It is no frame of a resting mesh.
    """
    # Both kinds of frames are of one layout, and each refuses the other.
    try:
        found: RestMesh | QuantisedMesh = RestMesh.decode(mesh)
    except RemoteProtocolError:
        found = QuantisedMesh.decode(mesh)
    return found.vertices, found.faces


E = TypeVar("E", Mesh, Shown)


def _first(path: Path, kind: type[E], limit: str) -> E:
    """Return the first entry of a kind.

    Raises:
        SettingError: There is none; `limit` says what the file should be.
    """
    for entry in read_entries(path, only=(kind,)):
        if isinstance(entry, kind):
            return entry
    raise SettingError("session", path, limit)


def _has_surface(path: Path, scene: Shown) -> bool:
    """Whether a scene has its surface.

    Raises:
        SettingError: It is no scene.
    """
    try:
        return decode_users(scene.frame).end > 0
    except RemoteProtocolError as error:
        raise SettingError("session", path, f"one whose scenes are right: {error}") from error


def _mesh(path: Path) -> bytes:
    """Return the first resting mesh of a file.

    Raises:
        SettingError: There is none, or it is no mesh.
    """
    frame = _first(path, Mesh, "one with the resting mesh of its object, to be drawn").frame
    try:
        vertices_and_faces(frame)
    except RemoteProtocolError as error:
        raise SettingError("session", path, f"one whose mesh is right: {error}") from error
    return frame


def _moments(path: Path, users: dict[int, str], first: float) -> tuple[tuple[Moment, ...], int]:
    """Return the moments of a session from its first scene on, and how many were left out."""
    found, further = list[Moment](), 0
    for entry in read_entries(path, only=(Joined, Left, Mark, Happened)):
        if (moment := _moment(entry, users)) is None:
            continue
        if len(found) < MAX_MOMENTS:
            found.append(replace(moment, t=max(first, moment.t)))
        else:
            further += 1
    return tuple(found), further


def _moment(entry: Entry, users: dict[int, str]) -> Moment | None:
    def named(user: int) -> str:
        return one_line(users.get(user) or f"user {user}", _MAX_NAME)

    match entry:
        case Joined():
            return Moment(entry.t, "joined", entry.user, f"{named(entry.user)} joined")
        case Left():
            reason = one_line(entry.reason, _MAX_TEXT)
            words = f"{named(entry.user)} left" + (f": {reason}" if reason else "")
            return Moment(entry.t, "left", entry.user, words)
        case Mark():
            return Moment(entry.t, "mark", entry.by, one_line(entry.text, _MAX_TEXT) or "a mark")
        case Happened():
            words = one_line(entry.text or entry.kind, _MAX_TEXT)
            return Moment(entry.t, "event", entry.user, words)
        case Damage():
            words = "the file ends here" if entry.cut_short else "a part of the file is damaged"
            return Moment(entry.t, "damage", None, words)
        case _:
            return None
