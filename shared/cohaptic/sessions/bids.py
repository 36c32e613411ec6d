"""A session as a data set of BIDS Motion: one participant for each person, one run for each visit.

After the specification of BIDS 1.9, "Motion" (modality `motion`, tracking system `cohaptic`). Rows
are not resampled: a channel LATENCY has the time of each row since the first, as the specification
has it for samples that are not evenly spaced. `participants.tsv` has the names that people had in
the room, and their numbers; `scans.tsv` has for each run the number, the Unix time by which runs
are aligned, and the bound on the error of the clocks.
"""

from __future__ import annotations

import datetime
import inspect
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cohaptic.recording.why import ENTRIES, SPENT, TICK
from cohaptic.sessions.tables import Session, Table, unit_of
from cohaptic.status.row import COLUMNS, Row

VERSION = "1.9.0"  # of BIDS
LOOP_HZ = 1000.0  # nominal rate of a haptic loop [Hz]
TASK, SYSTEM = "touch", "cohaptic"
_HIDDEN = ("t", "user", "t_client")  # columns that no channel has
_MISSING = "n/a"
_FIELD = "field."  # begins the names of the columns that marks have of their own
_PEOPLE: Mapping[str, Any] = {
    "name": {"Description": "Name in the room; remove this column where it must not be known"},
    "users": {"Description": "Numbers in the room, one for each visit, in order"},
}
_SCANS: Mapping[str, Any] = {
    "acq_time": {"Description": "Time of the first row, in UTC"},
    "user": {"Description": "Number in the room, which is that of the session file"},
    "clock_error": {
        "Description": "Largest bound on the error of the times, against those of other runs",
        "Units": "s",
    },
}
_EVENTS: Mapping[str, Any] = {
    "onset": {"Description": "Time since the first row of the run", "Units": "s"},
    "trial_type": {"Description": "`mark` for a mark, or the kind of an event"},
    "value": {"Description": "Text of the mark or event; it may name people"},
    "error": {
        "Description": "Bound on the error of the mark's time that its sender knew",
        "Units": "s",
    },
}


@dataclass(frozen=True, slots=True)
class _Run:
    """One visit of a person.

    Args:
        participant: Label of the person, as "01".
        number: Number of the visit among the person's own; 0 if there is one only.
        user: Number of the user in the room.
        name: Name in the room.
        rows: Rows of the visit.
    """

    participant: str
    number: int
    user: int
    name: str
    rows: Table

    @property
    def stem(self) -> str:
        """Begin of the names of its files, up to the tracking system."""
        return f"sub-{self.participant}_task-{TASK}"

    @property
    def run(self) -> str:
        """Part of the names of its files that tells visits apart."""
        return f"_run-{self.number:02d}" if self.number else ""

    @property
    def motion(self) -> str:
        """Begin of the names of its files about motion."""
        return f"{self.stem}_tracksys-{SYSTEM}{self.run}"


def write_bids(session: Session, folder: Path) -> None:
    """Write a session as a data set.

    Args:
        session: The session.
        folder: Empty folder.

    Raises:
        OSError: A file cannot be written.
    """
    runs = _runs(session)
    _write_json(
        folder / "dataset_description.json",
        {
            "Name": f"cohaptic: {session.info.room or 'a session'}",
            "BIDSVersion": VERSION,
            "DatasetType": "raw",
            "GeneratedBy": [{"Name": "cohaptic", "Version": session.info.version}],
        },
    )
    (folder / "README").write_text(_README, encoding="utf-8")
    labels = {run.participant: run.name for run in runs}
    _write_tsv(
        folder / "participants.tsv",
        ("participant_id", *_PEOPLE),
        [
            (
                f"sub-{label}",
                name,
                ",".join(str(run.user) for run in runs if run.participant == label),
            )
            for label, name in labels.items()
        ],
    )
    _write_json(folder / "participants.json", _PEOPLE)
    for run in runs:
        place = folder / f"sub-{run.participant}" / "motion"
        place.mkdir(parents=True, exist_ok=True)
        _write_run(session, run, place)
    for label in labels:
        scans = [
            (
                f"motion/{run.motion}_motion.tsv",
                _wall(session, float(run.rows["t"].iloc[0])),
                str(run.user),
                _clock_error(session, run.user),
            )
            for run in runs
            if run.participant == label
        ]
        path = folder / f"sub-{label}" / f"sub-{label}_scans"
        _write_tsv(path.with_suffix(".tsv"), ("filename", *_SCANS), scans)
        _write_json(path.with_suffix(".json"), _SCANS)


