"""Reads and writes the key file, which only its owner may read."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
import sys
import tempfile
from pathlib import Path

from cohaptic.errors import SettingError
from cohaptic.written import at_home, text_of
from cohaptic_server.access.keys import LEAST_BYTES, Key, KeyRing, read_keys, write_keys

_MAX_BYTES = 64 * 1024  # of a file; sixteen keys take 3 kB


def new_key() -> Key:
    """Make a key with a random secret and a random name, from the system's random numbers."""
    return Key(secrets.token_hex(4), secrets.token_bytes(LEAST_BYTES))


def load_keys(path: Path, *, insecure: bool = False) -> KeyRing:
    """Read a key ring from a file.

    Args:
        path: Path of the file; links are followed, since secrets are mounted as links.
        insecure: Whether to accept a file that other users can read, as on a file system without
            modes.

    Raises:
        SettingError: The file cannot be read, other users can read it, or it holds no keys.
    """
    try:
        with at_home(path).open("rb") as file:
            about = os.fstat(file.fileno())
            if sys.platform != "win32" and not insecure and _is_open(about):
                mode = f"{path} with mode {stat.S_IMODE(about.st_mode):04o}"
                limit = f"one that nobody else may read: chmod 600 {path} (where there are no modes"
                limit += ": --insecure-key-file)"
                raise SettingError("key file", mode, limit)
            text = file.read(_MAX_BYTES + 1)
    except OSError as error:
        limit = f"one that can be read ({error.strerror}); make one: cohaptic key {path}"
        raise SettingError("key file", path, limit) from error
    if len(text) > _MAX_BYTES:
        raise SettingError("size of the key file", path, f"at most {_MAX_BYTES:,} bytes")
    try:
        return read_keys(text_of(text))
    except UnicodeDecodeError as error:
        raise SettingError("key file", path, f"a text ({error.reason})") from error


def _is_open(about: os.stat_result) -> bool:
    """Check whether a key file's mode lets too many users read or write the file.

    The group may read a file that root owns, or that its owner may not write: services mount
    secrets with mode 0440 in a group of the service, or as files of root with mode 0640.
    """
    mode = stat.S_IMODE(about.st_mode)
    owner, user = about.st_uid, os.getuid()
    given = owner == 0 != user or (owner == user and not mode & stat.S_IWUSR)
    return bool(mode & (0o037 if given else 0o077))


def save_keys(path: Path, ring: KeyRing, *, replace: bool) -> None:
    """Write a key ring to a file in one step; other users cannot read the file at any time.

    Args:
        replace: Whether an existing file may be replaced.

    Raises:
        SettingError: The file exists and must not be replaced, or cannot be written.
    """
    try:
        # `mkstemp` creates mode 0600, and the same folder allows the file to be moved.
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        try:
            with os.fdopen(handle, "w", encoding="ascii") as file:
                file.write(write_keys(ring))
                file.flush()
                os.fsync(file.fileno())
            if replace:
                os.replace(name, path)
            else:
                os.link(name, path)  # fails if the file exists
        finally:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(name)
    except FileExistsError as error:
        limit = "a new file; to put another key in front of its keys: --rotate"
        raise SettingError("key file", f"{path}, which exists", limit) from error
    except OSError as error:
        limit = f"one that can be written ({error.strerror})"
        raise SettingError("key file", path, limit) from error
