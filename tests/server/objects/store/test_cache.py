from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from cohaptic_server.objects.store import cache
from cohaptic_server.objects.store.cache import (
    UnkeptError,
    entry_path,
    load_entry,
    save_entry,
)
from cohaptic_server.objects.store.store import Checkpoint

ARRAYS = {"a": np.arange(1000.0)}  # 8 kB


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    monkeypatch.delenv("COHAPTIC_CACHE_GB", raising=False)
    return tmp_path / "store"


def test_a_path_depends_on_the_content_alone(folder: Path) -> None:
    assert entry_path(b"one", b"two") == entry_path(b"one", b"two")
    assert entry_path(b"one", b"two").parent == folder
    others = [
        entry_path(b"onetwo"),
        entry_path(b"o", b"netwo"),
        entry_path(b"two", b"one"),
        entry_path(b"one"),
    ]
    assert len({entry_path(b"one", b"two"), *others}) == 5


@pytest.fixture(params=["relative", "unknown"])
def no_home(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A user id that the system does not know, with no home or a relative one."""
    for name in ("COHAPTIC_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    if request.param == "relative":
        monkeypatch.setenv("HOME", "somewhere")
    pwd = pytest.importorskip("pwd")

    def unknown(uid: int) -> None:
        raise KeyError(uid)

    monkeypatch.setattr(pwd, "getpwuid", unknown)


@pytest.mark.skipif(sys.platform != "linux", reason="the XDG base directories are Linux's")
@pytest.mark.usefixtures("no_home")
def test_an_account_without_a_home_has_no_cache_and_is_told_so_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    cache.warn_once.cache_clear()
    for content in (b"one", b"two"):
        path = entry_path(content)
        assert load_entry(path, "thing") is None
        save_entry(path, "thing", ARRAYS)
        assert load_entry(path, "thing") is None
        Checkpoint(path).remove()
    assert [record.message.partition(":")[0] for record in caplog.records] == [
        "nothing is stored, the next start takes as long"
    ]
    assert "COHAPTIC_CACHE names another folder" in caplog.text
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(cache, "_insisting", True)
    with pytest.raises(UnkeptError, match="cannot be kept: this account has no home folder"):
        save_entry(entry_path(b"three"), "thing", ARRAYS)


def test_the_least_recently_used_entry_is_deleted_first(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE_GB", "3e-5")  # room for three of them
    paths = [entry_path(bytes([k])) for k in range(4)]
    for k, path in enumerate(paths[:3]):
        save_entry(path, "thing", ARRAYS)
        os.utime(path, (k + 1000, k + 1000))
    assert load_entry(paths[0], "thing") is not None  # used now
    save_entry(paths[3], "thing", ARRAYS)
    assert [path.exists() for path in paths] == [True, False, True, True]
