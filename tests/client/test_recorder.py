from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.status.row import COLUMNS, ROW, Row
from cohaptic_client.recorder import MAX_SECONDS, Recorder
from tests.examples_of_laws import examples
from tests.small_disk import small_disk

SLOW = 0.1  # Hz; 30 rows are the longest recording
LIMIT = int(MAX_SECONDS * SLOW)


def row(n: float) -> Row:
    return Row._make(n + column / 100 for column in range(len(COLUMNS)))


def block(*rows: Row) -> bytes:
    return b"".join(ROW.pack(*row) for row in rows)


def test_a_file_holds_every_row_in_order_with_names_and_the_way_to_the_wall_clock(
    tmp_path: Path,
) -> None:
    recorder = Recorder(1000.0)
    recorder.keep(block(row(1.0), row(2.0)), (12.0, 0.0, -0.5))
    recorder.keep(b"")
    recorder.keep(block(row(3.0)))
    path = tmp_path / "left.npz"
    recorder.save(path, name="left", to_wall=-12.5)
    with np.load(path) as file:
        assert sorted(file) == ["columns", "name", "origin", "rows", "to_wall"]
        assert tuple(file["columns"]) == COLUMNS
        assert [Row._make(values) for values in file["rows"]] == [row(n) for n in (1.0, 2.0, 3.0)]
        assert str(file["name"]) == "left"
        assert float(file["to_wall"]) == -12.5
        assert file["origin"].tolist() == [[12.0, 0.0, -0.5]] * 2 + [[0.0, 0.0, 0.0]]


def test_a_recording_without_rows_is_a_file_too(tmp_path: Path) -> None:
    Recorder(1000.0).save(tmp_path / "none.npz", name="left", to_wall=0.0)
    with np.load(tmp_path / "none.npz") as file:
        assert file["rows"].shape == (0, len(COLUMNS))
        assert file["origin"].shape == (0, 3)


@given(st.lists(st.integers(0, 40), max_size=6))
@settings(max_examples=examples(30))
def test_of_a_long_session_the_last_rows_are_kept(
    tmp_path_factory: pytest.TempPathFactory, batches: list[int]
) -> None:
    recorder, count = Recorder(SLOW), 0
    for batch in batches:
        recorder.keep(block(*map(row, range(count, count + batch))), (float(count), 0.0, 0.0))
        count += batch
    path = tmp_path_factory.getbasetemp() / "long.npz"
    recorder.save(path, name="left", to_wall=0.0)
    with np.load(path) as file:
        assert file["rows"][:, 0].tolist() == list(range(max(0, count - LIMIT), count))
        starts = [sum(batches[:k]) for k, batch in enumerate(batches) for _ in range(batch)]
        assert file["origin"][:, 0].tolist() == starts[-LIMIT:]


@pytest.mark.live
def test_on_a_full_disk_a_recording_is_one_sentence_and_leaves_no_part(tmp_path: Path) -> None:
    recorder = Recorder(1000.0)
    values = np.random.default_rng(1).random((1000, len(COLUMNS)))
    recorder.keep(values.tobytes())
    with small_disk(tmp_path / "disk", "64k") as disk:
        path, others = disk / "left.npz", disk / "left"
        others.touch()
        with pytest.raises(
            SettingError, match=r"--record is .*left.npz; .*No space left on device"
        ):
            recorder.save(disk / "left", name="left", to_wall=0.0)
        assert not path.exists()
        assert others.exists()
