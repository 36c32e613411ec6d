from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.upload.kept_files import keep, kind_of, plain_name, uploads_folder


@given(st.text(max_size=300))
def test_whatever_a_file_is_called_it_leads_nowhere(name: str) -> None:
    plain = plain_name(name)
    assert plain
    assert set(plain) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-")
    assert len(plain) <= 30


@pytest.mark.parametrize(
    ("name", "plain", "kind"),
    [
        ("../../etc/passwd.stl", "passwd", ".stl"),
        ("C:\\Windows\\system32\\liver.OBJ", "liver", ".obj"),
        ("..stl", "object", ".stl"),
        ("no suffix", "object", ""),
        ("Ein Bär & Söhne.ply", "Ein-B-r-S-hne", ".ply"),
    ],
)
def test_names_become_plain(name: str, plain: str, kind: str) -> None:
    assert (plain_name(name), kind_of(name)) == (plain, kind)


def test_the_oldest_go_first() -> None:
    paths: list[Path] = []
    for k in range(12):
        paths.append(keep(f"{k}".encode(), f"../x{k}.stl", ".stl"))
        os.utime(paths[-1], (k, k))
    assert {path.parent for path in paths} == {uploads_folder()}
    keep(b"last", "last.stl", ".stl")
    assert [path.is_file() for path in paths] == [False] * 5 + [True] * 7
