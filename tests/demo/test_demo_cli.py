"""What the command refuses before it starts anything; `tests/system` runs it."""

from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic_tools.demo import demonstration
from cohaptic_tools.demo.capacity import Machine

FAST = Machine(unit=1e-3, cores=64.0, free=1.0, why_plain="")
SLOW = Machine(unit=4e-3, cores=2.0, free=1.0, why_plain="")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["--users", "16"],
            "number of users is 16; it must be at most 11 at 30 Hz on this machine",
        ),
        (["--users", "1"], "number of users is 1; it must be from 2 to 16"),
        (["--duration", "0.5"], "duration is 0.5 s; it must be from 2 s to a day"),
        (["--body", "nothing.stl"], "nothing.stl: there is no such file"),
        (["--body", "pudding"], "body is 'pudding'; it must be one of: balloon, spring, or a file"),
        (
            ["--body", "spring"],
            "body of the demonstration is 'spring'; it must be balloon or a file",
        ),
        (["--young", "1000"], "body is 'balloon'; it must be a file, for options that describe"),
        (["--friction", "2.5"], "friction is 2.5; it must be from 0 to 2"),
        (
            ["--friction", "0.8", "--users", "3"],
            "number of users with friction is 3; it must be 2: one is dragged",
        ),
        (
            ["--friction", "0.8", "--body", "a.stl"],
            "body of the demonstration with friction is 'a.stl'; it must be balloon",
        ),
        (
            ["--body", "a.stl", "--users", "16", "--simulation-hz", "200"],
            "--users is 16; it must be at most 4 at 200 Hz: even the coarsest mesh would take",
        ),
        (["--json", "no/such/folder/out.json"], "in a folder that exists: not no/such/folder"),
    ],
)
def test_what_cannot_be_shown_is_one_sentence_and_starts_nothing(
    arguments: list[str],
    words: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    machine = SLOW if arguments == ["--users", "16"] else FAST
    monkeypatch.setattr(demonstration, "measure", lambda: machine)
    with pytest.raises(SystemExit) as end:
        main(["demo", *arguments])
    out, err = capsys.readouterr()
    assert (end.value.code, out) == (2, "")
    assert err.startswith("cohaptic: ")
    assert words in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
