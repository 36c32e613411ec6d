from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.cli.output import Output, new_output
from cohaptic.errors import OutputError, SettingError


def refusal(path: Path, suffix: str = "") -> str:
    with pytest.raises(SettingError) as caught:
        new_output("--json", path, suffix)
    return str(caught.value)


def test_what_cannot_be_written_is_told_with_what_is_wrong(tmp_path: Path) -> None:
    assert refusal(tmp_path / "no/x.json").endswith(f"in a folder that exists: not {tmp_path}/no")
    assert "and it is a folder" in refusal(tmp_path)
    assert "ends with .png" in refusal(tmp_path / "x.jpg", ".png")


def test_a_file_that_exists_is_refused_unless_the_user_wishes_otherwise(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text("old")
    limit = "a new file, and this one exists: choose another name, or replace it by --overwrite"
    assert refusal(path).endswith(limit)
    (tmp_path / "link.json").symlink_to(path)
    assert refusal(tmp_path / "link.json").endswith(limit)
    (tmp_path / "ring.json").symlink_to(tmp_path / "ring.json")
    assert refusal(tmp_path / "ring.json").endswith(limit)
    output = new_output("--json", path, overwrite=True)
    assert output is not None
    assert path.read_text() == "old"
    output.write("\N{GREEK SMALL LETTER NU}\n")
    assert path.read_text(encoding="utf-8") == "\N{GREEK SMALL LETTER NU}\n"
    with pytest.raises(OutputError, match="was not replaced"):
        Output(path).write(b"new")
