"""Packages of others that add commands, devices and bodies, and broken ones among them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import FunctionType
from typing import NoReturn

import pytest

from cohaptic import extensions
from cohaptic.cli.app import build_app
from cohaptic.errors import DeviceError
from cohaptic.extensions import ExtensionError, load
from cohaptic.simulated.hand import Hand
from cohaptic.vec import ZERO
from cohaptic_client.devices.catalogue import device_kind, open_device, search
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig
from cohaptic_server.objects.catalogue import build_body

DEVICES, BODIES = "cohaptic.devices", "cohaptic.bodies"
MODULE = """
from cohaptic_client import DeviceInfo, DeviceKind, Found

INFO = DeviceInfo("glove", max_force=1.0, max_stiffness=100.0)
KIND = DeviceKind("glove", "a glove", (), lambda choice: INFO, lambda config: None,
                  lambda: [Found("glove", "on a hand")])
NOT_A_KIND = 3.0

def no_body():
    return object()

def fails():
    raise RuntimeError("its data is missing")
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The metadata of an installed package; write `entry_points.txt` into it."""
    (tmp_path / "cohaptic_gloves.py").write_text(MODULE)
    about = tmp_path / "gloves-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: gloves\nVersion: 1.0\n")
    monkeypatch.syspath_prepend(tmp_path)  # pyright: ignore[reportUnknownMemberType]
    extensions.entries.cache_clear()
    yield about
    extensions.entries.cache_clear()


def adds(package: Path, group: str, **entries: str) -> None:
    """Let the package add entries to a group."""
    lines = [f"{name} = cohaptic_gloves:{what}" for name, what in entries.items()]
    (package / "entry_points.txt").write_text("\n".join([f"[{group}]", *lines]) + "\n")
    extensions.entries.cache_clear()


@pytest.fixture
def only_gloves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look for no other device, which would look at this machine."""
    monkeypatch.setattr("cohaptic_client.devices.catalogue.names", lambda: ["glove", "simulated"])


@pytest.mark.usefixtures("only_gloves")
def test_it_is_looked_for(package: Path) -> None:
    adds(package, DEVICES, glove="KIND")
    found, missing = search()
    assert [each.choice for each in found] == ["glove"]
    assert missing == []


@pytest.mark.parametrize(
    ("what", "why"),
    [
        ("NOT_A_KIND", "cohaptic_gloves:NOT_A_KIND is a float and no DeviceKind"),
        ("ABSENT", "AttributeError: module 'cohaptic_gloves' has no attribute 'ABSENT'"),
    ],
)
@pytest.mark.usefixtures("only_gloves")
def test_a_broken_package_is_named_and_the_others_are_found(
    package: Path, what: str, why: str
) -> None:
    adds(package, DEVICES, glove=what)
    with pytest.raises(ExtensionError) as caught:
        device_kind("glove")
    assert str(caught.value) == f"glove, which the package gloves adds, cannot be used: {why}"
    _, missing = search()
    assert ("glove", why) in [(error.device, error.problem) for error in missing]


def test_a_broken_command_leaves_the_others(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    adds(package, "cohaptic.commands", knit="ABSENT")
    commands = build_app().registered_commands
    assert {"serve", "touch"} <= {command.name for command in commands}
    assert "knit, which the package gloves adds, cannot be used" in capsys.readouterr().err
    with pytest.raises(ExtensionError, match="knit"):
        build_app(only="knit")


@pytest.mark.parametrize(
    ("what", "why"), [("no_body", "its body has no name"), ("fails", "its data is missing")]
)
def test_a_body_that_is_none_is_refused(package: Path, what: str, why: str) -> None:
    adds(package, BODIES, glove=what)
    with pytest.raises(ExtensionError, match=f"glove, which the package .* adds, .*{why}"):
        build_body("glove")


def claims(folder: Path, package: str, group: str, name: str, what: str) -> None:
    """A second package that adds an entry."""
    about = folder / f"{package}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{group}]\n{name} = cohaptic_gloves:{what}\n")


def test_two_packages_that_add_one_name_are_both_refused(package: Path) -> None:
    adds(package, DEVICES, glove="KIND")
    claims(package.parent, "mittens", DEVICES, "glove", "KIND")
    extensions.entries.cache_clear()
    with pytest.raises(ExtensionError, match=r"glove, which the package .* adds one of that name"):
        device_kind("glove")


def test_what_is_ours_is_taken_by_nobody(package: Path) -> None:
    adds(package, DEVICES, haply="KIND")
    assert device_kind("haply").summary != "a glove"
    adds(package, "cohaptic.commands", serve="no_body")
    assert (
        load("cohaptic.commands", "serve", FunctionType).__module__ == "cohaptic_server.cli.serve"
    )


@pytest.mark.usefixtures("only_gloves")
def test_a_driver_of_others_that_fails_costs_nobody_elses(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    adds(package, DEVICES, glove="KIND")

    def fails(*_: object) -> NoReturn:
        raise OSError("no such glove")

    kind = replace(device_kind("glove"), find=fails, open=fails)
    kinds = {"glove": kind, "simulated": device_kind("simulated")}
    monkeypatch.setattr("cohaptic_client.devices.catalogue.device_kind", kinds.__getitem__)
    _, missing = search()
    assert str(missing[0]) == "glove: its driver failed (no such glove)"
    config = DeviceConfig(DeviceChoice("glove"), ZERO, 0.1, Hand(), None)
    with pytest.raises(DeviceError, match="its driver failed"):
        open_device(config)
