"""Computes the patches of a recorded session again, and compares them with those of the file.

The inputs of the room are fed to a new room with the same body, in the order of their times. A body
whose columns another process has solved for gets them before the same ticks as then.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, TypeGuard

from threadpoolctl import threadpool_limits

from cohaptic.errors import CohapticError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Hello, SetLaw
from cohaptic.protocol.patch import Patch
from cohaptic.sessions.entries import (
    Asked,
    BodyReset,
    BudgetSet,
    Damage,
    Entry,
    Heard,
    Input,
    Joined,
    LawSet,
    Left,
    LeftOut,
    PassedOver,
    Patched,
    Restrained,
    SessionInfo,
    Solved,
    Ticked,
)
from cohaptic.sessions.reader import read_entries
from cohaptic_server.access.admission import ANYBODY
from cohaptic_server.bodies.body import Body, elastic_of
from cohaptic_server.bodies.solid.green_columns import ColumnRequest
from cohaptic_server.room.room import Room
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.column_worker import BATCH, HasColumns
from cohaptic_server.world.users import WorldState

TOLERANCE = 1e-9  # of the numbers of a patch, relative to them, or absolute below 1
_MOST_USERS = 64


class NotVerifiable(CohapticError):
    """Error: the patches of a recording cannot be computed again.

    Args:
        why: Reason.
    """

    def __init__(self, why: str) -> None:
        super().__init__(why)
        self.why = why

    def __str__(self) -> str:
        return f"the patches of this recording cannot be computed again: {self.why}"


@dataclass(frozen=True, slots=True)
class Verdict:
    """Comparison of the patches of a recording with those that are computed from its inputs.

    Args:
        patches: Number of patches that were compared.
        identical: Number of those that are the same to the last bit.
        worst: Largest difference of two numbers, relative to the number, or absolute below 1.
        where: Tick, user and name of the number with the largest difference; empty for none.
        missing: Number of patches that only one of both has: the file, or the room of its inputs.
        cut_short: Whether the file ends before its recording did, as after a killed server.
    """

    patches: int = 0
    identical: int = 0
    worst: float = 0.0
    where: str = ""
    missing: int = 0
    cut_short: bool = False

    @property
    def holds(self) -> bool:
        """Whether all patches are there, and agree to `TOLERANCE`."""
        return self.patches > 0 and self.missing == 0 and self.worst <= TOLERANCE


class Replayed:
    """The room of a recording, which is fed its inputs again.

    Args:
        info: First entry of the recording.
        body: The same body, as if nobody had touched it.

    Raises:
        NotVerifiable: The recording does not begin at rest.

    Attributes:
        room: The room.
    """

    def __init__(self, info: SessionInfo, body: Body) -> None:
        if info.settings.get("from_rest") is not True:
            raise NotVerifiable("it began after people had touched the object")
        try:
            hz, tick = round(1.0 / info.simulation_period, 9), int(info.settings.get("tick", 0))
        except (ArithmeticError, TypeError, ValueError) as error:
            raise NotVerifiable(f"it does not say how it began ({error})") from error
        settings = ServerSettings(simulation_hz=hz, max_users=_MOST_USERS, allow_fixed_gains=True)
        elastic = elastic_of(body)
        self._columns = elastic if isinstance(elastic, HasColumns) else None
        if self._columns is not None and info.settings.get("columns") != "at once":
            self._columns.in_background(fill=False)
            self._columns.columns.store.fill()
        self._asked: ColumnRequest | None = None
        self.room = Room(body, settings)
        self.room.world = WorldState(tick)

    # Above 60 lines: one branch for each input of a room.
    def take(self, entry: Input) -> None:
        """Take an input.

        Raises:
            NotVerifiable: It is none that this room can have at this moment.
        """
        room = self.room
        try:
            match entry:
                case Joined():
                    grants = ANYBODY.grants.model_copy(update={"max_force": entry.max_force})
                    room.next_user = entry.user
                    hello = Hello.model_validate(entry.hello)
                    room.join(hello, entry.t, guest=replace(ANYBODY, grants=grants))
                case Left():
                    room.leave(entry.user, entry.t, entry.reason)
                case LawSet():
                    room.set_law(entry.user, SetLaw.model_validate(entry.change), entry.t)
                case Heard():
                    if (
                        entry.user in room.members
                    ):  # one who has left within this tick counts no more
                        room.sample(entry.user, ContactSample.decode(entry.frame), entry.t)
                case Restrained():
                    room.frozen = entry.frozen
                    for user, member in room.members.items():
                        member.muted = user in entry.muted
                case BudgetSet():
                    room.force_budget = entry.force
                case BodyReset():
                    room.reset(entry.t)
                case PassedOver():
                    room.pass_over(entry.ticks, entry.t)
                case Asked():
                    self._asked = None if self._columns is None else self._columns.request(BATCH)
                case Solved():
                    if self._columns is None or self._asked is None:
                        raise NotVerifiable("the body is another one: it lacks no columns")
                    self._columns.deliver(self._columns.columns.solve(self._asked))
                    self._asked = None
                case Ticked():
                    room.tick(entry.t)
                    if room.world.tick != entry.tick:
                        found = f"tick {entry.tick} follows tick {room.world.tick - 1}"
                        raise NotVerifiable(f"a part of it is missing: {found}")
        except (ValueError, KeyError, CohapticError) as error:
            if isinstance(error, NotVerifiable):
                raise
            raise NotVerifiable(
                f"an input of its {type(entry).__name__}s is wrong: {error}"
            ) from error


def verify(entries: Iterable[Entry], body: Body) -> Iterator[tuple[float, Verdict]]:
    """Compare all patches of a recording; yield the time and the verdict so far after each tick.

    Args:
        entries: The entries of the recording, in the order of their times.
        body: As for `Replayed`.

    Raises:
        NotVerifiable: The recording does not begin at rest, or lacks something.
    """
    replayed, verdict, t = None, Verdict(), 0.0
    due = set[int]()  # users whose patches of the last tick have not come yet
    for entry in entries:
        if isinstance(entry, SessionInfo):
            replayed = Replayed(entry, body)
        elif replayed is None:
            raise NotVerifiable("it does not say how it began")
        elif isinstance(entry, LeftOut):
            raise NotVerifiable("the disk was too slow for it, so that a part is missing")
        elif isinstance(entry, Damage):
            if entry.cut_short:
                yield t, replace(verdict, cut_short=True)
                return
            raise NotVerifiable("a part of the file is damaged")
        elif isinstance(entry, Patched):
            verdict = _with(verdict, entry, replayed.room)
            due.discard(entry.user)
        elif isinstance(entry, Input):
            replayed.take(entry)
            if isinstance(entry, Ticked):
                t = entry.t
                verdict = replace(verdict, missing=verdict.missing + len(due))
                due = set(replayed.room.patches)
                yield t, verdict
    yield t, replace(verdict, missing=verdict.missing + len(due))


def verify_session(path: Path | str, body: Body) -> Verdict:
    """Compute the patches of a session file again, and compare them with those of the file.

    Args:
        path: Session file that was recorded from the first tick.
        body: The object of the session, made as then, which nobody has touched yet. A `Solid`
            becomes one that lacks columns, as in a server.

    Raises:
        SettingError: The file cannot be read.
        NotVerifiable: The recording does not begin at rest, or lacks something.
    """
    verdict = Verdict()
    # One thread, as in the server: several would add numbers in another order.
    with threadpool_limits(limits=1):
        for _, so_far in verify(read_entries(Path(path)), body):
            verdict = so_far
    return verdict


def _with(verdict: Verdict, recorded: Patched, room: Room) -> Verdict:
    computed = room.patches.get(recorded.user) if room.world.tick == recorded.tick else None
    if computed is None:
        return replace(verdict, missing=verdict.missing + 1)
    frame = computed.encode()
    patches = verdict.patches + 1
    if frame == recorded.frame:
        return replace(verdict, patches=patches, identical=verdict.identical + 1)
    worst, name = max(_differences(Patch.decode(recorded.frame), Patch.decode(frame)))
    if worst <= verdict.worst:
        return replace(verdict, patches=patches)
    where = f"{name} of user {recorded.user} at tick {recorded.tick}"
    return replace(verdict, patches=patches, worst=worst, where=where)


def _differences(a: Any, b: Any, name: str = "patch") -> Iterator[tuple[float, str]]:
    """Yield the differences of the numbers in two values of one shape, each with its name."""
    if isinstance(a, int | float) and isinstance(b, int | float):
        yield abs(a - b) / max(1.0, abs(a)), name
    elif is_dataclass(a) and type(a) is type(b):
        for field in fields(a):
            yield from _differences(getattr(a, field.name), getattr(b, field.name), field.name)
    elif _is_tuple(a) and _is_tuple(b):
        for one, other in itertools.zip_longest(a, b):
            yield from _differences(one, other, name)
    else:
        yield 0.0 if a == b else float("inf"), name


def _is_tuple(value: object) -> TypeGuard[tuple[object, ...]]:
    return isinstance(value, tuple)
