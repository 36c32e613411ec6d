from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.errors import SettingError
from cohaptic_drivers.woodenhaptics.unit import UNITS, read_unit


def test_a_file_changes_what_it_names_and_no_more(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("directions = [-1, -1, 1]\ntorque_constants = [0.3, 0.06, 0.06]\n")
    unit = read_unit("woodenhaptics", str(path))
    assert unit.directions == (-1.0, -1.0, 1.0)
    assert unit.torque_constants == (0.3, 0.06, 0.06)
    assert unit.confirmed
    assert unit.lengths == UNITS["woodenhaptics"].lengths


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("directions = [1, 2, 1]", "directions in"),
        ("directions = [1, 0, 1]", "three of 1 and -1"),
        ("torque_constants = [0.1, 0.1]", "three numbers from 0.001 to 1"),
        ("torque_constants = [0.1, nan, 0.1]", "three numbers"),
        ("torque_constants = 5", "three numbers"),
        ("max_current = 7", "a number from 0.1 to 6"),
        ("max_current = true", "a number from 0.1 to 6"),
        ('max_force = "much"', "a number from 0.1 to 30"),
        ("gears = 1", "must be one of: capstans, drums"),
        ("not toml", "a TOML file"),
        ("# " + 20_000 * "x", "at most 10000 bytes"),
    ],
)
def test_a_wrong_file_is_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(SettingError) as caught:
        read_unit("woodenhaptics", str(path))
    assert words in str(caught.value)
