from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.touchable import KINDS, kind_of
from cohaptic_uploads.kept_files import give_up, keep, plain_name, uploads_folder


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


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_kept_is_of_the_kind_that_came(kind: str, tmp_path: Path) -> None:
    path = keep(b"1", f"of the left.side{kind.upper()}", kind, tmp_path / "mark")
    assert path.name.startswith("of-the-left-side-")
    assert kind_of(path.name) == kind


def test_what_is_given_up_goes_and_what_was_kept_before_stays(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    path = keep(b"1", "a.stl", ".stl", mark)
    give_up(mark)
    assert not path.exists()
    assert not mark.exists()
    assert keep(b"1", "a.stl", ".stl", mark) == path
    mark.unlink()  # its object is there
    keep(b"1", "a.stl", ".stl", mark)
    give_up(mark)
    assert path.exists()
    assert not mark.exists()


@pytest.mark.parametrize("said", [b"", b".", b"..", b"/", b"\xff\0", b"../outside", b"a" * 10_000])
def test_a_mark_leads_nowhere_else(said: bytes, tmp_path: Path) -> None:
    kept = keep(b"1", "a.stl", ".stl", tmp_path / "other")
    outside = uploads_folder().parent / "outside"
    outside.write_bytes(b"")
    mark = tmp_path / "mark"
    mark.write_bytes(said)
    give_up(mark)
    assert kept.exists()
    assert outside.exists()


def test_one_server_takes_no_file_away_that_another_has_kept_meanwhile(tmp_path: Path) -> None:
    path = keep(b"1", "a.stl", ".stl", tmp_path / "mark of one")
    assert keep(b"1", "a.stl", ".stl", tmp_path / "mark of the other") == path
    give_up(tmp_path / "mark of one")
    assert path.read_bytes() == b"1"
