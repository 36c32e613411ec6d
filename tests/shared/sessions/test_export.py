from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic import export_session, read_session
from cohaptic.errors import OutputError, SettingError
from cohaptic.recording.why import ENTRIES
from cohaptic.sessions.bids import write_bids
from cohaptic.sessions.entries import Joined, Link, Mark, Written
from cohaptic.sessions.export import FORMS, TABLES, Form
from cohaptic.sessions.tables import library
from cohaptic.status.row import COLUMNS
from tests.shared.sessions.made import T, rows, session, write
from tests.small_disk import small_disk

# Their types, where they have some, leave most of what is read unknown.
pd, h5py, parquet = library("pandas"), library("h5py"), library("pyarrow.parquet")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return write(tmp_path / "x.mcap", session(2.0))


def same(one: Any, other: Any) -> bool:
    """Whether columns hold the same; nothing is the same as nothing in every form."""

    def nothing(value: Any) -> bool:
        return bool(pd.isna(value)) or value == ""

    pairs = zip(one, other, strict=True)
    return all(a == b or (nothing(a) and nothing(b)) for a, b in pairs)


def test_parquet_files_hold_the_tables(path: Path, tmp_path: Path) -> None:
    out = export_session(path, tmp_path / "out", "parquet")
    session_read = read_session(path)
    for name in TABLES:
        table, found = getattr(session_read, name), pd.read_parquet(out / f"{name}.parquet")
        assert list(found.columns) == list(table.columns)
        for column in table.columns:
            assert same(found[column], table[column]), (name, column)
    stored = parquet.read_table(out / "rows.parquet").schema
    assert str(stored.field("x").type) == "float"
    assert str(stored.field("t").type) == "double"
    about = json.loads((out / "session.json").read_text())
    assert about["units"]["rows"]["fz"] == "N"
    assert about["session"]["room"] == "lab"
    assert about["users"] == {"1": "u1", "2": "u2"}


def test_csv_files_hold_the_tables(path: Path, tmp_path: Path) -> None:
    out = export_session(path, tmp_path / "out", "csv")
    session_read = read_session(path)
    for name in TABLES:
        table, found = getattr(session_read, name), pd.read_csv(out / f"{name}.csv")
        assert list(found.columns) == list(table.columns)
        for column in table.columns:
            if table[column].dtype.kind == "f":
                values = found[column].to_numpy(float)
                assert values == pytest.approx(table[column].to_numpy(float), nan_ok=True)
            else:
                assert same(found[column], table[column]), (name, column)
    assert pd.read_csv(out / "rows.csv")["t"].tolist() == session_read.rows["t"].tolist()


def test_an_hdf5_file_holds_the_tables_with_units(path: Path, tmp_path: Path) -> None:
    out = export_session(path, tmp_path / "out.h5", "hdf5")
    session_read = read_session(path)
    with h5py.File(out) as file:
        assert json.loads(file.attrs["about"])["users"] == {"1": "u1", "2": "u2"}
        assert file["rows/fz"].attrs["units"] == "N"
        for name in TABLES:
            table = getattr(session_read, name)
            assert list(file[name].attrs["columns"]) == list(table.columns)
            for column in table.columns:
                values = file[name][column][()]
                if values.dtype.kind == "O":
                    values = [value.decode() for value in values]
                assert same(values, table[column]), (name, column)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["out.h5", "x.mcap"]


def returning(path: Path) -> Path:
    """Ann comes twice, and Bob once; two marks fall into Ann's second visit."""
    entries: list[Written] = [
        Joined(T, 1, "ann", {}, 10.0), Joined(T, 2, "bob", {}, 10.0), rows(T, 400, 1),
        rows(T + 0.1, 1000, 2), Joined(T + 0.6, 3, "ann", {}, 10.0), rows(T + 0.7, 300, 3),
        Mark(T + 0.8, "go\tnow", {"trial": 3, "side": "left"}, error=0.002),
        Mark(T + 0.9, "stop", {"valid": True}),
        Link(T + 0.1, 1, 0.02, 0.001, 40.0, 1e-4), Link(T + 0.3, 1, 0.02, 0.001, 40.0, 3e-4),
        Link(T + 0.8, 3, 0.02, 0.001, 40.0, 2e-4),
    ]  # fmt: skip
    return write(path, sorted(entries, key=lambda entry: entry.t))


