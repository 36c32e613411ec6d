from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given

from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_uploads.described import from_fields, to_fields
from cohaptic_uploads.kept_files import uploads_folder
from cohaptic_uploads.pipe import PipeEnded
from tests.server.objects.given_options import GIVEN


@given(GIVEN)
def test_any_options_come_back_but_those_that_nobody_chooses_here(options: dict[str, Any]) -> None:
    path = uploads_folder() / "a.stl"
    fields = json.loads(json.dumps(to_fields(ObjectFile.of(path, options))))
    chosen = {name: value for name, value in options.items() if name in fields}
    assert from_fields(fields) == ObjectFile.of(path, chosen)


@pytest.mark.parametrize(
    "change",
    [
        {"young": -1},
        {"young": None},
        {"poisson": ["soft"]},
        {"scale": "x"},
        {"edge": float("nan")},
        {"order": 7},
        {"simplify": 1e400},
        {"label": 3},
    ],
)
def test_nonsense_is_no_object(change: dict[str, Any]) -> None:
    with pytest.raises(PipeEnded, match="no object"):
        from_fields(to_fields(ObjectFile(uploads_folder() / "a.stl", "z < 5%")) | change)


def test_a_file_elsewhere_cannot_be_named() -> None:
    fields = to_fields(ObjectFile(uploads_folder() / "a.stl", "z < 5%"))
    found = from_fields(fields | {"file": "../../../etc/passwd"})
    assert found.path == uploads_folder() / "passwd"
