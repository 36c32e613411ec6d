"""Entries as the messages of their channels, and back. Functions of bytes.

Rows are turned into columns, since a column is compressed to half of what its rows are, and since
32 bits suffice for all but a few of them (`status.row.EXACT`); both together save half of the file.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from cohaptic.protocol.control.message import SECRETS
from cohaptic.sessions.entries import (
    LARGEST,
    MAX_TIME,
    Heard,
    Joined,
    Link,
    Mesh,
    Patched,
    Rows,
    SessionInfo,
    Shown,
    Ticked,
    Written,
)
from cohaptic.sessions.schemas import BY_ENTRY, CHANNELS, Channel, adapter
from cohaptic.sessions.wire import decode as decode_message
from cohaptic.sessions.wire import encode as encode_message
from cohaptic.status.row import EXACT

Floats = npt.NDArray[np.float64]
_MAX_WALL = 8e9  # s; the index of an MCAP file ends in the year 2262
# Fields of entries that are JSON, which would make null of a number that is not finite.
_IN_JSON: dict[type, tuple[str, ...]] = {
    channel.entry: tuple(field.name for field in fields(channel.entry))
    for channel in CHANNELS
    if channel.message is None
}


def encode(entry: Written) -> bytes:
    """Return the message of an entry, for the channel that `schemas.BY_ENTRY` names.

    Raises:
        ValueError: A value cannot be represented, such as a negative number of a user, or the entry
            is longer than `entries.LARGEST`.
        TypeError: A value has another type.
    """
    channel = BY_ENTRY[type(entry)]
    _check(entry)
    if isinstance(entry, Joined):  # whoever reads the file could come in with these
        hello = {name: value for name, value in entry.hello.items() if name not in SECRETS}
        entry = replace(entry, hello=hello)
    if channel.message is None:
        data: bytes = adapter(type(entry)).dump_json(entry, warnings="error")
    else:
        data = encode_message(channel.message, _VALUES[type(entry)](entry))
    if len(data) > LARGEST:
        raise ValueError(f"an entry has {len(data)} bytes, more than {LARGEST}")
    return data


def decode(channel: Channel, data: bytes) -> Written:
    """Return the entry of a message.

    Raises:
        ValueError: No writer writes such a message.
    """
    if channel.message is None:
        try:
            entry: Written = adapter(channel.entry).validate_json(data, strict=True)
        except ValidationError as error:
            raise ValueError(str(error.errors()[0]["msg"])) from error
    else:
        entry = _ENTRIES[channel.entry](*decode_message(channel.message, data))
    _check(entry)
    return entry


def _check(entry: Written) -> None:
    """Raise ValueError if an entry could not be found again, or would become unreadable."""
    if not abs(entry.t) <= MAX_TIME:
        raise ValueError(f"t of an entry is {entry.t}, not within {MAX_TIME:g} s")
    if isinstance(entry, SessionInfo) and not abs(entry.to_wall) <= _MAX_WALL:
        raise ValueError(f"to_wall of a session is {entry.to_wall}, not within {_MAX_WALL:g} s")
    for name in _IN_JSON.get(type(entry), ()):
        value = getattr(entry, name)
        if isinstance(value, float) and not math.isfinite(value):
            raise ValueError(f"{name} of an entry is {value}")


def table_of(rows: Rows) -> Floats:
    """Return the rows of an entry, shape (rows, columns).

    Raises:
        ValueError: The block does not consist of whole rows.
    """
    if not rows.columns:
        raise ValueError("rows have no columns")
    return np.frombuffer(rows.block, "<f8").reshape(-1, len(rows.columns))


def _row_values(entry: Rows) -> tuple[Any, ...]:
    table = table_of(entry)
    exact, narrow = _split(entry.columns)
    with np.errstate(over="ignore"):  # what 32 bits do not hold becomes infinite
        values = table[:, narrow].T.astype("<f4", order="C").tobytes()
    names = "\n".join(entry.columns)
    exact_names = "\n".join(entry.columns[i] for i in exact)
    data = np.ascontiguousarray(table[:, exact].T).tobytes()
    return entry.t, entry.user, entry.to_server, entry.error, names, exact_names, data, values


@lru_cache(maxsize=64)  # one for each set of rules that the clients of a session have
def _split(columns: tuple[str, ...]) -> tuple[list[int], list[int]]:
    """Return the places of the columns of 64 bits, and of the others.

    Raises:
        ValueError: The names are not such as rows have.
    """
    if columns[0] != "t" or len(set(columns)) < len(columns):
        raise ValueError("the columns of rows are not different ones that begin with 't'")
    if not all(name and name.isprintable() for name in columns):
        raise ValueError("a column of rows has no printable name")
    exact = [i for i, name in enumerate(columns) if name in EXACT]
    return exact, [i for i, name in enumerate(columns) if name not in EXACT]


def _rows(
    t: float, user: int, to_server: float, error: float,
    names: str, exact_names: str, exact: bytes, values: bytes,
) -> Rows:  # fmt: skip
    columns = tuple(names.split("\n"))
    places, others = _split(columns)
    if exact_names.split("\n") != [columns[i] for i in places]:
        raise ValueError("other columns of rows have 64 bits than this version writes")
    count, rest = divmod(len(exact), 8 * len(places))
    if rest or len(values) != 4 * count * len(others):
        raise ValueError("the columns of rows differ in length")
    table = np.empty((count, len(columns)), "<f8")
    table[:, places] = np.frombuffer(exact, "<f8").reshape(len(places), count).T
    table[:, others] = np.frombuffer(values, "<f4").reshape(len(others), count).T
    return Rows(t, user, columns, table.tobytes(), to_server, error)


# Values of an entry in the order of the fields of its message, and the entry of such values.
_VALUES: dict[type, Callable[[Any], tuple[Any, ...]]] = {
    Heard: lambda e: (e.t, e.user, e.frame),
    Ticked: lambda e: (e.t, e.tick),
    Patched: lambda e: (e.t, e.tick, e.user, e.frame),
    Mesh: lambda e: (e.t, e.frame),
    Shown: lambda e: (e.t, e.tick, e.frame),
    Rows: _row_values,
    Link: lambda e: (e.t, e.user, e.round_trip, e.jitter, e.clock_offset, e.clock_error),
}
_ENTRIES: dict[type, Callable[..., Written]] = {
    Heard: Heard, Ticked: Ticked, Patched: Patched, Mesh: Mesh, Shown: Shown, Rows: _rows,
    Link: Link,
}  # fmt: skip
