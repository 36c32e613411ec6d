from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import BinaryIO

import pytest

from cohaptic.errors import OutputError
from cohaptic.runtime.new_file import AppearedMeanwhile, is_stream, write_new


def write(path: Path, content: bytes = b"new", *, overwrite: bool = False) -> None:
    write_new(path, lambda file: file.write(content), overwrite=overwrite)


def no_links(*_: object) -> None:
    raise PermissionError(1, "Operation not permitted")


@pytest.mark.parametrize("links", [True, False])
def test_a_new_file_is_whole_and_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    if not links:  # FAT, and some network folders
        monkeypatch.setattr(os, "link", no_links)
    write(tmp_path / "a b.json")
    assert (tmp_path / "a b.json").read_bytes() == b"new"
    assert len(list(tmp_path.iterdir())) == 1
    umask = os.umask(0)
    os.umask(umask)
    assert (tmp_path / "a b.json").stat().st_mode & 0o777 == 0o666 & ~umask


@pytest.mark.parametrize("links", [True, False])
def test_a_file_that_appeared_meanwhile_stays_and_the_new_one_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    if not links:
        monkeypatch.setattr(os, "link", no_links)
    path = tmp_path / "x.json"

    def content(file: BinaryIO) -> None:
        path.write_bytes(b"old")
        file.write(b"new")

    with pytest.raises(AppearedMeanwhile, match="was not replaced; this one is kept as") as caught:
        write_new(path, content, overwrite=False)
    assert path.read_bytes() == b"old"
    assert caught.value.written.read_bytes() == b"new"


def test_a_file_is_replaced_only_on_a_wish_and_in_one_step(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(b"old")
    with path.open("rb") as reader:
        write(path, overwrite=True)
        assert reader.read() == b"old"
    assert path.read_bytes() == b"new"


def test_a_failure_leaves_the_old_file_and_no_part(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(b"old")

    def fails(file: BinaryIO) -> None:
        file.write(b"ne")
        raise OSError(28, "No space left on device")

    with pytest.raises(OutputError, match=r"it cannot be written \(No space left on device\)"):
        write_new(path, fails, overwrite=True)
    with pytest.raises(OutputError, match="No such file"):
        write(tmp_path / "no/x.json")
    assert [p.read_bytes() for p in tmp_path.iterdir()] == [b"old"]


def test_a_link_is_followed_and_stays(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "there")
    write(tmp_path / "link")
    assert (tmp_path / "there").read_bytes() == b"new"
    assert (tmp_path / "link").is_symlink()


def test_a_pipe_is_written_through_and_stays_one(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert is_stream(pipe)
    heard: list[bytes] = []
    reader = threading.Thread(target=lambda: heard.append(pipe.read_bytes()))
    reader.start()
    write(pipe)
    reader.join()
    assert heard == [b"new"]
    assert pipe.is_fifo()