def _runs(session: Session) -> list[_Run]:
    """Return the visits with rows; people are told apart by their names in the room."""
    visits: dict[str, list[tuple[int, Table]]] = {}
    for user, rows in session.rows.groupby("user", sort=True):
        name = session.users.get(int(user), f"user {user}")
        visits.setdefault(name, []).append((int(user), rows))
    return [
        _Run(f"{place:02d}", number if len(each) > 1 else 0, user, name, rows)
        for place, (name, each) in enumerate(visits.items(), start=1)
        for number, (user, rows) in enumerate(each, start=1)
    ]


def _clock_error(session: Session, user: int) -> str:
    """Return the largest bound on the error of a user's clock [s], as a cell."""
    links = session.links
    errors = links["clock_error"][links["user"] == user].to_numpy(float)
    return _value(float(errors.max())) if len(errors) else _MISSING


def _write_run(session: Session, run: _Run, place: Path) -> None:
    table = run.rows
    latency = table["t"].to_numpy() - float(table["t"].iloc[0])
    names = [name for name in table.columns if name not in _HIDDEN and table[name].notna().any()]
    channels: list[tuple[str, ...]] = [
        ("latency", "n/a", "LATENCY", "n/a", "s", "n/a", "Time since the first row")
    ]
    described = dict(_descriptions())
    channels += [_channel(name, described) for name in names]
    motion = table[names].astype(float).replace([np.inf, -np.inf], np.nan)
    motion.insert(0, "latency", latency)
    motion.to_csv(
        place / f"{run.motion}_motion.tsv", sep="\t", header=False, index=False, na_rep=_MISSING,
        float_format="%.9g",
    )  # fmt: skip
    _write_tsv(
        place / f"{run.motion}_channels.tsv",
        ("name", "component", "type", "tracked_point", "units", "reference_frame", "description"),
        channels,
    )
    _write_json(
        place / f"{run.motion}_channels.json",
        {
            "tracked_point": {
                "Description": "What is tracked",
                "Levels": {"tip": f"Tip of the device of user {run.user}"},
            },
            "reference_frame": {
                "Description": "Frame of the room, in which the object rests",
                "Levels": {"room": {"RotationRule": "right-hand"}},
            },
        },
    )
    _write_json(place / f"{run.motion}_motion.json", _sidecar(session, latency, channels))
    _write_events(session, run, place)


def _channel(name: str, described: Mapping[str, str]) -> tuple[str, ...]:
    """Return the row of a channel in `channels.tsv`."""
    words = described.get(name)
    if words is None and name.startswith("by_"):
        words = f"What the rule `{name.removeprefix('by_')}` of another package added"
    words = words or f"Column {name} of a row of cohaptic"
    if name in ("x", "y", "z"):
        return (f"tip_{name}", name, "POS", "tip", "m", "room", words)
    if name in ("fx", "fy", "fz"):
        axis = name[1]
        return (f"force_{axis}", axis, "MISC", "tip", "N", "room", words)
    unit = unit_of(name)
    return (name, "n/a", "MISC", "tip", "n/a" if unit == "1" else unit, "n/a", words)


def _descriptions() -> Iterator[tuple[str, str]]:
    """Yield columns of rows, each with what it is, as the text of `Row` has it.

    Python without docstrings (`-OO`) has none.
    """
    text = inspect.getdoc(Row) or ""
    fields = text.partition("Fields:\n")[2]
    for part in re.split(r"\n(?= {4}\S)", fields):
        names, _, words = " ".join(part.split()).partition(": ")
        words = re.sub(r" \[[^]]*\]", "", words).rstrip(".")
        first, _, last = names.partition(" ... ")
        if last:  # of the rules of a ledger, each of which has words of its own, too
            for name in COLUMNS[COLUMNS.index(first) : COLUMNS.index(last) + 1]:
                rule = (ENTRIES | SPENT | TICK).get(name, "")
                yield name, f"{words.partition('. ')[0]}. This: {rule}" if rule else words
        else:
            for name in names.split(", "):
                yield name, words


