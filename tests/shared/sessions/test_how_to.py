"""The programs of docs/how-to/record-a-session.md that read a session."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cohaptic.sessions.entries import Joined, Mark
from tests.shared.sessions.made import T, rows, write

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "record-a-session.md"


def test_the_page_finds_the_largest_force_of_each_person_in_each_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The force of the rows is largest at each whole second, 3 N."""
    blocks = re.findall(r"^```py\n(.*?)^```$", PAGE.read_text("utf-8"), re.S | re.M)
    program = "".join(block for block in blocks if "record(" not in block)
    stimuli = [Mark(T + 0.25 + i, "stimulus on", {"trial": i + 1}) for i in range(2)]
    people = [Joined(T, 1, "bob", {}, 8.0), Joined(T, 2, "ann", {}, 8.0)]
    write(
        tmp_path / "lab.mcap",
        [*people, rows(T, 3500, 1), rows(T, 1300, 2), *stimuli, Mark(T + 3.0, "end", {})],
    )
    monkeypatch.chdir(tmp_path)
    exec(compile(program, PAGE.name, "exec"), {})
    assert capsys.readouterr().out.splitlines()[-4:] == [
        "trial 1: ann 3.00 N",
        "trial 1: bob 3.00 N",
        "trial 2: ann 2.00 N",
        "trial 2: bob 3.00 N",
    ]
