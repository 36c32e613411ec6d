"""`cohaptic why` as a person types it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cohaptic.cli.app import main
from cohaptic.sessions.entries import Joined
from cohaptic.sessions.tables import read_session
from cohaptic.vec import scale
from cohaptic_client.loop.added import Contact, with_rules
from tests.client.loop.staged import Stage
from tests.client.loop.test_added import OwnHand
from tests.shared.sessions.made import T, rows, write


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[object, str]:
    with pytest.raises(SystemExit) as ended:
        main(["why", *map(str, words)])
    out, err = capsys.readouterr()
    return ended.value.code, out + err


def halves(contact: Contact) -> None:
    contact.force = scale(contact.force, 0.5)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A press with a rule of another package."""
    stage = Stage(chain=with_rules([OwnHand(halves, name="a_rule_with_a_long_name")]))
    stage.press()
    path = tmp_path_factory.mktemp("why") / "ann.npz"
    stage.save(path)
    return path


def test_a_table_and_a_sentence(recorded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, reported = run(capsys, recorded, "--at", 1.7)
    assert code == 0
    assert (
        reported
        == """ann, 1.700 s after the beginning:

  surface                  +2.000 N  ++++++++++++++++++++++++
    the law's spring on the surface of the newest patches
  a_rule_with_a_long_name  -1.000 N  ------------
    reason of a_rule_with_a_long_name
  given                     1.000 N
  budget                   0.0200 N: nobody took any

The hand was given 1.00 N: 2.00 N by the surface, less 1.00 N by
a_rule_with_a_long_name.
"""
    )
    code, reported = run(capsys, recorded, "--at", 0.05)
    assert "The hand was given no force" in reported


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        ((), "--at is missing"),
        (("--at", -1), "--at is -1 s; it must be from 0 to 1.799 s"),
        (("--at", "nan"), "--at is nan s; it must be"),
        (("--at", 1, "--user", "bob"), "--user is bob; it must be ann"),
        (("--at", 1, "--from", 1), "--from, --to is given; it must be left out"),
        (("--out", "x.png", "--from", 1.2, "--to", 1.1), "within 0 and 1.799 s, and not empty"),
        (("--out", "x.png", "--json", "-"), "it must be given with --at"),
        (("--out", "x.jpg"), ".png"),
    ],
)
def test_rubbish_gets_a_sentence(
    recorded: Path, words: tuple[object, ...], reported: str,
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    code, out = run(capsys, recorded, *words)
    assert code == 2
    assert reported in " ".join(out.split())
    assert not list(tmp_path.iterdir())


def test_a_recording_without_a_ledger_is_refused_and_one_that_lacks_a_rule_says_so(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with np.load(recorded) as file:
        parts = {name: file[name] for name in file}
    columns = parts["columns"].tolist()

    def without(*names: str) -> Path:
        kept = [i for i, name in enumerate(columns) if name not in names]
        path = tmp_path / "less.npz"
        less = {"columns": parts["columns"][kept], "rows": parts["rows"][:, kept]}
        np.savez(path, **(parts | less))
        return path

    code, reported = run(capsys, without("by_gain"), "--at", 1)
    assert code == 2
    assert "a recording with a ledger" in " ".join(reported.split())
    code, reported = run(capsys, without("by_a_rule_with_a_long_name"), "--at", 1.7)
    assert code == 0
    assert "-1.00 N are in no column of this recording" in " ".join(reported.split())


def drifting(path: Path) -> Path:
    """A session of one second; its client's clock gets another offset from block to block."""
    blocks = [rows(T + 0.2 + i / 10, 100, to_server=40.0 - 0.001 * i) for i in range(8)]
    return write(path, [Joined(T, 1, "ann", {}, 8.0), *blocks])


def test_a_time_above_the_length_of_a_session_is_one_of_its_tables(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = drifting(tmp_path / "x.mcap")
    table = read_session(path).rows
    for place in (0, 1, 250, 799):
        own = table["t_client"][place] - table["t_client"][0]
        code, said = run(capsys, path, "--user", "ann", "--at", repr(float(table["t"][place])))
        assert code == 0
        assert said.startswith(f"ann, {own:.3f} s after the beginning:")
    code, said = run(capsys, path, "--user", "ann", "--at", T + 50.0)
    assert code == 2
    limit = "from 0 to 0.806 s after the first row of this user, or from 100.200 to 100.999 s on"
    assert limit in " ".join(said.split())


def test_a_folder_with_one_session_and_no_recordings_is_that_session(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = drifting(tmp_path / "x.mcap")
    code, said = run(capsys, tmp_path, "--user", "ann", "--at", 0.5)
    assert code == 0
    assert said.startswith("ann, 0.500 s after the beginning:")
    assert f"the session is {path}" in said
    drifting(tmp_path / "y.mcap")
    code, said = run(capsys, tmp_path, "--user", "ann", "--at", 0.5)
    assert code == 2
    assert "a folder with one session file, not x.mcap, y.mcap" in said
