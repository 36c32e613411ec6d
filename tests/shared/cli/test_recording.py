from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic.cli.recording import lines
from cohaptic.errors import OutputError
from cohaptic.recording.journal import Clocks, Damage, Header
from cohaptic.recording.outline import Gap, Outline
from cohaptic.status.row import COLUMNS
from tests.shared.recording.rows import recorder, rows


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[object, str]:
    with pytest.raises(SystemExit) as ended:
        main(["recording", *words])
    out, err = capsys.readouterr()
    return ended.value.code, out + err


def left_by_a_killed_process(path: Path) -> Path:
    made = recorder(path)
    made.keep(rows(0, 100))
    made.note(Clocks(100.0, 1.5e9, 3.0, 0.002))
    made.keep(rows(300, 400))
    path.touch()  # so that the part stays
    with pytest.raises(OutputError, match="appeared meanwhile"):
        made.finish()
    path.unlink()
    return path.with_name(f"{path.name}.part")


def test_a_part_is_read_and_finished(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part = left_by_a_killed_process(tmp_path / "a b.npz")
    code, told = run(capsys, str(part))
    assert code == 0
    assert told.startswith("ann: 0.4 s, with a gap (0.20 s in all)\nfrom 2017-07-1")
    assert "the server's clock is known within 2.0 ms\n" in told
    code, finished = run(capsys, str(part), "--finish")
    assert (code, finished) == (0, told + f"written to {tmp_path / 'a b.npz'}\n")
    assert run(capsys, str(tmp_path / "a b.npz")) == (0, told)
    assert [path.name for path in tmp_path.iterdir()] == ["a b.npz"]


def test_finishing_replaces_nothing_unless_it_is_wished(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = left_by_a_killed_process(tmp_path / "x.npz")
    (tmp_path / "x.npz").write_bytes(b"an earlier one")
    code, told = run(capsys, "--finish", str(part))
    assert code == 2
    assert "and this one exists" in told
    assert (tmp_path / "x.npz").read_bytes() == b"an earlier one"
    assert run(capsys, "--finish", str(part), "--overwrite")[0] == 0
    assert run(capsys, str(tmp_path / "x.npz"))[1].startswith("ann: 0.4 s")


@pytest.mark.parametrize(
    ("name", "words"),
    [("no.npz.part", "cannot be opened"), ("x.txt", "that ends with .part"), ("text.npz.part", "")],
)
def test_what_cannot_be_finished_is_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, words: str
) -> None:
    (tmp_path / "text.npz.part").write_text("not a recording")
    code, told = run(capsys, "--finish", str(tmp_path / name))
    assert code == 2
    assert words in told
    assert (tmp_path / "text.npz.part").read_text() == "not a recording"
    assert [path.name for path in tmp_path.iterdir()] == ["text.npz.part"]


def test_a_wall_clock_that_was_set_and_what_is_missing_are_said() -> None:
    header = Header("ann", COLUMNS, 1000.0)
    clocks = [Clocks(100.0, 1.5e9), Clocks(200.0, 1.5e9 + 7.5)]
    gaps = [Gap(110.0 + k, 110.5 + k) for k in range(7)]
    outline = Outline(header, 10, 100.0, 200.0, gaps, clocks, [Damage(12, cut_short=True)])
    told = lines(outline)
    assert told[0] == "ann: 100.0 s, with 7 gaps (3.50 s in all)"
    assert "the wall clock was set by +7.5 s meanwhile" in told
    assert "gap of 0.500 s, 10.000 s after the start" in told
    assert told[-2:] == [
        "and 2 gaps more",
        "12 bytes at its end are no whole block, and were left out",
    ]
