from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic.errors import OutputError
from cohaptic.recording.journal import Clocks
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
