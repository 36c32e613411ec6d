"""Entries and files of sessions for the tests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.control.room_lag import NO_LAG
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.scene import encode_scene
from cohaptic.protocol.scene_users import UserRecord
from cohaptic.sessions.entries import (
    BodyReset,
    BudgetSet,
    Happened,
    Heard,
    Joined,
    LawSet,
    Left,
    LeftOut,
    Link,
    Mark,
    Mesh,
    PassedOver,
    Patched,
    Restrained,
    Rows,
    RowsLost,
    SessionInfo,
    Shown,
    Ticked,
    Written,
)
from cohaptic.sessions.writer import SessionFile
from cohaptic.status.row import COLUMNS, Row
from cohaptic.vec import Vec3

T = 100.0  # s, begin of the sessions of the tests
BODY = {"name": "balloon", "center": [0.0, 0.0, 0.0], "radius": 0.1, "contact_radius": 0.01}


def info(t: float = T, to_wall: float = 1.8e9) -> SessionInfo:
    return SessionInfo(t, "0.1.0", 1, "lab", BODY, 1 / 60, to_wall, {"body": "balloon"})


def rows(
    start: float,
    count: int,
    user: int = 1,
    *,
    to_server: float = 40.0,
    columns: tuple[str, ...] = COLUMNS,
) -> Rows:
    """Rows from a time of the server on, each millisecond; a tip that moves, and a force."""
    t = start - to_server + np.arange(count) / 1000.0
    table = np.zeros((count, len(columns)))
    table[:, 0] = t
    place = {name: i for i, name in enumerate(columns)}
    phase = 2.0 * np.pi * (t + to_server - T)
    for name, values in (
        ("x", 0.1 * user + 0.01 * np.sin(phase)),
        ("fz", 2.0 + np.cos(phase)),
        ("by_surface", 2.0 + np.cos(phase)),
        ("tick", np.floor(60.0 * (t + to_server - T))),
        ("reason", np.full(count, 2.0**31 + 1.0)),
        ("patch_age", np.where(np.arange(count) % 5 == 0, np.inf, 0.01)),
    ):
        if name in place:
            table[:, place[name]] = values
    return Rows(start, user, columns, table.tobytes(), to_server, 1e-4)


def patch(t: float, tick: int) -> bytes:
    return Patch(
        tick, 1, t, t - 40.0, 0.002, Geometry.PLANE, Law.PREDICTIVE, (0.0, 0.0, 0.1),
        (0.0, 0.0, 1.0), 0.0, 1e-3, 500.0, 0.0, (0.0, 0.0, 1.5), (0.0, 0.0, 0.0),
    ).encode()  # fmt: skip


def sample(t: float) -> bytes:
    return ContactSample(1, 0, t - 40.0, (0.0, 0.0, 0.1), (0.0, 0.0, 1.0)).encode()


TETRAHEDRON = RestMesh(
    ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)),
    ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)),
).encode()


def scene(t: float, tick: int, forces: Mapping[int, Vec3]) -> bytes:
    """The frame of a scene with these forces, each user's tip 10 cm from the one before."""
    records = [
        UserRecord(
            user, (0.1 * user, 0.0, 0.0), (0.0, 0.0, 0.0), force, 1e-3, 1e3, 1e3, 0.0, 0.0,
            (0.0, 0.0, 1.0), Law.PREDICTIVE, Geometry.PLANE, 1.0, 0.0, True, False, (0.0, 0.0, 0.0),
        )
        for user, force in forces.items()
    ]  # fmt: skip
    return encode_scene(tick, t, NO_LAG, b"".join(record.encode() for record in records), b"")


