from __future__ import annotations

import os
from pathlib import Path

import pytest

from cohaptic.cli.output import check_output
from cohaptic.errors import SettingError


def refusal(path: Path, suffix: str = "") -> str:
    with pytest.raises(SettingError) as caught:
        check_output("--json", path, suffix)
    return str(caught.value)


def test_what_can_be_written_passes_and_nothing_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_output("--json", None)
    check_output("--json", tmp_path / "new.json")
    check_output("--out", tmp_path / "new.PNG", ".png")
    monkeypatch.chdir(tmp_path)
    check_output("--json", Path("new.json"))
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_written_is_told_with_what_is_wrong(tmp_path: Path) -> None:
    assert refusal(tmp_path / "no/x.json").endswith(f"in a folder that exists: not {tmp_path}/no")
    assert "and it is a folder" in refusal(tmp_path)
    assert "ends with .png" in refusal(tmp_path / "x.jpg", ".png")


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write all")
def test_what_may_not_be_written_to_is_told(tmp_path: Path) -> None:
    (tmp_path / "mine.json").touch(mode=0o400)
    assert "that may be written to" in refusal(tmp_path / "mine.json")
    tmp_path.chmod(0o500)
    assert "that may be written to" in refusal(tmp_path / "new.json")
    tmp_path.chmod(0o700)
