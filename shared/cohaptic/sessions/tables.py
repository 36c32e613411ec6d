"""A session as pandas tables, all on the server's clock.

Needs pandas, and `Session.to_xarray` xarray: `pip install "cohaptic[analysis]"`.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cohaptic.errors import RemoteProtocolError, SettingError
from cohaptic.protocol.patch import Patch
from cohaptic.recording.outline import GAP
from cohaptic.sessions.codec import table_of
from cohaptic.sessions.entries import (
    BodyReset,
    BudgetSet,
    Damage,
    Entry,
    Happened,
    Joined,
    LawSet,
    Left,
    LeftOut,
    Link,
    Mark,
    Patched,
    Restrained,
    Rows,
    RowsLost,
    SessionInfo,
)
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic.status.row import COLUMNS, EXACT

Floats = npt.NDArray[np.float64]
Progress = Callable[[str, float], None]  # takes a phase and its finished fraction, 0 to 1
Table = Any  # A pandas.DataFrame, which has no types of its own.

AXES = ("x", "y", "z", "fx", "fy", "fz")  # of a hand: tip [m], and force on the hand [N]
# What the table `lost` says of its rows.
ROWS_LOST, ENTRIES_LOST = "rows of a client", "entries"
DAMAGED, CUT_SHORT = "a damaged chunk", "cut short from here on"
# Samples of all hands on one grid: an hour of eight users at 1 kHz has 29 million of each axis.
_MOST_SAMPLES = 200_000_000

_SHOWN = 0.002  # of a file; a finer step of its progress is not seen
_METRES = ("x", "y", "z", "u_others", "indentation")
_SECONDS = ("late", "patch_age", "lag")
_STIFFNESS = ("k_h", "k_o", "gain_cut")
_PLAIN = ("level", "scale", "tick", "fault", "reason", "user")
_PATCH = {
    "t": "s", "tick": "1", "user": "1", "seq": "1", "t_client": "s", "sample_wait": "s",
    "x": "m", "y": "m", "z": "m", "nx": "1", "ny": "1", "nz": "1", "curvature": "1/m",
    "c_ii": "m/N", "k_h": "N/m", "fx": "N", "fy": "N", "fz": "N", "lag": "s", "bytes": "B",
}  # fmt: skip


def library(name: str) -> Any:
    """Return a library of the extra `analysis`.

    Raises:
        SettingError: It is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        limit = 'installed: pip install "cohaptic[analysis]"'
        raise SettingError(f"the package {name}", "not there", limit) from error


def unit_of(column: str) -> str:
    """Return the unit of a column of rows, "1" for a plain number."""
    if column in ("t", "t_client", *_SECONDS):
        return "s"
    if column in _METRES:
        return "m"
    if column in _STIFFNESS:
        return "N/m"
    return "1" if column in _PLAIN else "N"


