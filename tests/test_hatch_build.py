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


@pytest.mark.parametrize("source", ["web/src/view/main.ts", "web/package.json"])
def test_a_newer_source_makes_the_bundle_stale(root: Path, source: str) -> None:
    touch(root / source, 1001.0)
    assert hook.is_stale(root)


def test_a_missing_bundle_is_stale_where_there_are_sources(root: Path) -> None:
    (root / hook.BUNDLE).unlink()
    assert hook.is_stale(root)
    assert not hook.is_stale(root / "server")


def a_hook(root: Path, target: str = "wheel") -> Any:
    return hook.BuildHook(str(root), {}, None, None, str(root), target)


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
