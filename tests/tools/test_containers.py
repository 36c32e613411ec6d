"""What `make containers` reads, asks for and takes away; tests/system has the run itself."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

import container_store
from container_store import Failed, Store


def test_containers_of_other_people_are_not_removed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[str] = []

    def elsewhere(_store: Store, *arguments: str, **_more: object) -> str:
        asked.append(arguments[0])
        return "/var/lib/containers/storage\n"

    monkeypatch.setattr(Store, "podman", elsewhere)
    with pytest.raises(Failed, match="keeps its images in /var/lib/containers/storage"):
        Store(tmp_path).clear()
    assert asked == ["info"]
    monkeypatch.setenv("CONTAINER_HOST", "ssh://lab.example")
    assert "CONTAINER_HOST" not in container_store.own_environment()


def test_what_is_mounted_in_a_folder_is_not_deleted_with_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    inside = tmp_path / "debian/proc"
    inside.mkdir(parents=True)

    def stuck(_folder: Path, _mounts: str) -> list[str]:
        return [str(inside)]

    def fails(*_command: object, **_options: object) -> None:
        """As umount does for what is in use."""

    monkeypatch.setattr(container_store, "mounts_below", stuck)
    monkeypatch.setattr(subprocess, "run", fails)
    with pytest.raises(Failed, match="debian/proc is in use"):
        container_store.delete(tmp_path)
    assert inside.exists()
