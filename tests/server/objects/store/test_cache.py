from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import SettingError
from cohaptic_server.objects.store.cache import fetch, keep, limit, make_room, place

ARRAYS = {"a": np.arange(1000.0)}  # 8 kB


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    monkeypatch.delenv("COHAPTIC_CACHE_GB", raising=False)
    return tmp_path / "store"


def test_a_place_is_for_its_content_alone(folder: Path) -> None:
    assert place(b"one", b"two") == place(b"one", b"two")
    assert place(b"one", b"two").parent == folder
    others = [place(b"onetwo"), place(b"o", b"netwo"), place(b"two", b"one"), place(b"one")]
    assert len({place(b"one", b"two"), *others}) == 5


def test_what_was_not_used_for_longest_goes_first(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE_GB", "3e-5")  # room for three of them
    places = [place(bytes([k])) for k in range(4)]
    for k, where in enumerate(places[:3]):
        keep(where, "thing", ARRAYS)
        os.utime(where, (k + 1000, k + 1000))
    assert fetch(places[0], "thing") is not None  # used now
    keep(places[3], "thing", ARRAYS)
    assert [where.exists() for where in places] == [True, False, True, True]


def test_what_is_larger_than_the_limit_is_not_stored_and_throws_nothing_out(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    keep(place(b"small"), "thing", ARRAYS)
    monkeypatch.setenv("COHAPTIC_CACHE_GB", "1e-6")
    keep(place(b"large"), "factor", ARRAYS)
    assert "the factor was not stored, the next start takes as long (8e-06 GB" in caplog.text
    assert fetch(place(b"small"), "thing") is not None
    assert fetch(place(b"large"), "factor") is None


def test_what_a_killed_process_left_half_written_goes_too(folder: Path) -> None:
    keep(place(b"one"), "thing", ARRAYS)
    (folder / "tmpabc.part").write_bytes(bytes(100))
    make_room(folder, int(limit()))
    assert list(folder.iterdir()) == []


def test_what_is_damaged_is_said(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    where = place(b"one")
    assert fetch(where, "factor") is None
    assert caplog.text == ""
    keep(where, "factor", ARRAYS)
    where.write_bytes(where.read_bytes()[:-100])
    assert fetch(where, "factor") is None
    assert "the stored factor cannot be used and is made anew" in caplog.text


@pytest.mark.parametrize("told", ["many", "-1", "nan", "1e9"])
def test_a_limit_that_is_none_says_so(
    folder: Path, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    del folder
    monkeypatch.setenv("COHAPTIC_CACHE_GB", told)
    with pytest.raises(SettingError, match=r"COHAPTIC_CACHE_GB is '.*'; it must be a number of"):
        limit()
