"""When the page is built on the way into a wheel, with whose npm; and when modules are compiled."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from types import ModuleType
from typing import Any

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
    monkeypatch.setenv(hook.COMPILE, "")


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
    assert a_hook(root).dependencies() == []
    a_hook(root).initialize("standard", {})
    assert not (root / hook.BUNDLE).exists()


@pytest.mark.live
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
    assert a_hook(root).dependencies() == ([] if serves else [hook.NODE_WHEEL])


def a_hook(root: Path, target: str = "wheel") -> Any:
    return hook.BuildHook(str(root), {}, None, None, str(root), target)


@pytest.mark.parametrize("version", ["standard", "editable"])
def test_unless_it_is_required_nothing_is_compiled_and_what_was_is_left_out(
    root: Path, monkeypatch: pytest.MonkeyPatch, version: str
) -> None:
    folder = hook.compiled.folder(root)
    folder.mkdir(parents=True)
    (folder / "manifest.json").touch()
    for value in (None, "0"):
        if value is None:
            monkeypatch.delenv(hook.COMPILE)
        else:
            monkeypatch.setenv(hook.COMPILE, value)
        assert a_hook(root).dependencies() == []
        data: dict[str, Any] = {"force_include": {}}
        a_hook(root).initialize(version, data)
        assert data == {"force_include": {}}


def test_what_compiles_is_asked_for_where_it_is_required(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(hook.COMPILE, "require")
    assert a_hook(root).dependencies() == hook.compiler.TOOLS
    assert a_hook(root, "sdist").dependencies() == []  # sources only


@pytest.mark.live
def test_where_it_is_required_a_wheel_without_extensions_is_none(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(hook.COMPILE, "require")
    monkeypatch.delenv("PYTHONPATH", raising=False)
    # There is nothing that could be compiled here.
    with pytest.raises(RuntimeError):
        a_hook(root).initialize("standard", {"force_include": {}})


@pytest.mark.live
def test_a_wheel_with_extensions_is_for_one_python_and_an_editable_install_finds_them(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(hook.COMPILE, "require")
    package = root / "compiling"  # what compiles, of which only the end matters here
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "__main__.py").write_text("")
    folder = hook.compiled.folder(root)
    plain: dict[str, Any] = {"force_include": {}}
    a_hook(root).initialize("editable", plain)
    assert plain == {"force_include": {}}
    data: dict[str, Any] = {"force_include": {}}
    a_hook(root).initialize("standard", data)
    inside = f"cohaptic/_compiled/{hook.compiled.PYTHON}"
    assert data["force_include"] == {str(folder): inside}
    assert data["infer_tag"]
    assert not data["pure_python"]


def test_without_any_npm_it_asks_for_the_wheel(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(root))
    assert hook.system_npm() is None
