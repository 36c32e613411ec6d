from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.credentials.key_file import load_keys, new_key, save_keys
from tests.server.access.some import RING


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    save_keys(tmp_path / "keys", RING, replace=False)
    assert load_keys(tmp_path / "keys") == RING
    save_keys(tmp_path / "keys", RING.rotated(new_key()), replace=True)
    assert len(load_keys(tmp_path / "keys").keys) == 2


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o666, 0o620])
def test_a_file_that_others_may_read_or_write_is_refused(mode: int, tmp_path: Path) -> None:
    save_keys(tmp_path / "keys", RING, replace=False)
    (tmp_path / "keys").chmod(mode)
    with pytest.raises(SettingError, match=f"0{mode:o}; it must be one that nobody else"):
        load_keys(tmp_path / "keys")


def test_what_is_no_file_or_too_large_is_a_sentence(tmp_path: Path) -> None:
    for path in (tmp_path / "none", tmp_path):
        with pytest.raises(SettingError, match="cohaptic key"):
            load_keys(path)
    large = tmp_path / "large"
    large.write_bytes(b"x" * 100_000)
    large.chmod(0o600)
    with pytest.raises(SettingError, match="at most"):
        load_keys(large)


def test_no_two_keys_are_alike() -> None:
    assert len({new_key().secret for _ in range(20)}) == len({new_key().kid for _ in range(20)})


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
@pytest.mark.parametrize("mode", [0o400, 0o440, 0o600])
def test_a_secret_as_it_is_mounted_is_read_through_links(mode: int, tmp_path: Path) -> None:
    folder = tmp_path / "..2026_11_26"
    folder.mkdir()
    save_keys(folder / "keys", RING, replace=False)
    (folder / "keys").chmod(mode)
    (tmp_path / "..data").symlink_to(folder.name)
    (tmp_path / "keys").symlink_to("..data/keys")
    assert load_keys(tmp_path / "keys") == load_keys(folder / "keys")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
def test_what_root_has_given_to_a_group_is_read_and_no_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "keys"
    save_keys(path, RING, replace=False)
    monkeypatch.setattr(os, "getuid", lambda: 4711)
    mode = 0o640

    def roots(_file: int) -> os.stat_result:
        return os.stat_result((stat.S_IFREG | mode, *[0] * 9))

    monkeypatch.setattr(os, "fstat", roots)
    assert load_keys(path)
    for mode in (0o660, 0o644, 0o641):  # noqa: B007  # `roots` reads it
        with pytest.raises(SettingError, match="--insecure-key-file"):
            load_keys(path)
        assert load_keys(path, insecure=True)
