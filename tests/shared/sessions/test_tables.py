from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic import read_session
from cohaptic.errors import SettingError
from cohaptic.sessions.entries import Patched, Rows, Ticked, Written
from cohaptic.sessions.tables import AXES, unit_of
from cohaptic.status.row import COLUMNS
from tests.examples_of_laws import examples
from tests.shared.sessions.made import T, rows, session, write


def test_a_session_is_tables_on_the_clock_of_the_server(tmp_path: Path) -> None:
    found = read_session(write(tmp_path / "x.mcap", session()))
    assert found.users == {1: "u1", 2: "u2"}
    assert found.info.room == "lab"
    for user, group in found.rows.groupby("user"):
        assert len(group) == 50 * 55
        assert group["t"].to_numpy() == pytest.approx(T + np.arange(2750) / 1000.0, abs=1e-9)
        assert group["t_client"].to_numpy() == pytest.approx(group["t"].to_numpy() - 40.0)
        expected = 0.1 * user + 0.01 * np.sin(2.0 * np.pi * (group["t"].to_numpy() - T))
        assert group["x"].to_numpy() == pytest.approx(expected, abs=1e-7)
        assert group["reason"].iloc[0] == 2.0**31 + 1.0
    assert list(found.rows.columns) == ["t", "user", "t_client", *COLUMNS[1:]]
    assert found.rows.attrs["units"]["fz"] == "N"
    assert found.rows.attrs["units"]["x"] == "m"
    assert found.marks.to_dict("records")[0] == {
        "t": T + 3.0, "error": 0.002, "text": "trial 1", "by": 1, "field.force": 2.5,
        "field.hand": "left",
    }  # fmt: skip
    assert list(found.events["kind"]) == [
        "joined", "joined", "budget", "law", "restrained", "fault", "reset", "budget", "left",
    ]  # fmt: skip
    assert found.links.to_dict("records") == [
        {"t": T + 3.0, "round_trip": 0.02, "jitter": 0.001, "clock_offset": 40.0,
         "clock_error": 1e-4, "user": 1},
    ]  # fmt: skip
    assert [tuple(each) for each in found.lost[["user", "count", "what"]].to_numpy()] == [
        (2, 17, "rows of a client"), (0, 3, "entries"),
    ]  # fmt: skip


def test_patches_are_numbers_and_those_of_another_version_are_there_by_size(
    tmp_path: Path,
) -> None:
    entries = [*session(1.0), Patched(T + 1.0, 99, 1, b"of another version")]
    found = read_session(write(tmp_path / "x.mcap", entries)).patches
    assert len(found) == 41
    assert found["k_h"].iloc[0] == 500.0
    assert tuple(found[["x", "y", "z"]].iloc[0]) == pytest.approx((0.0, 0.0, 0.1))
    assert found["tick"].iloc[-1] == 99
    assert math.isnan(found["k_h"].iloc[-1])
    assert found["bytes"].iloc[-1] == 18


def test_units_are_those_of_a_row() -> None:
    """By the text of `Row`, which names a unit behind each field that has one."""
    assert [unit_of(name) for name in ("x", "fx", "k_h", "late", "tick", "by_law", "scale")] == [
        "m", "N", "N/m", "s", "1", "N", "1",
    ]  # fmt: skip
    from cohaptic.status.row import Row

    text = " ".join((Row.__doc__ or "").split())
    assert "k_o: Stiffness of the object at the contact [N/m]" in text
    for name, unit in (("u_others", "m"), ("indentation", "m"), ("k_h", "N/m"), ("lag", "s")):
        words = text.partition(f" {name}: ")[2].partition(": ")[0]
        assert f"[{unit}]" in words
        assert unit_of(name) == unit


def test_a_part_in_time_and_some_columns_alone_can_be_read(tmp_path: Path) -> None:
    path = write(tmp_path / "x.mcap", session())
    found = read_session(path, T + 1.0, T + 2.0, columns=("x", "fz"))
    assert list(found.rows.columns) == ["t", "user", "t_client", "x", "fz"]
    assert found.rows["t"].min() == pytest.approx(T + 1.0)
    assert found.rows["t"].max() == pytest.approx(T + 1.999)
    assert found.users == {1: "u1", 2: "u2"}
    assert found.info.room == "lab"
    with pytest.raises(SettingError, match="columns is force; it must be one of t, x"):
        read_session(path, columns=("force",))
    with pytest.raises(SettingError, match="columns is without y, z, fx, fy; it must be"):
        found.aligned()


def test_an_empty_session_has_empty_tables_with_all_columns(tmp_path: Path) -> None:
    found = read_session(write(tmp_path / "x.mcap", []))
    assert len(found.rows) == len(found.marks) == len(found.patches) == 0
    assert list(found.rows.columns) == ["t", "user", "t_client", *COLUMNS[1:]]
    assert list(found.marks.columns) == ["t", "error", "text", "by"]
    assert len(found.aligned()) == 0
    assert found.to_xarray().sizes == {"t": 0, "user": 0, "axis": 3}


def test_a_better_estimate_of_the_clocks_makes_no_step_in_the_times(tmp_path: Path) -> None:
    """The offset changes by 2 ms from one block to the next."""
    blocks: list[Written] = []
    for i in range(10):
        made = rows(T + i / 10, 100)
        blocks.append(replace(made, t=made.t + 0.002 * i, to_server=40.0 + 0.002 * i))
    t = read_session(write(tmp_path / "x.mcap", blocks)).rows["t"].to_numpy()
    assert np.diff(t) == pytest.approx(np.full(999, 0.00102), abs=2.1e-5)


