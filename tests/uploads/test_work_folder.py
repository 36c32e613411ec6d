"""Folders of uploads go with their server, however it ends; those of the living stay."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cohaptic_uploads.limits import UploadLimits
from cohaptic_uploads.process import UploadFailed, WorkerProcess
from cohaptic_uploads.work_folder import WorkFolder, bytes_in_work, remove_abandoned

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="has no such locks"),
]
SERVER = """
import sys
from cohaptic_uploads.work_folder import WorkFolder
folder = WorkFolder()
(folder.path / "within").mkdir()
(folder.path / "within" / "object.stl").write_bytes(bytes(1000))
print(folder.path, flush=True)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    return tmp_path


def make_old(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As if all that is there had been made an hour ago."""
    monkeypatch.setattr("cohaptic.runtime.owned_files._MADE", -3600.0)
    assert any(folder.iterdir())


def test_the_folder_of_a_server_that_was_killed_is_removed_by_the_next(
    temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = subprocess.Popen(
        [sys.executable, "-c", SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert server.stdout is not None
        path = Path(server.stdout.readline().decode().strip())
        make_old(temporary, monkeypatch)
        assert bytes_in_work(0) == 1000
        assert bytes_in_work(5000) == 5000  # of one that is still to write
        assert remove_abandoned() == 0
        assert path.is_dir()
    finally:
        server.kill()
        server.communicate()
    assert remove_abandoned() == 1
    assert list(temporary.iterdir()) == []


def test_what_is_elsewhere_stays(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = WorkFolder()
    (folder.path / "a").write_bytes(b"1")
    elsewhere = temporary / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "b").write_bytes(b"2")
    (folder.path / "link").symlink_to(elsewhere)
    (temporary / "cohaptic-upload-x.lock").write_bytes(b"")
    (temporary / "cohaptic-upload-x.lock.files").symlink_to(elsewhere)
    make_old(temporary, monkeypatch)
    assert remove_abandoned() == 1
    folder.close()
    assert sorted(os.listdir(temporary)) == ["elsewhere"]
    assert (elsewhere / "b").exists()


def test_all_uploads_together_hold_no_more_of_the_disk_than_their_limit(temporary: Path) -> None:
    other = WorkFolder()
    with (other.path / "filled").open("wb") as file:
        file.truncate(2**30)  # of another server, say
    with pytest.raises(UploadFailed, match=r"hold 1,024 MiB of the disk .* limit is 1,024 MiB"):
        WorkerProcess(UploadLimits(), "a.stl")
    other.close()
    WorkerProcess(UploadLimits(), "a.stl").close()
    assert list(temporary.iterdir()) == []


def test_what_others_put_beside_counts_for_nobody(
    temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All may write into the folder for what is temporary."""
    elsewhere = temporary / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "large").write_bytes(bytes(1000))
    (temporary / "cohaptic-upload-x.lock.files").symlink_to(elsewhere)
    assert bytes_in_work(10) == 0
    folder = WorkFolder()
    assert bytes_in_work(10) == 10
    monkeypatch.setattr(os, "getuid", lambda: temporary.stat().st_uid + 1)
    assert bytes_in_work(10) == 0
    folder.close()
