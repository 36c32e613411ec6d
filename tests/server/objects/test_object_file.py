from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.objects.object_file import ObjectFile


@pytest.mark.parametrize(
    ("change", "word"),
    [({"scale": 0.0}, "--scale"), ({"edge": 2.0}, "--edge"), ({"shell": 2.0}, "--shell")],
)
def test_absurd_options_are_refused(change: dict[str, Any], word: str) -> None:
    with pytest.raises(SettingError, match=word):
        ObjectFile(Path("a.stl"), **change)


def test_its_arguments_name_every_option_once() -> None:
    material = SolidSettings(1e4, 0.3, 0.01, 1)
    arguments = ObjectFile(Path("a.stl"), "z < 5%", 0.01, 0.07, True, material).to_arguments()
    assert arguments[-1] == "--repair"
    pairs = dict(zip(arguments[:-1:2], arguments[1:-1:2], strict=True))
    assert pairs == {
        "--young": "10000.0",
        "--poisson": "0.3",
        "--order": "1",
        "--contact-radius": "0.01",
        "--scale": "0.01",
        "--edge": "0.07",
        "--simplify": "0",
        "--shell": "0.0",
        "--max-memory": "6.0",
        "--max-time": "1800.0",
        "--fix": "z < 5%",
    }
    bone = ObjectFile(Path("a.stl"), fix_mesh=Path("bone.stl")).to_arguments()
    assert bone[-2:] == ["--fix-mesh", "bone.stl"]
    assert "--fix" not in bone
