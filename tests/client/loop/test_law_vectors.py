"""The golden vectors of the local control law, which the page's TypeScript is checked against.

`python -m tests.client.loop.test_law_vectors` writes them again after a change of a law.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import cast

import pytest

from tests.client.loop.law_vectors import (
    energies,
    guards,
    links,
    presses,
    slides,
    stabilities,
    surfaces,
)
from tests.client.loop.plays import PLAYS, ROUGH, play_out

FOLDER = Path(__file__).parents[2] / "vectors"
FILES: dict[str, Callable[[], object]] = {
    "law": lambda: {"surfaces": surfaces(), "presses": presses()},
    "passivity": energies,
    "safety": guards,
    "link": links,
    "friction": lambda: {"steps": slides(), "play": play_out(ROUGH)},
    "step": lambda: [play_out(play) for play in PLAYS],
    "stability": stabilities,
}


def as_json(value: object) -> str:
    """Contents of a file: one line for each entry of a list, so that a difference is short."""
    return json.dumps(value, indent=None, separators=(",", ":")).replace("},{", "},\n{") + "\n"


@pytest.mark.parametrize("name", FILES)
def test_the_written_vectors_are_what_the_laws_say(name: str) -> None:
    written = json.loads((FOLDER / f"{name}.json").read_text())
    assert_close(json.loads(as_json(FILES[name]())), written, name)


def assert_close(now: object, then: object, where: str) -> None:
    """Equal but for the last digits, which a mathematical library may choose."""
    if isinstance(then, float):
        assert now == pytest.approx(then, rel=1e-7, abs=1e-12), where
    elif isinstance(then, dict):
        mine, theirs = cast(dict[str, object], now), cast(dict[str, object], then)
        assert mine.keys() == theirs.keys(), where
        for key, value in theirs.items():
            assert_close(mine[key], value, f"{where}.{key}")
    elif isinstance(then, list):
        ours, written = cast(list[object], now), cast(list[object], then)
        assert len(ours) == len(written), where
        for i, value in enumerate(written):
            assert_close(ours[i], value, f"{where}.{i}")
    else:
        assert now == then, where


if __name__ == "__main__":
    for name, make in FILES.items():
        (FOLDER / f"{name}.json").write_text(as_json(make()))
