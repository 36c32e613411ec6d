from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic.sessions.replay import Replay
from cohaptic_tools.replay_cli import in_words
from tests.recorded_sessions import record


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[object, str]:
    with pytest.raises(SystemExit) as ended:
        main(["replay", *words])
    out, err = capsys.readouterr()
    return ended.value.code, out + err


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "lab.example", ""])
def test_a_session_is_shown_to_others_only_by_decision(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], host: str
) -> None:
    code, words = run(capsys, str(tmp_path / "x.mcap"), "--host", host)
    assert code == 2
    assert "it must be 127.0.0.1, for this machine alone, or given with --open" in words


def test_a_file_that_is_no_session_is_told_before_a_port_is_opened(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = tmp_path / "x.mcap"
    text.write_text("no session")
    for path, said in ((tmp_path / "no.mcap", "a file to read"), (text, "an MCAP file")):
        code, words = run(capsys, str(path), "--no-browser")
        assert code == 2
        assert said in words


def test_the_terminal_says_what_is_in_the_file(tmp_path: Path) -> None:
    found = Replay.of(record(tmp_path / "lab.mcap", 2.0))
    assert in_words(found) == "lab.mcap: 2.0 s of 2 people, 5 joins, leaves, marks and events"
