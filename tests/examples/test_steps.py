"""The steps of the course in `examples/`, each as its own program or notebook."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

import nbclient
import nbformat
import pytest

FOLDER = Path(__file__).parents[2] / "examples"
STEPS = sorted(FOLDER.glob("step_*"))


def step(number: int) -> Path:
    (path,) = FOLDER.glob(f"step_{number}_*")
    return path


def read(path: Path) -> Any:
    """A notebook, whose library has no types."""
    return cast(Any, nbformat).read(path, as_version=4)


def play(number: int, *arguments: str) -> str:
    """Run a step to its end; return what it prints."""
    command = [sys.executable, "-W", "error::ResourceWarning", str(step(number)), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout


def forces(text: str) -> list[float]:
    return [float(found) for found in re.findall(r"force\s+(-?[\d.]+) N", text)]


def test_they_are_numbered_and_short() -> None:
    assert [int(path.name.split("_")[1]) for path in STEPS] == list(range(1, len(STEPS) + 1))
    for path in STEPS:
        lines = path.read_text().splitlines()
        if path.suffix == ".ipynb":
            cells = read(path).cells
            code = [cell for cell in cells if cell.cell_type == "code"]
            assert not any(cell.outputs or cell.execution_count for cell in code)
            lines = "\n".join(cell.source for cell in code).splitlines()
        assert 20 <= len(lines) <= 65, path.name


@pytest.mark.live
@pytest.mark.smoke
def test_2_a_script_presses_and_asks_why() -> None:
    said = play(2)
    assert forces(said)[-1] == pytest.approx(5.7, abs=0.2)
    assert "by the surface" in said
    assert "touching: touching balloon" in said


@pytest.mark.live
@pytest.mark.smoke
def test_1_and_2_a_script_joins_a_room_of_another_program() -> None:
    command = [sys.executable, "-u", str(step(1)), "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        found = re.search(r"ws://\S+", server.stdout.readline())
        assert found is not None
        said = play(2, found[0])
        assert server.stdout.readline() == "ann joined\n"
        assert server.stdout.readline() == "ann left\n"
        server.terminate()
    assert forces(said)[-1] > 2.0


@pytest.mark.live
@pytest.mark.smoke
def test_3_a_device_of_your_own_is_felt() -> None:
    felt = forces(play(3))
    assert max(felt) > 0.5
    assert min(felt) == 0.0


@pytest.mark.live
@pytest.mark.smoke
def test_5_a_controller_of_your_own_is_in_the_ledger() -> None:
    moving, resting = play(5).splitlines()
    assert "by spring_damper" in moving
    assert "by spring_damper" not in resting


@pytest.mark.live
@pytest.mark.smoke
def test_6_every_millisecond_is_drawn(tmp_path: Path) -> None:
    picture = tmp_path / "press.png"
    said = play(6, str(picture))
    assert picture.read_bytes().startswith(b"\x89PNG")
    counts = [int(count) for count in re.findall(r"(\d+)(?=,| samples)", said)]
    # 4 s at 1 kHz; a busy machine skips periods.
    assert all(2000 < count <= 4010 for count in counts[-2:])


@pytest.mark.live
@pytest.mark.smoke
def test_7_the_other_hand_is_felt_over_any_network() -> None:
    felt = [float(newtons) for newtons in re.findall(r": ([\d.]+) N of", play(7))]
    assert len(felt) == 3
    assert min(felt) > 0.95 * max(felt) > 1.0


@pytest.mark.live
@pytest.mark.smoke
def test_8_a_notebook_shows_a_room_and_its_forces() -> None:
    book = read(step(8))
    nbclient.NotebookClient(book, timeout=240, kernel_name="python3").execute()
    outputs = [output for cell in book.cells for output in cell.get("outputs", [])]
    view, forces, plot, said = outputs
    assert "application/vnd.jupyter.widget-view+json" in view.data
    assert "watching balloon" in view.data["text/plain"]
    ann, bob = (float(newtons) for newtons in re.findall(r": ([\d.]+) N", forces.text))
    # Each holds against the other through the balloon: bob alone has 1.4 N.
    assert ann > 2.0
    assert bob > 2.0
    assert "image/png" in plot.data
    assert "ann 0.00 N" in said.text