def test_a_bids_data_set_has_a_participant_for_each_person(tmp_path: Path) -> None:
    out = export_session(returning(tmp_path / "x.mcap"), tmp_path / "out", "bids")
    names = sorted(str(each.relative_to(out)) for each in out.rglob("*") if each.is_file())
    ann, bob = "sub-01_task-touch", "sub-02_task-touch"
    kinds = ("channels.json", "channels.tsv", "motion.json", "motion.tsv")
    assert names == sorted(
        [
            "README", "dataset_description.json", "participants.json", "participants.tsv",
            *(f"sub-{n}/sub-{n}_scans.{k}" for n in ("01", "02") for k in ("tsv", "json")),
            *(f"sub-01/motion/{ann}_tracksys-cohaptic_run-0{n}_{k}" for n in (1, 2) for k in kinds),
            *(f"sub-01/motion/{ann}_run-0{n}_events.{k}" for n in (1, 2) for k in ("tsv", "json")),
            *(f"sub-02/motion/{bob}_tracksys-cohaptic_{k}" for k in kinds),
            *(f"sub-02/motion/{bob}_events.{k}" for k in ("tsv", "json")),
        ]
    )  # fmt: skip
    people = pd.read_csv(out / "participants.tsv", sep="\t", dtype=str)
    assert list(people.columns) == ["participant_id", "name", "users"]
    assert people.to_numpy().tolist() == [["sub-01", "ann", "1,3"], ["sub-02", "bob", "2"]]


def test_each_run_of_a_bids_data_set_has_its_user_and_the_error_of_its_clock(
    tmp_path: Path,
) -> None:
    out = export_session(returning(tmp_path / "x.mcap"), tmp_path / "out", "bids")
    scans = [
        pd.read_csv(out / f"sub-0{n}" / f"sub-0{n}_scans.tsv", sep="\t", keep_default_na=False)
        for n in (1, 2)
    ]
    found = [each[["user", "clock_error"]].astype(str).to_numpy().tolist() for each in scans]
    assert found == [[["1", "0.0003"], ["3", "0.0002"]], [["2", "n/a"]]]
    tracked = {
        each["tracked_point"]["Levels"]["tip"]
        for each in map(json.loads, (p.read_text() for p in out.rglob("*_channels.json")))
    }
    # Names are in one column of one file, which can be taken out.
    assert tracked == {f"Tip of the device of user {number}" for number in (1, 2, 3)}


def test_every_column_of_a_bids_table_is_described_beside_it(tmp_path: Path) -> None:
    out = export_session(returning(tmp_path / "x.mcap"), tmp_path / "out", "bids")
    known = {"participant_id", "filename", "duration"}  # as the specification has them
    tables = [p for kind in ("participants", "scans", "events") for p in out.rglob(f"*{kind}.tsv")]
    assert len(tables) == 6
    for table in tables:
        names = table.read_text().splitlines()[0].split("\t")
        assert len(set(names)) == len(names)
        assert set(json.loads(table.with_suffix(".json").read_text())) == set(names) - known


def test_names_of_fields_that_no_table_can_have_become_ones_that_it_can(tmp_path: Path) -> None:
    fields = {"": 1, "a b": 2.5, "a\tb": None, "c": [1, {"d": False}]}
    path = write(tmp_path / "x.mcap", [rows(T, 400), Mark(T + 0.1, "go", fields)])
    folder = tmp_path / "out"
    folder.mkdir()
    write_bids(read_session(path), folder)
    [events] = folder.rglob("*_events.tsv")
    lines = [line.split("\t") for line in events.read_text().splitlines()]
    assert lines[0][4:] == ["error", "field.", "field.a b", "field.a b_", "field.c"]
    assert lines[1][4:] == ["n/a", "1", "2.5", "n/a", '[1, {"d": false}]']


def test_channels_are_described_as_a_row_describes_them(tmp_path: Path) -> None:
    columns = tuple("by_hunt" if name == "by_rule_1" else name for name in COLUMNS)
    path = write(tmp_path / "x.mcap", [rows(T, 10, columns=columns)])
    out = export_session(path, tmp_path / "out", "bids")
    [channels] = out.rglob("*_channels.tsv")
    table = pd.read_csv(channels, sep="\t", keep_default_na=False).set_index("name")["description"]
    assert not any("of a row of cohaptic" in words for words in table)
    assert table["tip_x"] == "Position of the probe"
    assert table["wanted"] == "Normal force that the law computed, before the safety layer"
    assert table["by_law"].endswith("its size. This: " + ENTRIES["by_law"])
    assert table["by_hunt"] == "What the rule `hunt` of another package added"


