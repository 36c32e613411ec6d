"""What is made from the table of frames is current, and a page that lost a block is refused."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import generate_protocol
from cohaptic.protocol.layout import LAYOUTS, PATCH
from generate_protocol import DOCS, PAGE, generated, main, typescript, with_tables


@pytest.mark.parametrize("path", [PAGE, DOCS], ids=lambda path: path.name)
def test_the_generated_files_are_current(path: Path) -> None:
    assert path.read_text(encoding="utf-8") == generated()[path], "run make protocol"


def test_prose_beside_the_tables_is_left_as_it_is() -> None:
    page = DOCS.read_text(encoding="utf-8")
    edited = page.replace("## ack, ", "Somebody wrote this.\n\n## ack, ")
    assert edited != page
    assert with_tables(edited) == edited


def test_a_table_that_somebody_edited_is_made_anew() -> None:
    page = DOCS.read_text(encoding="utf-8")
    edited = page.replace("| 4 | u32 | `tick` |", "| 5 | u32 | `tick` |")
    assert edited != page
    assert with_tables(edited) == page


@pytest.mark.parametrize(
    ("found", "instead"),
    [
        ("<!-- generated: patch -->", "<!-- generated: patches -->"),
        ("<!-- generated: patch -->", ""),
        ("<!-- generated: anchor -->", "<!-- generated: patch -->"),
        ("<!-- end -->", ""),
    ],
)
def test_a_page_with_a_wrong_block_is_refused(found: str, instead: str) -> None:
    page = DOCS.read_text(encoding="utf-8").replace(found, instead)
    with pytest.raises(ValueError, match=r"blocks of protocol\.md"):
        with_tables(page)


def test_a_field_that_moves_moves_in_every_file(monkeypatch: pytest.MonkeyPatch) -> None:
    moved = PATCH._replace(fields=(PATCH.fields[1], PATCH.fields[0], *PATCH.fields[2:]))
    layouts = tuple(moved if one is PATCH else one for one in LAYOUTS)
    monkeypatch.setattr(generate_protocol, "LAYOUTS", layouts)
    assert "| 8 | u32 | `tick` | | simulation tick, rising |" in generated()[DOCS]
    assert "PATCH_AT = { seq: 4, tick: 8," in typescript()
    assert "    tick: view.getUint32(8, true)," in typescript()


def test_check_writes_nothing_and_says_what_is_stale(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "layout.ts"
    monkeypatch.setattr(generate_protocol, "ROOT", tmp_path)
    monkeypatch.setattr(generate_protocol, "PAGE", page)
    docs = tmp_path / "protocol.md"
    docs.write_text(DOCS.read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.setattr(generate_protocol, "DOCS", docs)

    def status(*arguments: str) -> object:
        monkeypatch.setattr(sys, "argv", ["generate_protocol.py", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code

    assert status("--check") == 1
    assert "layout.ts is not current" in capsys.readouterr().out
    assert not page.exists()
    assert status() == 0
    assert page.read_text(encoding="utf-8") == PAGE.read_text(encoding="utf-8")
    assert status("--check") == 0
