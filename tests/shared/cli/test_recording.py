from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic.errors import OutputError
from cohaptic.recording.journal import Clocks
from cohaptic.sessions.entries import Mark
from tests.shared.recording.rows import recorder, rows
from tests.shared.sessions.made import T, session, write


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
    code, reported = run(capsys, str(part))
    assert code == 0
    assert reported.startswith("ann: 0.4 s, with a gap (0.20 s in all)\nfrom 2017-07-1")
    assert "the server's clock is known within 2.0 ms\n" in reported
    code, finished = run(capsys, str(part), "--finish")
    assert (code, finished) == (0, reported + f"written to {tmp_path / 'a b.npz'}\n")
    assert run(capsys, str(tmp_path / "a b.npz")) == (0, reported)
    assert [path.name for path in tmp_path.iterdir()] == ["a b.npz"]


def test_finishing_replaces_nothing_unless_it_is_wished(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = left_by_a_killed_process(tmp_path / "x.npz")
    (tmp_path / "x.npz").write_bytes(b"an earlier one")
    code, reported = run(capsys, "--finish", str(part))
    assert code == 2
    assert "and this one exists" in reported
    assert (tmp_path / "x.npz").read_bytes() == b"an earlier one"
    assert run(capsys, "--finish", str(part), "--overwrite")[0] == 0
    assert run(capsys, str(tmp_path / "x.npz"))[1].startswith("ann: 0.4 s")


def test_a_session_says_whom_and_what_it_holds_and_lacks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s01").mkdir()
    file = write(tmp_path / "s01" / "lab.mcap", session())
    code, said = run(capsys, str(file))
    assert code == 0
    first, time, clock, counts, *others = said.splitlines()
    assert first == "lab.mcap: 3.0 s of u1 (user 1), u2 (user 2), in the room lab"
    assert time.startswith("from 2027-01-1")
    assert clock == "on the server's clock from 100.000 to 103.000 s"
    assert counts.startswith("it has 60 ticks, 60 samples of hands, 120 patches, 60 scenes, ")
    assert counts.endswith("2 marks")
    assert others == [
        "mark at 103.000 s, 3.000 s after the start: trial 1",
        "mark at 103.000 s, 3.000 s after the start: pause",
        "17 rows of u2 are missing",
        "3 entries are missing, for which the disk was too slow",
    ]
    told = f"cohaptic: the session is {file}\n"
    assert run(capsys, str(tmp_path / "s01")) == (0, said + told)


def test_a_session_that_was_cut_short_says_so_and_a_whole_one_lacks_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "x.mcap", [Mark(T + i, f"trial {i}", {}) for i in range(7)])
    said = run(capsys, str(file))[1]
    assert "x.mcap: 6.0 s of nobody, in the room lab" in said
    assert said.endswith("trial 4\nand 2 marks more\nnothing is known to be missing\n")
    file.write_bytes(file.read_bytes()[:-9])
    assert "it was cut short, as by a killed process" in run(capsys, str(file))[1]
    code, said = run(capsys, str(file), "--finish")
    assert code == 2
    assert "it must be given for a .part; a session is read as it is" in said