def test_motion_of_a_bids_data_set_is_what_its_channels_and_metadata_say(tmp_path: Path) -> None:
    out = export_session(returning(tmp_path / "x.mcap"), tmp_path / "out", "bids")
    base = out / "sub-01" / "motion" / "sub-01_task-touch_tracksys-cohaptic_run-02"
    channels = pd.read_csv(f"{base}_channels.tsv", sep="\t", keep_default_na=False)
    motion = pd.read_csv(f"{base}_motion.tsv", sep="\t", header=None, na_values="n/a")
    about = json.loads(Path(f"{base}_motion.json").read_text())
    assert list(channels.columns[:5]) == ["name", "component", "type", "tracked_point", "units"]
    assert motion.shape == (300, len(channels))
    assert about["MotionChannelCount"] == len(channels)
    for kind in ("POS", "MISC", "LATENCY"):
        assert about[f"{kind}ChannelCount"] == (channels["type"] == kind).sum()
    assert about["SamplingFrequency"] == 1000.0
    assert about["SamplingFrequencyEffective"] == pytest.approx(1000.0, rel=1e-3)
    assert {"TaskName", "RecordingDuration", "TrackedPointsCount", "MissingValues"} <= set(about)
    assert about["TaskName"] == "touch"
    motion.columns = pd.Index(channels["name"])
    assert motion["latency"].to_numpy() == pytest.approx(np.arange(300) / 1000.0, abs=1e-6)
    t = 0.7 + np.arange(300) / 1000.0
    assert motion["tip_x"].to_numpy() == pytest.approx(0.3 + 0.01 * np.sin(2 * np.pi * t), abs=1e-6)
    assert motion["patch_age"].isna().sum() == 60  # infinite, which a table cannot say
    places = channels.set_index("name")
    assert tuple(places.loc["tip_y", ["component", "type", "units"]]) == ("y", "POS", "m")
    assert tuple(places.loc["force_z", ["component", "type", "units"]]) == ("z", "MISC", "N")
    events = (out / "sub-01/motion/sub-01_task-touch_run-02_events.tsv").read_text()
    assert [line.split("\t") for line in events.splitlines()] == [
        ["onset", "duration", "trial_type", "value", "error", "field.trial", "field.side",
         "field.valid"],
        ["0.100000", "0", "mark", "go now", "0.002", "3", "left", "n/a"],
        ["0.200000", "0", "mark", "stop", "n/a", "n/a", "n/a", "true"],
    ]  # fmt: skip
    scans = pd.read_csv(out / "sub-01" / "sub-01_scans.tsv", sep="\t")
    for name, when, *_ in scans.to_numpy().tolist():
        assert (out / "sub-01" / name).is_file()
        assert when.startswith("2027-01-15T08:01:40.")
    assert scans["acq_time"].iloc[1].endswith("40.700000Z")


def test_a_session_without_rows_is_exported_too(tmp_path: Path) -> None:
    path = write(tmp_path / "x.mcap", [])
    for form in FORMS:
        assert export_session(path, tmp_path / form, form).exists()


@pytest.mark.parametrize("form", FORMS)
def test_nothing_is_overwritten(path: Path, tmp_path: Path, form: Form) -> None:
    for name in ("file", "folder"):
        (tmp_path / "file").write_text("somebody's")
        (tmp_path / "folder").mkdir(exist_ok=True)
        with pytest.raises(SettingError, match=r"out is .*a name that nothing has yet"):
            export_session(path, tmp_path / name, form)
    assert (tmp_path / "file").read_text() == "somebody's"
    assert list((tmp_path / "folder").iterdir()) == []


@pytest.mark.live
@pytest.mark.parametrize("form", FORMS)
def test_a_full_disk_leaves_no_part_of_an_export(path: Path, tmp_path: Path, form: Form) -> None:
    with small_disk(tmp_path / "disk", "32k") as disk:
        with pytest.raises(OutputError, match="it cannot be written"):
            export_session(path, disk / "out", form)
        assert list(disk.iterdir()) == []


def test_an_unknown_form_and_an_unreadable_file_are_refused(path: Path, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="to is xls; it must be one of parquet, csv"):
        export_session(path, tmp_path / "out", "xls")  # type: ignore[arg-type]
    with pytest.raises(SettingError, match=r"session is .*an MCAP file"):
        export_session(__file__, tmp_path / "out")
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(("form", "library"), [("parquet", "pyarrow"), ("hdf5", "h5py")])
def test_a_missing_library_is_named_before_any_work(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, form: Form, library: str
) -> None:
    broken: Any = None
    monkeypatch.setitem(sys.modules, library, broken)
    with pytest.raises(SettingError, match=rf"the package {library} is not there.*analysis"):
        export_session(path, tmp_path / "out", form)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("form", ["parquet", "csv", "hdf5"])
def test_values_of_marks_of_all_kinds_can_be_exported(tmp_path: Path, form: Form) -> None:
    fields: list[dict[str, Any]] = [
        {"a": 1}, {"a": "text"}, {"a": [1, {"b": None}]}, {"a": None, "c/d": True, "c_d": 1},
        {"": 1.5, ".": 2},
    ]  # fmt: skip
    marks = [Mark(T + i, str(i), each) for i, each in enumerate(fields)]
    path = write(tmp_path / "x.mcap", [*marks, replace(marks[0], by=7)])
    assert export_session(path, tmp_path / "out", form).exists()
