"""When the page is built on the way into a wheel, and with whose npm."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from types import ModuleType

import pytest


def _load() -> ModuleType:
    """The hook as hatchling loads it: by its path."""
    path = Path(__file__).parents[1] / "hatch_build.py"
    spec = importlib.util.spec_from_file_location("hatch_build", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


hook = _load()


@pytest.fixture(autouse=True)
def nothing_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(hook.COMPILE, "0")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A checkout whose bundle is newer than its sources."""
    for name in ("web/src/view/main.ts", "web/package.json", "web/tests/a.test.ts", hook.BUNDLE):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (1000.0, 1000.0))
    return tmp_path


def touch(path: Path, at: float) -> None:
    os.utime(path, (at, at))


def test_a_bundle_of_the_same_age_serves_as_in_an_sdist(root: Path) -> None:
    assert not hook.is_stale(root)


@pytest.mark.parametrize("source", ["web/src/view/main.ts", "web/package.json"])
def test_a_newer_source_makes_the_bundle_stale(root: Path, source: str) -> None:
    touch(root / source, 1001.0)
    assert hook.is_stale(root)


def test_a_newer_test_does_not(root: Path) -> None:
    touch(root / "web/tests/a.test.ts", 1001.0)
    assert not hook.is_stale(root)


def test_a_missing_bundle_is_stale_where_there_are_sources(root: Path) -> None:
    (root / hook.BUNDLE).unlink()
    assert hook.is_stale(root)
    assert not hook.is_stale(root / "server")


def test_it_can_be_told_to_leave_the_page_out(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (root / hook.BUNDLE).unlink()
    monkeypatch.setenv(hook.SKIP, "1")
    a_hook = hook.BuildHook(str(root), {}, None, None, str(root), "wheel")
    assert a_hook.dependencies() == []
    a_hook.initialize("standard", {})
    assert not (root / hook.BUNDLE).exists()


@pytest.mark.parametrize(
    ("version", "serves"),
    [("v18.20.4", False), ("v20.18.3", False), ("v20.19.0", True), ("v21.7.3", False),
     ("v22.11.0", False), ("v22.12.0", True), ("v26.0.0", True), ("?", False)],
)  # fmt: skip
def test_a_node_that_is_too_old_for_vite_is_passed_over(
    root: Path, monkeypatch: pytest.MonkeyPatch, version: str, serves: bool
) -> None:
    folder = root / "bin"
    folder.mkdir()
    for name in ("node", "npm"):
        (folder / name).write_text(f"#!/bin/sh\necho '{version}'\n")
        (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(folder))
    assert hook.system_npm() == (str(folder / "npm") if serves else None)
    (root / hook.BUNDLE).unlink()
    a_hook = hook.BuildHook(str(root), {}, None, None, str(root), "wheel")
    assert a_hook.dependencies() == ([] if serves else [hook.NODE_WHEEL])


def test_without_any_npm_it_asks_for_the_wheel(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(root))
    assert hook.system_npm() is None
