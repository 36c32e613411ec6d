"""Every block of README and docs is played, page by page, or it stands here why not."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

import pytest

from tests.docs.blocks import OTHER_KINDS, ROOT, Block, blocks, why_not
from tests.docs.player import Player

BLOCKS = list(blocks())
# Pages that prepare solids or measure for minutes.
LONG = {
    "docs/how-to/measure-latency.md",
    "docs/how-to/parts-and-scans.md",
    "docs/tutorial/your-own-object.md",
}


def is_played(block: Block) -> bool:
    """Whether there is something in it that a test can run."""
    return block.kind in ("python", "text", "toml") or any(not why_not(c) for c in block.commands)


PLAYED = {
    page: [block for block in found if is_played(block)]
    for page, found in groupby(BLOCKS, lambda block: block.page)
}


def test_every_kind_of_block_is_known() -> None:
    known = {"", "sh", "python", "text", "toml", *OTHER_KINDS}
    assert {(block.page, block.kind) for block in BLOCKS if block.kind not in known} == set()
    assert all((ROOT / test).is_file() for test in OTHER_KINDS.values())


def test_no_line_of_a_block_of_commands_is_passed_over() -> None:
    assert [(block.page, line) for block in BLOCKS for line in block.other_lines] == []


def test_most_blocks_are_played() -> None:
    """So that a change of their form does not silently leave them out."""
    assert sum(map(len, PLAYED.values())) > 20


def _tier(page: str) -> pytest.MarkDecorator:
    return pytest.mark.night if page in LONG else pytest.mark.live


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=_tier(page)) for page, found in PLAYED.items() if found],
)
def test_a_page_can_be_played_as_it_stands(page: str, tmp_path: Path) -> None:
    with Player(tmp_path) as player:
        for block in PLAYED[page]:
            assert player.play(block) > 0, block.text
