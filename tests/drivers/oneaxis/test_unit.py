from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest

from cohaptic.errors import SettingError
from cohaptic_drivers.oneaxis.unit import Unit, read_unit

NEEDED = "sensor_direction = 1\nmotor_direction = -1\ntorque_constant = 0.02\n"


def refused(folder: Path, text: str) -> str:
    path = folder / "mine.toml"
    path.write_text(text)
    with pytest.raises(SettingError) as caught:
        read_unit(str(path))
    return str(caught.value)


def test_without_a_file_there_is_no_force() -> None:
    unit = read_unit("")
    assert unit.most_force(10.0) == 0.0
    assert unit.current(-5.0) == 0.0


def test_a_file_may_say_everything(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(NEEDED + "handle_radius = 0.1\ngear = 10\nmax_current = 1\n")
    unit = read_unit(str(path))
    assert (unit.motor_direction, unit.sensor_direction) == (-1.0, 1.0)
    assert unit.current(1.0) == pytest.approx(-0.5)
    assert unit.current(-9.0) == 1.0
    assert unit.most_force(0.7) == pytest.approx(1.4)
    assert unit.counts(628) == pytest.approx(628 * 10 / 0.628, rel=1e-3)
    path.write_text("\n".join(f"{each.name} = 1" for each in fields(Unit) if each.name in NEEDED))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("motor_direction = 0.5", "1 or -1"),
        ("torque_constant = 7", "a number from 0.0001 to 1"),
        ("torque_constant = true", "a number from"),
        ("gear = nan", "a number from"),
        ("gears = 3", "one of: handle_radius"),
        ("gear", "a TOML file"),
    ],
)
def test_a_file_that_cannot_be_is_told(tmp_path: Path, line: str, words: str) -> None:
    keys = line.split(" ")[0]
    kept = "\n".join(each for each in NEEDED.splitlines() if not each.startswith(keys))
    assert words in refused(tmp_path, f"{kept}\n{line}\n")
