from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.objects.object_file import ObjectFile


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({"scale": 0.0}, "--scale is 0.0; it must be from 1e-9 to 1e9 metres in a unit"),
        ({"edge": 2.0}, "--edge is 2.0; it must be from 0.005 to 0.5 of the object's diagonal"),
        ({"simplify": 99}, "--simplify is 99; it must be 0, or from 100 to 300,000"),
        ({"shell": 2.0}, "--shell is 2.0; it must be 0, or from 0.0001 to 1 m"),
        ({"max_memory": 1e8}, "--max-memory is 0.1 GB; it must be from 0.5 to 10000"),
        ({"max_time": math.nan}, "--max-time is nan s; it must be from 1 to 1e6 s"),
    ],
)
def test_an_error_names_option_value_and_limit(change: dict[str, Any], reported: str) -> None:
    with pytest.raises(SettingError) as caught:
        ObjectFile(Path("a.stl"), **change)
    assert str(caught.value) == reported
