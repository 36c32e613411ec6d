from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.touchable import KINDS, kind_of
from cohaptic_server.upload.kept_files import keep, plain_name, uploads_folder


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
        ("no suffix", "no-suffix", ""),
        ("of.the.left.side.NII.gz", "of-the-left-side", ".nii.gz"),
        (".nii.gz", "object", ".nii.gz"),
        ("a.tar.gz", "a-tar", ".gz"),
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


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_kept_is_of_the_kind_that_came(kind: str) -> None:
    path = keep(b"1", f"of the left.side{kind.upper()}", kind)
    assert path.name.startswith("of-the-left-side-")
    assert kind_of(path.name) == kind
