"""What is made from the table of frames is current, and a file that lost a block is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

import generate_protocol
from cohaptic.protocol.layout import LAYOUTS, PATCH
from generate_protocol import DOCS, HEADER, PAGE, cpp, generated, typescript, with_constants


@pytest.mark.parametrize("path", [PAGE, DOCS, HEADER], ids=lambda path: path.name)
def test_the_generated_files_are_current(path: Path) -> None:
    assert path.read_text(encoding="utf-8") == generated()[path], "run make protocol"


def test_a_field_that_moves_moves_in_every_file(monkeypatch: pytest.MonkeyPatch) -> None:
    moved = PATCH._replace(fields=(PATCH.fields[1], PATCH.fields[0], *PATCH.fields[2:]))
    layouts = tuple(moved if one is PATCH else one for one in LAYOUTS)
    monkeypatch.setattr(generate_protocol, "LAYOUTS", layouts)
    assert "| 8 | u32 | `tick` | | simulation tick, rising |" in generated()[DOCS]
    assert "PATCH_AT = { seq: 4, tick: 8," in typescript()
    assert "    tick: view.getUint32(8, true)," in typescript()
    assert "constexpr std::size_t seq = 4;  // u32\nconstexpr std::size_t tick = 8;" in cpp()


def test_a_header_without_its_block_is_refused() -> None:
    with pytest.raises(ValueError, match="has not exactly one generated block"):
        with_constants("// nothing is generated here\n")