@dataclass(frozen=True, eq=False)
class Session:
    """A session in memory; times `t` are on the server's clock [s].

    Each table has the units of its columns in `attrs["units"]`.

    Args:
        info: What holds for the whole session.
        users: Names by number of the user.
        rows: Rows of all users at the full rate, by user and then by time. `t_client` is the time
            on the client's own clock; the others are as in `cohaptic.status.row.Row`. Rows of
            clients whose loops have other rules have further columns, NaN for the others.
        patches: One row for each patch: contact point of the free surface, normal, gains, and the
            force that the body carries.
        marks: Marks; `error` bounds the error of `t`, NaN where the sender did not know it. Each of
            their fields has a column that is called `field.NAME`.
        events: What happened, with `kind`, `user` (0 for nobody) and `text`.
        links: State of the users' links.
        lost: What is not in the file: rows that did not arrive, entries that were left out (user
            0), and (`count` 0) damaged stretches, or all from where the file was cut short. Periods
            that a loop skipped beside other work are gaps of `rows`, not losses.
    """

    info: SessionInfo
    users: Mapping[int, str]
    rows: Table
    patches: Table
    marks: Table
    events: Table
    links: Table
    lost: Table

    def aligned(self, hz: float = 1000.0) -> Table:
        """Return tips and forces of all users on one grid of times.

        A value is interpolated linearly between the two rows around its time. Where these are more
        than 10 ms apart, as where rows are lost, and before the first row and after the last, it is
        NaN: nothing is guessed across a gap. With fewer than 1000 Hz values in between are left out
        without a filter, so that frequencies above half of it appear as lower ones.

        Args:
            hz: Samples per second [Hz].

        Returns:
            A table with the times as index `t` [s], and columns (user, axis), with the axes x, y, z
            [m] and fx, fy, fz [N].

        Raises:
            SettingError: The rate is not positive, or so high that the table fits into no memory.
        """
        pd = library("pandas")
        if not (math.isfinite(hz) and hz > 0.0):
            raise SettingError("hz", f"{hz:g}", "above 0")
        if missing := [axis for axis in AXES if axis not in self.rows]:
            limit = f"columns of the session that was read with only some: {', '.join(AXES)}"
            raise SettingError("columns", f"without {', '.join(missing)}", limit)
        groups = [(int(user), group) for user, group in self.rows.groupby("user", sort=True)]
        first = min((float(group["t"].iloc[0]) for _, group in groups), default=0.0)
        last = max((float(group["t"].iloc[-1]) for _, group in groups), default=-1.0 / hz)
        count = (last - first) * hz + 1.0
        if count * len(groups) > _MOST_SAMPLES:
            largest = _MOST_SAMPLES / len(groups) / (last - first)
            raise SettingError("hz", f"{hz:g}", f"at most {largest:g} for so long a session")
        # Whole periods since 0, so that two tables of one session have times in common.
        grid = np.arange(math.ceil(first * hz - 1e-6), math.floor(last * hz + 1e-6) + 1) / hz
        found = {
            (user, axis): _interpolated(grid, group["t"].to_numpy(), group[axis].to_numpy())
            for user, group in groups
            for axis in AXES
        }
        columns = pd.MultiIndex.from_tuples(list(found), names=["user", "axis"])
        data = np.column_stack(list(found.values())) if found else np.empty((len(grid), 0))
        table = pd.DataFrame(data, index=pd.Index(grid, name="t"), columns=columns)
        table.attrs["units"] = {"t": "s"} | {axis: unit_of(axis) for axis in AXES}
        table.attrs["hz"] = hz
        return table

    def to_xarray(self, hz: float = 1000.0) -> Any:
        """Return the table of `aligned` as an `xarray.Dataset`.

        Returns:
            `tip` [m] and `force` [N] with the dimensions (t, user, axis), and each user's name.

        Raises:
            SettingError: As for `aligned`; or xarray is not installed.
        """
        xr, table = library("xarray"), self.aligned(hz)
        users = list(dict.fromkeys(user for user, _ in table.columns))
        data = table.to_numpy().reshape(len(table), len(users), len(AXES))
        dims = ("t", "user", "axis")
        return xr.Dataset(
            {
                "tip": (dims, data[:, :, :3], {"units": "m"}),
                "force": (dims, data[:, :, 3:], {"units": "N"}),
            },
            coords={
                "t": ("t", table.index.to_numpy(), {"units": "s"}),
                "user": users,
                "axis": list("xyz"),
                "name": ("user", [self.users.get(user, str(user)) for user in users]),
            },
            attrs={"room": self.info.room, "hz": hz, "to_wall": self.info.to_wall},
        )


def _interpolated(grid: Floats, t: Floats, values: npt.NDArray[Any]) -> Floats:
    """Return values at the times of a grid; NaN where no rows are near on both sides."""
    found: Floats = np.interp(grid, t, values.astype(float), left=np.nan, right=np.nan)
    after = np.searchsorted(t, grid).clip(1, max(1, len(t) - 1))
    if len(t) > 1:
        apart = t[after] - t[after - 1] > GAP
        # A row that lies on the grid is there, whatever is missing beside it.
        found[apart & (grid != t[after]) & (grid != t[after - 1])] = np.nan
    return found


def session_file(path: Path) -> Path:
    """Return a path; of a folder, as `cohaptic.record` makes one, the only session file in it.

    Raises:
        SettingError: The folder has none, or several.
    """
    if not path.is_dir():
        return path
    found = sorted(path.glob("*.mcap"))
    if len(found) == 1:
        return found[0]
    names = ", ".join(one.name for one in found[:5]) or "none"
    raise SettingError("session", path, f"a file, or a folder with one session file, not {names}")


