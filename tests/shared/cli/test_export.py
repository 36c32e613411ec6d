from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic.cli.export import To, beside, told
from cohaptic.sessions.export import FORMS
from cohaptic.sessions.tables import library
from tests.shared.sessions.made import session, write

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
    assert run(capsys, str(file), "--to", to.value) == (0, f"written to {made}\n")
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


class Clock:
    """A clock of a test."""

    def __init__(self) -> None:
        self.t = 100.0

    def now(self) -> float:
        return self.t

    def sleep_until(self, when: float) -> None:
        self.t = when


def test_progress_is_told_after_two_seconds_and_goes_away() -> None:
    clock, written = Clock(), list[str]()
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
    clock, written = Clock(), list[str]()
    with told(clock, terminal, written.append) as progress:
        clock.t += seconds
        progress("reading", 0.5)
    assert written == []
