"""Machines with a cache each, and one storage: a folder, or S3 as moto's server has it."""

from __future__ import annotations

import importlib
import importlib.util
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cohaptic.errors import SettingError
from cohaptic_server.objects.store import shared
from cohaptic_server.objects.store.cache import entry_path, has_entry, load_entry, save_entry

ARRAYS = {"a": np.arange(1000.0)}


@pytest.fixture
def storage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "storage"
    folder.mkdir()
    monkeypatch.setenv(shared.VARIABLE, folder.as_uri())
    monkeypatch.setattr(shared, "_refused", set[str]())
    on(tmp_path / "one", monkeypatch)
    return folder


def on(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(machine))


def test_a_machine_finds_what_another_has_prepared(
    storage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert load_entry(entry_path(b"x"), "thing") is None
    save_entry(entry_path(b"x"), "thing", ARRAYS)
    save_entry(entry_path(b"y"), "half", ARRAYS, for_all=False)
    assert [file.name for file in storage.iterdir()] == [entry_path(b"x").name]
    on(tmp_path / "two", monkeypatch)
    assert has_entry(entry_path(b"x"), "thing")
    shutil.rmtree(storage)  # it is here now
    found = load_entry(entry_path(b"x"), "thing")
    assert found is not None
    np.testing.assert_array_equal(found["a"], ARRAYS["a"])
    assert load_entry(entry_path(b"y"), "half") is None
    assert [file.name for file in (tmp_path / "two").iterdir()] == [entry_path(b"x").name]


def test_a_damaged_entry_is_not_kept_and_made_anew_for_all(
    storage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    save_entry(entry_path(b"x"), "thing", ARRAYS)
    there = storage / entry_path(b"x").name
    whole = there.read_bytes()
    on(tmp_path / "two", monkeypatch)
    for damaged in (whole[:-64], whole[:-64] + bytes(64), b"", b"{"):
        there.write_bytes(damaged)
        caplog.clear()
        # It looks at one array only, and at that of the whole file.
        assert load_entry(entry_path(b"x"), "thing", under="nothing") is None
        assert "the thing at file://" in caplog.text
        assert "cannot be used, and is made anew" in caplog.text
        assert list((tmp_path / "two").iterdir()) == []
    save_entry(entry_path(b"x"), "thing", ARRAYS)
    assert there.read_bytes() == whole


@pytest.mark.parametrize("url", ["nowhere://anna:secret@bucket/x", "s4://bucket/x?sig=secret"])
def test_a_url_of_no_known_kind_is_refused_without_its_password(
    storage: Path, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    del storage
    monkeypatch.setenv(shared.VARIABLE, url)
    with pytest.raises(
        SettingError, match="it must be a URL such as s3://bucket/folder"
    ) as reported:
        load_entry(entry_path(b"x"), "thing")
    assert "secret" not in str(reported.value)


@pytest.mark.live
@pytest.mark.parametrize("hangs", [False, True])
def test_storage_that_does_not_answer_is_not_asked_again(
    storage: Path, hangs: bool, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    del storage
    monkeypatch.setattr(shared, "_ANSWERS", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        if not hangs:
            silent.close()
        monkeypatch.setenv(shared.VARIABLE, f"ftp://anna:secret@127.0.0.1:{port}/x")
        assert load_entry(entry_path(b"x"), "thing") is None
        assert load_entry(entry_path(b"y"), "thing") is None
    (record,) = caplog.records
    assert "the thing cannot be fetched from ftp://...@127.0.0.1" in record.message
    assert ("no answer within 0.1 s" if hangs else "refused") in record.message
    assert "secret" not in record.message


@pytest.fixture
def bucket() -> Generator[dict[str, str]]:
    """Environment of a machine that knows a bucket of S3."""
    if importlib.util.find_spec("moto") is None or importlib.util.find_spec("s3fs") is None:
        pytest.skip("the extra cluster-tests")
    # Neither has types, and both are there with the extra only.
    server = importlib.import_module("moto.server").ThreadedMotoServer("127.0.0.1", 0)
    server.start()
    host, port = server.get_host_and_port()
    known = {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "testing",
        "AWS_SECRET_ACCESS_KEY": "testing",
        "AWS_DEFAULT_REGION": "us-east-1",
        shared.VARIABLE: f"s3://objects-{port}/prepared",  # moto keeps all in this process
    }
    try:
        files = importlib.import_module("s3fs").S3FileSystem(
            endpoint_url=known["AWS_ENDPOINT_URL"], key="testing", secret="testing"
        )
        files.mkdir(f"objects-{port}")
        yield known
    finally:
        server.stop()


@pytest.mark.live
def test_an_object_is_prepared_once_for_all_machines_on_s3(
    bucket: dict[str, str], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "werkzeug")  # a line for each request
    ball = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=2, radius=0.05).export(ball)  # pyright: ignore[reportUnknownMemberType]
    for name in ("one", "two"):
        _prepare(ball, tmp_path / name, bucket)
    kept = [sorted(file.name for file in (tmp_path / name).iterdir()) for name in ("one", "two")]
    assert kept[0] == kept[1] != []
    folder = bucket[shared.VARIABLE].removeprefix("s3:/")
    for name in kept[0]:
        assert caplog.text.count(f'"PUT {folder}/{name} HTTP') == 1
        assert f"GET {folder}/{name} HTTP" in caplog.text
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def _prepare(path: Path, cache: Path, known: dict[str, str]) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "cohaptic", "body", "prepare", str(path), "--auto"],
        env=os.environ | known | {"COHAPTIC_CACHE": str(cache)},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout + done.stderr