def read_session(
    path: Path | str,
    start: float | None = None,
    end: float | None = None,
    columns: Collection[str] | None = None,
    progress: Progress = lambda phase, fraction: None,
) -> Session:
    """Read a session file into memory.

    A minute of one user takes 13 MB with all columns of the rows, and 3 MB with tip and force.

    Args:
        path: Path of the file, also of one whose process was killed; or of a folder with one file.
        start: Earliest time [s]; None for the first.
        end: Time before which the entries are [s]; None for all.
        columns: Columns of the rows to keep besides time and user; None for all.
        progress: Called with `reading` and the fraction of the file that was read,
            at most 500 times.

    Raises:
        SettingError: The file cannot be read, or holds no session; a column has an unknown name; or
            pandas is not installed.
    """
    pd = library("pandas")
    path = session_file(Path(path))
    for name in columns or ():
        if name not in COLUMNS and not name.startswith("by_"):
            raise SettingError("columns", name, f"one of {', '.join(COLUMNS)}")
    outline = Outline.of(path)  # who was there, also before the times that are asked for
    found = _Gathered(wanted=None if columns is None else set(columns))
    shown = 0.0
    for entry in read_entries(path, start, end):
        found.add(entry)
        if (fraction := (entry.t - outline.first) / max(outline.seconds, 1e-9)) > shown:
            progress("reading", min(1.0, fraction))
            shown = fraction + _SHOWN
    return Session(
        info=outline.info,
        users=outline.users,
        rows=found.rows_table(pd),
        patches=_table(pd, found.patches, _PATCH),
        marks=_table(pd, found.marks, {"t": "s", "error": "s", "text": "", "by": "1"}),
        events=_table(pd, found.events, {"t": "s", "kind": "", "user": "1", "text": ""}),
        links=_table(
            pd,
            found.links,
            dict.fromkeys(("t", "round_trip", "jitter", "clock_offset", "clock_error"), "s")
            | {"user": "1"},
        ),
        lost=_table(pd, found.lost, {"t": "s", "user": "1", "count": "1", "what": ""}),
    )


def _table(pd: Any, records: list[dict[str, Any]], units: Mapping[str, str]) -> Table:
    """Return records as a table, which has the columns with units also if there is no record."""
    names = list(units) + [
        name for name in dict.fromkeys(name for each in records for name in each) if
        name not in units
    ]  # fmt: skip
    table = pd.DataFrame(records, columns=names)
    table.attrs["units"] = dict(units)
    return table


@dataclass
class _Block:
    """Rows of one user with the same columns: times of the client, offset, and the numbers."""

    t: Floats
    to_server: float
    numbers: dict[str, npt.NDArray[Any]]