def test_rows_with_rules_of_others_have_columns_of_their_own(tmp_path: Path) -> None:
    own = (*COLUMNS[:-4], "by_glue", *COLUMNS[-3:])
    entries = [rows(T, 10, 1), rows(T + 0.01, 10, 1, columns=own), rows(T, 10, 2)]
    found = read_session(write(tmp_path / "x.mcap", entries)).rows
    assert found["by_glue"].notna().sum() == 10
    assert found.attrs["units"]["by_glue"] == "N"


def test_the_grid_has_all_hands_and_gaps_stay_open(tmp_path: Path) -> None:
    """User 1 lacks 0.5 s, and user 2 comes 0.3 s later, half a millisecond off the grid."""
    entries = [
        rows(T, 500, 1), rows(T + 1.0, 500, 1), rows(T + 0.3005, 500, 2), rows(T + 0.8005, 200, 2),
    ]  # fmt: skip
    session = read_session(write(tmp_path / "x.mcap", entries))
    found = session.aligned()
    assert found.index[0] == T
    assert len(found) == 1500
    assert list(found.columns.names) == ["user", "axis"]
    one, two = found[(1, "x")], found[(2, "x")]
    assert one.notna().sum() == 1000
    assert one.loc[T + 0.499 + 1e-6 : T + 1.0 - 1e-6].isna().all()
    t = found.index.to_numpy()
    for user, column in ((1, one), (2, two)):
        there = column.notna().to_numpy()
        expected = 0.1 * user + 0.01 * np.sin(2.0 * np.pi * (t[there] - T))
        assert column[there].to_numpy() == pytest.approx(expected, abs=1e-6)
    assert two.first_valid_index() == pytest.approx(T + 0.301)
    assert two.last_valid_index() == pytest.approx(T + 0.999)
    coarse = session.aligned(hz=100.0)
    assert np.diff(coarse.index) == pytest.approx(np.full(len(coarse) - 1, 0.01))
    assert coarse.index.to_numpy() == pytest.approx(found.index.to_numpy()[::10][: len(coarse)])


@pytest.mark.parametrize(("hz", "words"), [(0.0, "above 0"), (math.nan, "above 0"), (1e12, "most")])
def test_a_grid_that_makes_no_sense_is_refused(tmp_path: Path, hz: float, words: str) -> None:
    found = read_session(write(tmp_path / "x.mcap", session(0.5)))
    with pytest.raises(SettingError, match=f"hz is .*{words}"):
        found.aligned(hz)


@given(st.lists(st.integers(0, 3000), min_size=2, max_size=60, unique=True), st.integers(50, 2000))
@settings(max_examples=examples(100))
def test_a_value_on_the_grid_lies_between_its_neighbours_or_is_open(
    tmp_path_factory: pytest.TempPathFactory, ms: list[int], hz: int
) -> None:
    t = T + np.sort(np.array(ms)) / 1000.0
    table = np.zeros((len(t), len(COLUMNS)))
    table[:, 0], table[:, 1] = t, np.arange(len(t))
    path = tmp_path_factory.mktemp("law") / "x.mcap"
    found = read_session(write(path, [Rows(t[0], 1, COLUMNS, table.tobytes(), 0.0, 0.0)]))
    column: Any = found.aligned(hz)[(1, "x")]
    pairs: list[tuple[float, float]] = list(column.items())
    for at, value in pairs:
        after = int(np.searchsorted(t, at))
        if after < len(t) and t[after] == at:
            assert value == after
        elif 0 < after < len(t) and t[after] - t[after - 1] <= 0.01 - 1e-9:
            assert after - 1 <= value <= after
        elif after in (0, len(t)) or t[after] - t[after - 1] > 0.01 + 1e-9:
            assert math.isnan(value)


def test_the_grid_as_an_array_with_names(tmp_path: Path) -> None:
    session_read = read_session(write(tmp_path / "x.mcap", session()))
    table, array = session_read.aligned(500.0), session_read.to_xarray(500.0)
    assert array["tip"].dims == ("t", "user", "axis")
    assert array["tip"].attrs["units"] == "m"
    assert list(array["name"].values) == ["u1", "u2"]
    for user in (1, 2):
        part = array.sel(user=user)
        for axis, name in zip(AXES, "xyzxyz", strict=True):
            values = part["force" if axis.startswith("f") else "tip"].sel(axis=name).values
            assert np.array_equal(values, table[(user, axis)].to_numpy(), equal_nan=True)


def test_what_is_missing_of_a_file_is_in_the_table_of_losses(tmp_path: Path) -> None:
    noise = np.random.default_rng(1)
    entries = [Ticked(T + i / 100, int(noise.integers(2**60))) for i in range(800)]
    path = write(tmp_path / "x.mcap", entries)
    data = path.read_bytes()
    places = [i for i in range(len(data)) if data[i : i + 4] == b"zstd"]
    broken = bytearray(data[: places[6] + 500])
    broken[places[4] + 100] ^= 0xFF
    path.write_bytes(broken)
    found = read_session(path).lost
    assert list(found["what"]) == ["a damaged chunk", "cut short from here on"]
    assert found["t"].iloc[0] == pytest.approx(T + 1.52, abs=0.03)


@pytest.mark.parametrize("name", ["pandas", "xarray"])
def test_a_missing_library_is_named_with_the_extra_that_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = write(tmp_path / "x.mcap", session(0.5))
    session_read = read_session(path)
    broken: Any = None
    monkeypatch.setitem(sys.modules, name, broken)
    with pytest.raises(SettingError, match=r'pip install "cohaptic\[analysis\]"'):
        read_session(path) if name == "pandas" else session_read.to_xarray()