def _sidecar(session: Session, latency: Any, channels: Sequence[tuple[str, ...]]) -> dict[str, Any]:
    """Return the metadata of a run's motion."""
    duration = float(latency[-1]) if len(latency) else 0.0
    effective = (len(latency) - 1) / duration if duration > 0.0 else None
    kinds = [kind for _, _, kind, *_ in channels]
    counts = {f"{kind}ChannelCount": kinds.count(kind) for kind in ("POS", "MISC", "LATENCY")}
    found: dict[str, Any] = {
        "TaskName": TASK,
        "TaskDescription": "People touch one soft object and feel each other through it",
        "TrackingSystemName": SYSTEM,
        "SamplingFrequency": LOOP_HZ,
        "RecordingType": "continuous",
        "RecordingDuration": round(duration, 6),
        "MotionChannelCount": len(channels),
        "TrackedPointsCount": 1,
        "MissingValues": _MISSING,
        "SoftwareVersions": f"cohaptic {session.info.version}",
        **counts,
    }
    if effective is not None and math.isfinite(effective):
        found["SamplingFrequencyEffective"] = round(effective, 3)
    return found


def _write_events(session: Session, run: _Run, place: Path) -> None:
    """Write marks and events within a run, with their times since its first row."""
    first, last = float(run.rows["t"].iloc[0]), float(run.rows["t"].iloc[-1])
    own = [name for name in session.marks.columns if name.startswith(_FIELD)]
    empty = [_MISSING] * (1 + len(own))
    found = [
        (float(t), kind, text, empty)
        for t, kind, text in session.events[["t", "kind", "text"]].itertuples(index=False)
    ]
    found += [
        (float(t), "mark", text, [_value(value) for value in more])
        for t, text, *more in session.marks[["t", "text", "error", *own]].itertuples(index=False)
    ]
    rows = [
        (f"{t - first:.6f}", "0", kind, text, *more)
        for t, kind, text, more in sorted(found, key=lambda each: each[:3])
        if first <= t <= last
    ]
    columns = _columns_of(own)
    name = f"{run.stem}{run.run}_events"
    header = ("onset", "duration", "trial_type", "value", "error", *columns)
    _write_tsv(place / f"{name}.tsv", header, rows)
    fields = {
        column: {"Description": f"Field `{field.removeprefix(_FIELD)}` of a mark"}
        for column, field in columns.items()
    }
    _write_json(place / f"{name}.json", {**_EVENTS, **fields})


def _columns_of(fields: Sequence[str]) -> dict[str, str]:
    """Return fields of marks by columns, each with a name that a table can have once."""
    found = dict[str, str]()
    for field in fields:
        name = _cell(field)
        while name in found:
            name += "_"
        found[name] = field
    return found


def _value(value: Any) -> str:
    """Return a value of a mark as a cell; whole numbers have no point, and nothing is n/a."""
    if isinstance(value, str):
        return value
    if value is None or value != value:
        return _MISSING
    if isinstance(value, float):
        return f"{value:.15g}"
    return json.dumps(value.item() if isinstance(value, np.generic) else value)


def _wall(session: Session, t: float) -> str:
    """Return the time of day of a time of the server's clock, in UTC."""
    try:
        wall = datetime.datetime.fromtimestamp(t + session.info.to_wall, datetime.UTC)
    except (OverflowError, ValueError, OSError):  # a clock that was never set
        return _MISSING
    return f"{wall:%Y-%m-%dT%H:%M:%S.%f}Z"


def _write_json(path: Path, value: Mapping[str, Any]) -> None:
    path.write_text(f"{json.dumps(value, indent=2)}\n", encoding="utf-8")


def _write_tsv(path: Path, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    lines = ["\t".join(_cell(cell) for cell in row) for row in (header, *rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _cell(text: str) -> str:
    """Return a text as a cell: without what ends a cell or a line, and not empty."""
    return " ".join(str(text).split()) or _MISSING


_README = """A session of cohaptic: several people touch one soft object over a network, each with a
haptic device, and feel each other through it. `motion` has for each person the tip of the device
and the force given to the hand at the rate of the haptic loop, about 1 kHz, and in further channels
what the program computed. Lengths are in metres, forces in newtons, times in seconds. Runs of
different people are aligned by `acq_time` in the `scans.tsv` of each and by the channel `latency`.
"""