@dataclass
class _Gathered:
    """What was read so far."""

    wanted: set[str] | None
    blocks: dict[int, list[_Block]] = field(default_factory=dict[int, list[_Block]])
    patches: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    marks: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    events: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    links: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    lost: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])

    # Above 60 lines: one case for each kind of entry.
    def add(self, entry: Entry) -> None:
        match entry:
            case Rows():
                self._add_rows(entry)
            case Patched():
                self.patches.append(_patch_record(entry))
            case Mark():
                error = math.nan if entry.error is None else entry.error
                record = {"t": entry.t, "error": error, "text": entry.text, "by": entry.by or 0}
                fields = {f"field.{name}": value for name, value in entry.fields.items()}
                self.marks.append(record | fields)
            case Happened():
                self._event(entry.t, entry.kind, entry.user or 0, entry.text)
            case Joined():
                self._event(entry.t, "joined", entry.user, f"{entry.name} joined")
            case Left():
                self._event(entry.t, "left", entry.user, entry.reason)
            case LawSet():
                self._event(entry.t, "law", entry.user, str(entry.change.get("law", "")))
            case Restrained():
                held = ["frozen"] if entry.frozen else []
                held += [f"user {user} muted" for user in entry.muted]
                self._event(entry.t, "restrained", 0, ", ".join(held) or "free")
            case BudgetSet():
                force = "no limit" if entry.force is None else f"{entry.force:g} N"
                self._event(entry.t, "budget", 0, force)
            case BodyReset():
                self._event(entry.t, "reset", 0, "the body returns to its initial state")
            case Link():
                self.links.append(
                    {
                        "t": entry.t,
                        "user": entry.user,
                        "round_trip": entry.round_trip,
                        "jitter": entry.jitter,
                        "clock_offset": entry.clock_offset,
                        "clock_error": entry.clock_error,
                    }
                )
            case RowsLost():
                self._lost(entry.t, entry.user, entry.count, ROWS_LOST)
            case LeftOut():
                self._lost(entry.t, 0, entry.count, ENTRIES_LOST)
            case Damage():
                self._lost(entry.t, 0, 0, CUT_SHORT if entry.cut_short else DAMAGED)
            case _:
                pass

    def _event(self, t: float, kind: str, user: int, text: str) -> None:
        self.events.append({"t": t, "kind": kind, "user": user, "text": text})

    def _lost(self, t: float, user: int, count: int, what: str) -> None:
        self.lost.append({"t": t, "user": user, "count": count, "what": what})

    def _add_rows(self, rows: Rows) -> None:
        table = table_of(rows)
        if not len(table):
            return
        numbers = {
            name: table[:, i].astype("f8" if name in EXACT else "f4")
            for i, name in enumerate(rows.columns)
            if i and (self.wanted is None or name in self.wanted)
        }
        block = _Block(table[:, 0].copy(), rows.to_server, numbers)
        self.blocks.setdefault(rows.user, []).append(block)

    def rows_table(self, pd: Any) -> Table:
        """Return the rows of all users; each user's blocks are let go as soon as they are there."""
        tables = list[Table]()
        for user in sorted(self.blocks):
            blocks = self.blocks.pop(user)
            names = dict.fromkeys(name for block in blocks for name in block.numbers)
            t_client = np.concatenate([block.t for block in blocks])
            data: dict[str, Any] = {
                "t": _on_server(blocks),
                "user": np.full(len(t_client), user, np.int32),
                "t_client": t_client,
            }
            for name in names:
                missing = np.float32(np.nan)
                data[name] = np.concatenate(
                    [
                        block.numbers.get(name, np.full(len(block.t), missing)) for block in blocks
                    ]
                )  # fmt: skip
            # Two blocks may have come in another order, and a clock is corrected now and then.
            order = np.argsort(data["t"], kind="stable")
            tables.append(pd.DataFrame({name: values[order] for name, values in data.items()}))
        wanted = COLUMNS[1:] if self.wanted is None else [n for n in COLUMNS if n in self.wanted]
        if not tables:
            tables = [pd.DataFrame({n: np.empty(0) for n in ("t", "user", "t_client", *wanted)})]
        table = pd.concat(tables, ignore_index=True)
        table.attrs["units"] = {name: unit_of(name) for name in table.columns}
        return table


def _on_server(blocks: list[_Block]) -> Floats:
    """Return the times of a user's rows on the server's clock, shape (rows,) [s].

    Each block has the offset of the clocks as it was known at its first row. In between the offset
    is interpolated, so that a better estimate of it makes no step in the times.
    """
    t = np.concatenate([block.t for block in blocks])
    known = sorted((float(block.t[0]), block.to_server) for block in blocks)
    known = [(at, offset) for at, offset in known if math.isfinite(offset)]
    if not known:
        return t
    at, offset = np.array(known).T
    return np.asarray(t + np.interp(t, at, offset), dtype=np.float64)


def _patch_record(entry: Patched) -> dict[str, Any]:
    """Return a patch as a row of numbers; one of another version only with its size."""
    record: dict[str, Any] = {
        "t": entry.t, "tick": entry.tick, "user": entry.user, "bytes": len(entry.frame),
    }  # fmt: skip
    try:
        patch = Patch.decode(entry.frame)
    except RemoteProtocolError:
        return record
    vectors: tuple[tuple[str, Callable[[Patch], Any]], ...] = (
        ("", lambda p: p.x_free), ("n", lambda p: p.normal), ("f", lambda p: p.own_force),
    )  # fmt: skip
    for prefix, of in vectors:
        record |= zip((f"{prefix}{axis}" for axis in "xyz"), of(patch), strict=True)
    return record | {
        "seq": patch.seq,
        "t_client": patch.t_client,
        "sample_wait": patch.sample_wait,
        "curvature": patch.curvature,
        "c_ii": patch.c_ii,
        "k_h": patch.k_h,
        "lag": patch.room.lag,
    }


read = read_session  # for `cohaptic.read("s01")`
