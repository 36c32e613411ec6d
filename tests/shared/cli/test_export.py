from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic.cli.export import To, beside, told
from cohaptic.sessions.entries import Ticked
from cohaptic.sessions.export import FORMS
from cohaptic.sessions.tables import library
from tests.shared.sessions.made import T, session, write
from tests.still_clock import StillClock

library("h5py")  # which starts a process when it is first imported


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[object, str]:
    with pytest.raises(SystemExit) as ended:
        main(["export", *words])
    out, err = capsys.readouterr()
    return ended.value.code, out + err


def test_the_command_offers_the_forms_that_there_are() -> None:
    assert [to.value for to in To] == list(FORMS)


@pytest.mark.parametrize("to", list(To))
def test_a_session_is_written_beside_its_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], to: To
) -> None:
    file = write(tmp_path / "lab.mcap", session(1.0))
    made = beside(file, to)
    lacks = "the file lacks 17 rows of u2; 3 entries, for which the disk was too slow"
    words = f"written to {made}\ncohaptic: {lacks}\n"
    assert run(capsys, str(file), "--to", to.value) == (0, words)
    assert made.exists()
    code, words = run(capsys, str(file), "--to", to.value)
    assert code == 2
    assert "it must be a name that nothing has yet" in words


def test_the_place_can_be_named_and_errors_are_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "lab.mcap", session(1.0))
    out = tmp_path / "tables"
    assert run(capsys, str(file), "--to", "csv", "--out", str(out))[0] == 0
    assert (out / "rows.csv").is_file()
    for words, said in (
        ([str(tmp_path / "no.mcap")], "it must be a file to read"),
        ([str(out / "rows.csv")], "it must be an MCAP file"),
        ([str(file), "--to", "xml"], "xml"),
        ([str(file), "--out", str(tmp_path / "a" / "b")], "cannot be written"),
    ):
        code, text = run(capsys, *words)
        assert code in (1, 2)
        assert said in text
        assert "Traceback" not in text


def test_a_file_that_was_cut_short_is_told_and_one_that_is_whole_is_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "lab.mcap", [Ticked(T, 1), Ticked(T + 2.5, 2)])
    assert run(capsys, str(file)) == (0, f"written to {tmp_path / 'lab-parquet'}\n")
    file.write_bytes(file.read_bytes()[:-9])
    code, words = run(capsys, str(file), "--out", str(tmp_path / "cut"))
    assert code == 0
    said = "the file lacks all from 2.5 s after its beginning on, since it was cut short"
    assert words.splitlines()[1:] == [f"cohaptic: {said}"]


def test_a_folder_with_one_session_is_that_session(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s01").mkdir()
    file = write(tmp_path / "s01" / "a.mcap", [])
    code, words = run(capsys, str(tmp_path / "s01"), "--to", "csv")
    assert code == 0
    assert f"cohaptic: the session is {file}\n" in words
    assert f"written to {tmp_path / 's01' / 'a-csv'}\n" in words
    write(tmp_path / "s01" / "b.mcap", [])
    code, words = run(capsys, str(tmp_path / "s01"))
    assert code == 2
    assert "or a folder with one session file, not a.mcap, b.mcap" in words


def test_progress_is_told_after_two_seconds_and_goes_away() -> None:
    clock, written = StillClock(), list[str]()
    with told(clock, True, written.append) as progress:
        progress("reading", 0.1)
        assert written == []
        clock.t += 2.5
        progress("reading", 0.5)
        progress("reading", 0.5001)  # at once: nobody could read it
        clock.t += 0.1
        progress("writing", 0.0)
    assert [line.replace("\r\033[K", "") for line in written] == ["reading: 50%", "writing ...", ""]


@pytest.mark.parametrize(("terminal", "seconds"), [(False, 9.0), (True, 1.0)])
def test_nobody_is_told_of_a_short_work_or_without_a_terminal(
    terminal: bool, seconds: float
) -> None:
    clock, written = StillClock(), list[str]()
    with told(clock, terminal, written.append) as progress:
        clock.t += seconds
        progress("reading", 0.5)
    assert written == []
