"""The store that several machines share: entries of the cache on storage that fsspec reaches.

Rooms map entries from files, so that each machine keeps its own cache. An entry that the cache
lacks is fetched from here before it would be computed, and one that was computed is sent here. Its
name is a hash of the content that it is computed from; where two machines have computed it at once,
the later one stays. A fetched entry is checked before it is kept, and runs no code, but whoever may
write here decides how objects feel.

After an error of the storage this process asks it no more, or sends it no more.
"""

from __future__ import annotations

import importlib
import logging
import os
import tempfile
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

from cohaptic.errors import BodyError, SettingError

_LOG = logging.getLogger("cohaptic.server")

VARIABLE: Final = "COHAPTIC_SHARED_CACHE"
_ANSWERS: Final = 15.0  # s for the first answer; libraries try again for minutes
_SLOWEST: Final = 1e6  # bytes/s, below which computing is no slower

_refused: set[str] = set()  # "fetched from", "sent to": kinds of requests that have failed

T = TypeVar("T")


def check() -> None:
    """Refuse a setting that no machine can use.

    Raises:
        SettingError: COHAPTIC_SHARED_CACHE is of a kind that is not known here.
    """
    _Storage.chosen("checked")


def fetch(
    path: Path, label: str, make_room: Callable[[Path, int], None], check: Callable[[Path], object]
) -> bool:
    """Fetch an entry that this machine lacks; return whether it is here now.

    Args:
        path: Path of the entry in the cache.
        label: Name of the content in the log.
        make_room: Called with the folder of the cache and the size of the entry [bytes]; raises
            OSError if it does not fit.
        check: Called with the path of the fetched file; raises BodyError if it is damaged.

    Raises:
        SettingError: COHAPTIC_SHARED_CACHE is of a kind that is not known here.
    """
    storage = _Storage.chosen("fetched from")
    if storage is None:
        return False
    try:
        files, there, size = _within(_ANSWERS, partial(storage.find, path.name))
    except FileNotFoundError:
        return False
    except Exception as error:  # each kind of storage has its own
        storage.give_up(label, error)
        return False
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        make_room(path.parent, size)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
            part = Path(file.name)
    except OSError as error:
        _LOG.warning("the %s cannot be kept here (%s)", label, error)
        return False
    try:
        _within(_ANSWERS + size / _SLOWEST, lambda: files.get_file(there, str(part)))
        check(part)
        os.replace(part, path)
    except (BodyError, ValueError, KeyError, TypeError) as error:
        _LOG.warning("the %s at %s cannot be used, and is made anew (%s)", label, storage, error)
        return False
    except Exception as error:
        storage.give_up(label, error)
        return False
    finally:
        part.unlink(missing_ok=True)
    reported = {"event": "object_fetched"}
    _LOG.info("the %s was fetched from %s (%.3g MB)", label, storage, size / 1e6, extra=reported)
    return True


def send(path: Path, label: str) -> None:
    """Send an entry of the cache to the storage, for the other machines; arguments as in `fetch`.

    Raises:
        SettingError: As in `fetch`.
    """
    storage = _Storage.chosen("sent to")
    if storage is None:
        return
    try:
        _within(_ANSWERS + path.stat().st_size / _SLOWEST, partial(storage.put, path))
    except Exception as error:
        storage.give_up(label, error)


class _Storage:
    """The storage, for one kind of requests.

    Args:
        url: URL of the folder.
        use: The kind of requests, in words.
    """

    def __init__(self, url: str, use: str) -> None:
        self._url, self._use = url, use

    @classmethod
    def chosen(cls, use: str) -> _Storage | None:
        """Return the storage; None if there is none, or it has failed."""
        url = os.environ.get(VARIABLE, "")
        if not url or use in _refused:
            return None
        name = url.partition("://")[0] if "://" in url else "file"
        try:
            importlib.import_module("fsspec").get_filesystem_class(name)
        except (ImportError, ValueError) as error:
            limit = f"a URL such as s3://bucket/folder, with the library for it installed ({error})"
            raise SettingError(VARIABLE, _public(url, url), limit) from error
        return cls(url, use)

    def find(self, name: str) -> tuple[Any, str, int]:
        """Return the file system, the path in it and the size of an entry."""
        files, folder = self._open()
        there = f"{folder}/{name}"
        return files, there, int(files.info(there)["size"])

    def put(self, path: Path) -> None:
        """Copy a file of this machine."""
        files, folder = self._open()
        files.put_file(str(path), f"{folder}/{path.name}")

    def _open(self) -> tuple[Any, str]:
        # Some kinds of storage connect here.
        files, folder = importlib.import_module("fsspec.core").url_to_fs(self._url)
        return files, folder.rstrip("/")

    def give_up(self, label: str, error: Exception) -> None:
        """Ask no more in this process, and say so."""
        _refused.add(self._use)
        reported = _public(str(error) or type(error).__name__, self._url)
        words = "the %s cannot be %s %s, and nothing more until the next start (%s)"
        event = {"event": "shared_cache_lost"}
        _LOG.warning(words, label, self._use, self, reported, extra=event)

    def __str__(self) -> str:
        return _public(self._url, self._url)


def _public(text: str, url: str) -> str:
    """Return a text without the user, the password and the signature that a URL may have."""
    user = url.partition("://")[2].partition("/")[0].rpartition("@")[0]
    for secret in (user, user.partition(":")[2], url.partition("?")[2]):
        if secret:
            text = text.replace(secret, "...")
    return text


def _within(seconds: float, call: Callable[[], T]) -> T:
    """Return what a call returns; raise TimeoutError, and leave it to itself, if it hangs."""
    results: list[T] = []
    errors: list[BaseException] = []

    def work() -> None:
        try:
            results.append(call())
        except BaseException as error:
            errors.append(error)

    worker = threading.Thread(target=work, daemon=True)
    worker.start()
    worker.join(seconds)
    if errors:
        raise errors[0]
    if not results:
        raise TimeoutError(f"no answer within {seconds:.3g} s")
    return results[0]
