"""`cohaptic devices` and `doctor` on an emulated service and a board on a pseudo-terminal."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

from cohaptic.vec import norm
from cohaptic_client import devices_cli
from cohaptic_client.devices_cli import devices
from cohaptic_client.doctor import doctor
from cohaptic_drivers.haply import inverse3
from cohaptic_drivers.oneaxis import link as oneaxis_link
from cohaptic_drivers.oneaxis import oneaxis_kind
from tests.client.devices.until import SteadyClock, until
from tests.drivers.haply.emulator import EmulatedArm, HaplyEmulator
from tests.drivers.haply.haply_bench import be_patient

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]


@pytest.fixture
def service(monkeypatch: pytest.MonkeyPatch) -> Iterator[HaplyEmulator]:
    """The emulator where the service is looked for."""
    be_patient(monkeypatch)
    emulator = HaplyEmulator([EmulatedArm("049D"), EmulatedArm("04A1")])
    monkeypatch.setattr(inverse3, "URLS", (emulator.url,))
    yield emulator
    emulator.close()


def said(*arguments: str, status: int = 0) -> str:
    app = typer.Typer()
    app.add_typer(devices, name="devices")
    app.command("doctor")(doctor)
    words = ["doctor", "--seconds", "0"] if arguments == ("doctor",) else ["devices", *arguments]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == status, result.output
    return result.output


def test_what_is_found_is_listed_with_how_to_choose_it(service: HaplyEmulator) -> None:
    text = said()
    assert "--device haply:id=049D " in text
    assert "--device haply:id=04A1 " in text
    assert "--device simulated" in text


def test_the_doctor_says_what_is_wrong_and_what_to_do(service: HaplyEmulator) -> None:
    service.arms["049D"].status["power_supply"] = False
    service.arms["04A1"].status["calibrated"] = False
    text = said("doctor", status=1)
    assert "haply:id=049D" in text
    assert (
        "has no power: it senses, and gives no force\n         to do: plug its power supply in"
        in text
    )
    assert (
        "device 04A1 is not calibrated\n         to do: put its arms into the resting position"
        in text
    )
    assert "ok       hidapi: " in text


@pytest.fixture
def plugged() -> Iterator[contextlib.ExitStack]:
    """Boards in it are unplugged also by a test that fails: their threads would never rest."""
    with contextlib.ExitStack() as boards:
        yield boards


@pytest.mark.alone
def test_a_one_axis_board_is_found_asked_knocked_with_and_calibrated(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, plugged: contextlib.ExitStack
) -> None:
    from tests.drivers.oneaxis.board import Board

    boards = [Board(), Board(), Board()]
    for board in boards:
        plugged.callback(board.unplug)
    boards[1].silent, boards[2].instead = True, b"[3,0,0,0,0,0,0,0]\n" * 20
    ports = [SimpleNamespace(device=board.path) for board in boards]
    monkeypatch.setattr(oneaxis_kind, "find_ports", lambda: ports)
    monkeypatch.setattr(oneaxis_link, "FIRST_ANSWER", 2.0)
    text = said("doctor", status=1)
    monkeypatch.setattr(oneaxis_link, "FIRST_ANSWER", 20.0)
    assert f"oneaxis:port={boards[0].path} ({boards[0].path}): ready" in text
    for board in boards[1:]:
        assert (
            f"what is at {board.path} does not answer as such a board does\n         to do: see"
            in text
        )
    unit = tmp_path / "mine.toml"
    unit.write_text("sensor_direction = 1\nmotor_direction = 1\ntorque_constant = 0.02\n")
    # It pushes along its axis only, whichever way that is turned.
    text = said("pulse", f"oneaxis:port={boards[0].path},unit={unit},turn=90")
    assert "it moved " in text  # how far depends on how busy this machine is: `test_handle`
    assert min(current for _, current in boards[0].given) < -0.02
    until(lambda: boards[0].current == 0.0)
    result = CliRunner().invoke(devices, ["pulse", f"oneaxis:port={boards[0].path}"])
    assert "it only senses" in str(result.exception)
    result = CliRunner().invoke(
        devices, ["calibrate", f"oneaxis:port={boards[0].path}"], input="\n\n\n"
    )
    assert "its sensor told 0 counts for 40 mm" in str(result.exception)
    result = CliRunner().invoke(devices, ["calibrate", "haply"])
    assert "one that is calibrated so: oneaxis" in str(result.exception)


def test_a_knock_goes_to_the_one_that_was_asked_for(
    service: HaplyEmulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(devices_cli, "SystemClock", SteadyClock)  # no knock is passed over
    said("pulse", "haply:id=04A1")
    knocked = {device for _, device, force in service.given if norm(force) > 0.0}
    assert knocked == {"04A1"}
    until(lambda: service.arms["04A1"].force == (0.0, 0.0, 0.0))


@pytest.mark.parametrize("name", ["haply", "oneaxis", "woodenhaptics", "spacemouse"])
def test_options_are_explained(name: str) -> None:
    assert f"{name}: " in said("options", name)
    assert "  scale: metres in the world" in said("options", name)
