"""What `make containers` reads, asks for and takes away; tests/system has the run itself."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

import container_store
import containers
from container_store import PACKAGES, Failed, Store, missing, mounts_below
from containers import ROOT, base_of, checked, feels, image_of, scraped

COMPOSE = (ROOT / "docker-compose.yml").read_text()
yaml: Any = pytest.importorskip("yaml")


def nothing(_command: str) -> str | None:
    return None


def test_images_are_those_that_the_files_name() -> None:
    services = yaml.safe_load(COMPOSE)["services"]
    for name in ("server", "proxy", "prometheus", "grafana"):
        assert image_of(name, COMPOSE) == services[name]["image"]
    assert base_of((ROOT / "deploy/Dockerfile").read_text()).startswith("docker.io/library/python:")


@pytest.mark.parametrize(
    "text", ["", "services:\n  proxy:\n    ports: [1]\n  ada:\n    image: x\n"]
)
def test_a_service_without_an_image_is_not_given_that_of_the_next(text: str) -> None:
    with pytest.raises(Failed, match="names no image for proxy"):
        image_of("proxy", text)


def test_what_is_missing_is_said_by_its_packages_and_one_of_two_runtimes_is_enough() -> None:
    assert missing(nothing) == list(PACKAGES.values())
    assert missing(lambda command: command) == []
    assert missing(lambda command: None if command == "runc" else command) == []
    assert missing(lambda command: None if command in ("runc", "crun") else command) == ["runc"]


@pytest.mark.parametrize(
    ("uid", "packages", "words"),
    [
        (1000, [], "sudo make containers"),
        (0, ["podman", "runc"], "apt-get install --no-install-recommends podman runc"),
        (0, [], "pip wheel --no-deps"),
    ],
)
def test_who_lacks_something_is_told_what_to_do_and_nothing_is_installed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, uid: int, packages: list[str], words: str
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: uid)
    monkeypatch.setattr(containers, "missing", lambda: packages)
    with pytest.raises(Failed, match=words):  # a process would fail this test, which is not live
        checked(tmp_path, install=False)


def test_all_that_podman_keeps_is_kept_in_the_folder(tmp_path: Path) -> None:
    store = Store(tmp_path / "store")
    assert not store.is_open
    settings = store.settings("runc")
    for name, variable in (
        ("containers.conf", "CONTAINERS_CONF"),
        ("storage.conf", "CONTAINERS_STORAGE_CONF"),
    ):
        assert store.environment[variable] == str(store.folder / name)
        paths = [line.split('"')[1] for line in settings[name].splitlines() if ' = "/' in line]
        assert len(paths) > 1
        assert all(Path(path).parent == store.folder for path in paths)


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


def test_a_folder_for_it_that_is_not_there_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path / "none"))
    with pytest.raises(Failed, match=r"TMPDIR is .*none; it must be a folder"):
        containers.folder_with_space()


MOUNTS = r"""proc /a/b/proc proc rw 0 0
sys /a/b/proc/sys sysfs rw 0 0
other /a/bc tmpfs rw 0 0
odd /a/b/with\040space tmpfs rw 0 0
self /a/b ext4 rw 0 0
"""


def test_mounts_in_a_folder_are_found_the_deepest_first_and_its_neighbours_are_left() -> None:
    assert mounts_below(Path("/a/b"), MOUNTS) == ["/a/b/proc/sys", "/a/b/proc", "/a/b/with space"]


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


def test_a_line_tells_of_a_force_if_it_is_above_zero() -> None:
    line = '{"name":"ada","force":1.5,"felt_from_others":0.0,"max_force":10.0}'
    assert feels(line)
    assert not feels(line, others=True)
    assert feels(line.replace("0.0", "2e-3"), others=True)
    for other in ("", "touching", '{"name":"ada"}', '{"force":null}', '{"max_force":10.0}', "{"):
        assert not feels(other)


def test_prometheus_answers_with_one_value_or_with_none() -> None:
    assert scraped(b'{"data":{"result":[{"metric":{},"value":[1.0,"2"]}]}}') == 2.0
    assert scraped(b'{"data":{"result":[]}}') is None