def session(seconds: float = 3.0, users: int = 2, *, late: float = 0.25) -> list[Written]:
    """All kinds of entries in the order in which a server would add them; rows come late."""
    entries: list[Written] = [Mesh(T, TETRAHEDRON)]
    for user in range(1, users + 1):
        hello = {"name": f"u{user}", "max_force": 10.0, "key": "a secret of u1", "token": "t"}
        entries.append(Joined(T, user, f"u{user}", hello, 8.0, "127.0.0.1"))
    entries.append(BudgetSet(T, 20.0))
    for step in range(round(seconds * 20)):
        t = T + step / 20
        entries.append(Heard(t, 1, sample(t)))
        entries.append(Ticked(t, step + 1))
        for user in range(1, users + 1):
            entries.append(Patched(t, step + 1, user, patch(t, step + 1)))
            if t - late >= T:
                entries.append(rows(t - late, 50, user))
        forces = dict.fromkeys(range(1, users + 1), (0.0, 0.0, -1.0))
        entries.append(Shown(t, step + 1, scene(t, step + 1, forces)))
    end = T + seconds
    return [
        *entries,
        LawSet(end, 1, {"law": "pi"}),
        Restrained(end, True, (1,)),
        Link(end, 1, 0.02, 0.001, 40.0, 1e-4),
        RowsLost(end, 2, 17),
        Mark(end, "trial 1", {"force": 2.5, "hand": "left"}, by=1, error=0.002),
        Mark(end, "pause", {}),
        Happened(end, "fault", 1, "the device is gone"),
        BodyReset(end),
        PassedOver(end, 30),
        BudgetSet(end, None),
        LeftOut(end, 3),
        Left(end, 2, "left"),
    ]


def write(path: Path, entries: Iterable[Written], *, plots: bool = True) -> Path:
    """A closed file of a session."""
    file = SessionFile("--record", path, info(), plots=plots)
    for entry in entries:
        file.add(entry)
    file.close()
    return path


def as_read(entry: Written) -> Written:
    """What a file makes of an entry: no secrets, and most columns of 32 bits."""
    if isinstance(entry, Joined):
        hello = {k: v for k, v in entry.hello.items() if k not in ("key", "token", "session")}
        return Joined(entry.t, entry.user, entry.name, hello, entry.max_force, entry.source)
    if isinstance(entry, Rows):
        table = np.frombuffer(entry.block).reshape(-1, len(entry.columns)).copy()
        for i, name in enumerate(entry.columns):
            if name not in ("t", "tick", "reason"):
                with np.errstate(over="ignore"):
                    table[:, i] = table[:, i].astype(np.float32)
        return Rows(
            entry.t, entry.user, entry.columns, table.tobytes(), entry.to_server, entry.error
        )
    return entry


def in_order(entries: Iterable[Written]) -> list[Written]:
    return sorted(map(as_read, entries), key=lambda entry: entry.t)


numbers = st.floats(allow_nan=False)
finite = st.floats(allow_nan=False, allow_infinity=False)
times = st.integers(-2_000, 8_000).map(lambda ms: T + ms / 1000.0)
users = st.integers(1, 2**32 - 1)
texts = st.text(max_size=20)
frames = st.binary(max_size=60)
leaves = st.none() | st.booleans() | st.integers(-(2**60), 2**60) | finite | texts
values = st.recursive(leaves, lambda inner: st.lists(inner, max_size=3), max_leaves=5)
objects = st.dictionaries(texts, values, max_size=3)
blocks = st.lists(
    st.lists(numbers, min_size=len(Row._fields), max_size=len(Row._fields)), max_size=2
).map(lambda found: np.array(found, "<f8").tobytes())

written: st.SearchStrategy[Written] = st.one_of(
    st.builds(Joined, times, users, texts, objects, finite, texts),
    st.builds(Left, times, users, texts),
    st.builds(LawSet, times, users, objects),
    st.builds(Heard, times, users, frames),
    st.builds(Ticked, times, users),
    st.builds(PassedOver, times, users),
    st.builds(Restrained, times, st.booleans(), st.lists(users, max_size=3).map(tuple)),
    st.builds(BudgetSet, times, st.none() | finite),
    st.builds(BodyReset, times),
    st.builds(Patched, times, users, users, frames),
    st.builds(Mesh, times, frames),
    st.builds(Shown, times, users, frames),
    st.builds(Rows, times, users, st.just(COLUMNS), blocks, numbers, numbers),
    st.builds(RowsLost, times, users, users),
    st.builds(Link, times, users, numbers, numbers, numbers, numbers),
    st.builds(Mark, times, texts, objects, st.none() | users),
    st.builds(Happened, times, texts, st.none() | users, texts),
    st.builds(LeftOut, times, users),
)
