"""A session as files of other programs: Parquet, CSV, HDF5, or a data set of BIDS Motion.

An export is whole or not there, and replaces nothing.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import secrets
import shutil
from collections.abc import Generator, Mapping
from pathlib import Path
from typing import Any, Literal

from cohaptic.errors import OutputError, SettingError, one_line
from cohaptic.runtime.new_file import name_beside, real, write_new
from cohaptic.sessions.bids import write_bids
from cohaptic.sessions.tables import (
    CUT_SHORT,
    DAMAGED,
    ENTRIES_LOST,
    ROWS_LOST,
    Progress,
    Session,
    Table,
    library,
    read_session,
)

Form = Literal["parquet", "csv", "hdf5", "bids"]
FORMS: tuple[Form, ...] = ("parquet", "csv", "hdf5", "bids")
TABLES = ("rows", "patches", "marks", "events", "links", "lost")


def export_session(
    path: Path | str,
    out: Path | str,
    to: Form = "parquet",
    progress: Progress = lambda phase, fraction: None,
) -> Path:
    """Write a session for other programs.

    Args:
        path: Path of the session file.
        out: Path of the folder to make, or with `hdf5` of the file.
        to: `parquet` or `csv`: a folder with a file for each table of `Session`, and `session.json`
            with what holds for all and the units of the columns. `hdf5`: one file, with a group for
            each table and in it a data set for each column, with its `units` as attribute. `bids`:
            a data set of BIDS Motion, with each person as a participant.
        progress: Called with `reading` or `writing`, and the finished fraction of this phase.

    Returns:
        The path of what was written.

    Raises:
        SettingError: The session cannot be read, the form is unknown, something has the name of
            `out`, or a library is missing.
        OutputError: The files cannot be written; none of them remain.
    """
    return export_and_tell(path, out, to, progress)[0]


def export_and_tell(
    path: Path | str, out: Path | str, to: Form, progress: Progress
) -> tuple[Path, str]:
    """Write a session as `export_session` does; return the path, and what `missing` says of it.

    Raises:
        SettingError: As for `export_session`.
        OutputError: As for `export_session`.
    """
    if to not in FORMS:
        raise SettingError("to", to, f"one of {', '.join(FORMS)}")
    path, out = Path(path), real(Path(out))
    if out.exists():
        raise SettingError("out", out, "a name that nothing has yet")
    if to == "parquet":
        library("pyarrow")
    if to == "hdf5":
        library("h5py")
    session = read_session(path, progress=progress)
    progress("writing", 0.0)
    if to == "hdf5":
        content = _hdf5(session)
        write_new(out, lambda file: file.write(content), overwrite=False)
        return out, missing(session)
    with _folder_beside(out) as folder:
        if to == "bids":
            write_bids(session, folder)
        else:
            _write_tables(session, folder, to)
        # Not even an empty folder that appeared meanwhile is replaced, as far as can be seen.
        if out.exists():
            raise SettingError("out", out, "a name that nothing has yet")
        folder.rename(out)
    return out, missing(session)


def missing(session: Session) -> str:
    """Return a sentence on what the file of a session lacks; empty if that is nothing."""
    lost, found = session.lost, list[str]()
    of_users = lost[lost["what"] == ROWS_LOST].groupby("user")["count"].sum()
    for user, count in of_users.items():
        found.append(f"{count} rows of {one_line(session.users.get(user, f'user {user}'))}")
    if entries := lost[lost["what"] == ENTRIES_LOST]["count"].sum():
        found.append(f"{entries} entries, for which the disk was too slow")
    if damaged := (lost["what"] == DAMAGED).sum():
        found.append("a damaged stretch" if damaged == 1 else f"{damaged} damaged stretches")
    cut = lost[lost["what"] == CUT_SHORT]["t"]
    if len(cut):
        after = max(0.0, float(cut.iloc[0]) - session.info.t)
        found.append(f"all from {after:.1f} s after its beginning on, since it was cut short")
    return f"the file lacks {'; '.join(found)}" if found else ""


@contextlib.contextmanager
def _folder_beside(out: Path) -> Generator[Path, None, None]:
    """Make a folder beside a path, and remove it at the end if it still has its name.

    Raises:
        OutputError: It, or a file in it, cannot be written.
    """
    folder = out.with_name(f"{name_beside(out)}.{secrets.token_hex(4)}.tmp")
    try:
        folder.mkdir()
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    except OSError as error:
        raise OutputError(out, f"it cannot be written ({error.strerror or error})") from error


def about(session: Session) -> dict[str, Any]:
    """Return what holds for all of a session as JSON, with the units of the tables' columns."""
    units = {name: getattr(session, name).attrs["units"] for name in TABLES}
    users = {str(user): name for user, name in session.users.items()}
    return {
        "session": dataclasses.asdict(session.info),
        "users": users,
        "units": units,
        "clock": "times t are on the server's clock [s]; Unix time is t + to_wall",
    }


def _write_tables(session: Session, folder: Path, form: str) -> None:
    for name in TABLES:
        table = _plain(getattr(session, name))
        if form == "parquet":
            table.to_parquet(folder / f"{name}.parquet", engine="pyarrow", index=False)
        else:
            # 9 digits hold 32 bits; columns of 64 bits get all of their digits by default.
            table.to_csv(folder / f"{name}.csv", index=False)
    text = json.dumps(about(session), indent=2)
    (folder / "session.json").write_text(f"{text}\n", encoding="utf-8")


def _plain(table: Table) -> Table:
    """Return a table whose columns have one type each: values of marks can be anything."""
    table = table.copy(deep=False)
    for name in table.columns:
        if table[name].dtype == object:
            table[name] = [_text(value) for value in table[name]]
    return table


def _text(value: Any) -> str | None:
    if isinstance(value, str) or value is None or value != value:
        return value if isinstance(value, str) else None
    return json.dumps(value)


def _hdf5(session: Session) -> bytes:
    """Return the content of an HDF5 file.

    It is made in memory: on a full disk the library could not even close a file.
    """
    h5py = library("h5py")
    with h5py.File("session", "w", driver="core", backing_store=False) as file:
        file.attrs["about"] = json.dumps(about(session))
        file.attrs["to_wall"] = session.info.to_wall
        for name in TABLES:
            table = _plain(getattr(session, name))
            group = file.create_group(name)
            group.attrs["columns"] = list(map(str, table.columns))
            units: Mapping[str, str] = table.attrs["units"]
            for column in table.columns:
                made = _data_set(h5py, group, _link(str(column), group), table[column])
                made.attrs["units"] = units.get(column, "")
        file.flush()
        content: bytes = file.id.get_file_image()
    return content


def _data_set(h5py: Any, group: Any, name: str, values: Any) -> Any:
    """Make the data set of a column: numbers as they are, and all else as texts."""
    if values.dtype.kind not in "biuf":
        texts = [value if isinstance(value, str) else "" for value in values]
        return group.create_dataset(name, data=texts, dtype=h5py.string_dtype(), shape=len(texts))
    numbers = values.to_numpy()
    if not len(numbers):
        return group.create_dataset(name, data=numbers)
    return group.create_dataset(name, data=numbers, compression="gzip", shuffle=True)


def _link(column: str, group: Any) -> str:
    """Return a column's name as HDF5 can have it: a slash would make a group, a dot is itself."""
    name = column.replace("/", "_").replace("\0", "_").strip(".") or "_"
    while name in group:
        name += "_"
    return name
