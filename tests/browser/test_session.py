"""A recorded session on the page: any moment of it, with forces, surface and reasons."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cohaptic.protocol.scene_users import decode_users
from cohaptic.sessions.entries import Mark, Shown
from cohaptic.sessions.reader import read_entries
from cohaptic.vec import norm
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.catalogue import build_body
from tests.browser.conftest import Open
from tests.browser.looking_back import scrub, share, whole_picture
from tests.browser.test_access import AXE, Theme, violations
from tests.browser.test_sizes import OUT
from tests.browser.test_watch import difference
from tests.browser.visitor import Look, Visitor
from tests.patience import PATIENCE
from tests.recorded_sessions import record

pytestmark = pytest.mark.live

Show = Callable[[Path], str]
# What is cut off at the right of the stage or of the window.
_OUTSIDE = """() => [...document.querySelectorAll(".replay *, .legend, .bar button, .panel *")]
  .filter((part) => part.checkVisibility({ visibilityProperty: true }))
  .filter((part) => !["OPTION", "SPAN"].includes(part.tagName))
  .filter((part) => {
    const { left, right, width } = part.getBoundingClientRect();
    const edge = part.closest(".stage")?.getBoundingClientRect().right ?? innerWidth;
    return width > 0 && (left < -0.5 || right > edge + 0.5);
  })
  .map((part) => part.className.toString() || part.outerHTML)"""


@pytest.fixture
def show() -> Iterator[Show]:
    """Starts replays that end with the test; the address of the page of each."""
    started = list[subprocess.Popen[str]]()

    def start(path: Path) -> str:
        words = ["replay", str(path), "--no-browser", "--lifeline"]
        process = subprocess.Popen(
            [sys.executable, "-m", "cohaptic", *words], text=True, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )  # fmt: skip
        started.append(process)
        assert process.stdout is not None
        return process.stdout.readline().split()[1]

    yield start
    for process in started:
        process.communicate("", timeout=PATIENCE)
        assert process.returncode == 0


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("session") / "lab.mcap", 8.0)


def open_at(visitor: Visitor, address: str, t: float) -> None:
    visitor.page.goto(f"{address}&t={t}")
    visitor.until(lambda: visitor.text(".replay-tag") == "Recorded", "the session")
    whole_picture(visitor)


def when(visitor: Visitor) -> float:
    """The shown time since the beginning [s]."""
    found = re.match(r"(\d+):([\d.]+) of ", visitor.text(".replay-when"))
    assert found is not None, visitor.words()
    return 60.0 * int(found[1]) + float(found[2])


def forces_at(path: Path, t: float) -> dict[int, float]:
    """Sizes of the forces in the scene at a time since the first one [N]."""
    scenes = [entry for entry in read_entries(path) if isinstance(entry, Shown)]
    scene = [each for each in scenes if each.t <= scenes[0].t + t + 1e-9][-1]
    return {user.user: norm(user.force) for user in decode_users(scene.frame).users}


def test_any_moment_has_the_forces_the_surface_and_the_reasons_that_it_had(
    show: Show, visitors: Open, path: Path
) -> None:
    ann = visitors(Look(1280, 800, engineer=False))
    address = show(path)
    open_at(ann, address.removesuffix("?session") + "?session", 5.5)
    assert when(ann) == pytest.approx(5.5, abs=0.05)
    forces = forces_at(path, 5.5)
    assert ann.force_of("Ann") == pytest.approx(forces[1], abs=0.05)
    assert ann.force_of("Ben") == pytest.approx(forces[2], abs=0.05)
    pressed = whole_picture(ann)
    ann.until(lambda: "The hand was given" in ann.text(".session-why"), "a reason")
    # A mark in the list and its key lead to the same moment, and back the picture is the same.
    mark = next(entry for entry in read_entries(path) if isinstance(entry, Mark))
    first = next(entry.t for entry in read_entries(path) if isinstance(entry, Shown))
    ann.page.click(".moment.mark")
    ann.until(lambda: ann.text(".replay-moment") == "trial 1", "the mark")
    assert when(ann) == pytest.approx(mark.t - first, abs=0.06)
    before = share(ann)
    ann.page.locator(".stage-host").focus()
    ann.page.keyboard.press("n")
    ann.until(lambda: share(ann) > before, "the next event")
    ann.page.keyboard.press("Shift+N")
    ann.until(lambda: share(ann) == before, "the mark again")
    scrub(ann, 0.0)
    ann.until(lambda: when(ann) == 0.0, "the beginning")
    assert difference(pressed, whole_picture(ann)) > 0.05
    ann.page.goto(f"{address}&t=5.5")
    ann.until(lambda: ann.text(".replay-tag") == "Recorded", "the session")
    assert difference(pressed, whole_picture(ann)) < 0.02


def test_it_plays_to_its_end_at_any_pace_and_nobody_can_touch(
    show: Show, visitors: Open, path: Path
) -> None:
    ann = visitors(Look(1280, 800))
    open_at(ann, show(path), 0.0)
    ann.page.locator(".replay .choice-option", has_text="10").last.click()
    ann.page.click(".replay-play")
    ann.until(lambda: share(ann) == 1.0, "the end")
    ann.until(lambda: ann.page.locator(".replay-play[aria-label=Play]").count() == 1, "it to stand")
    ann.page.locator(".stage-host").focus()
    here = when(ann)
    for key in ("t", "g", "b", "p", "v", "Escape", "."):
        ann.page.keyboard.press(key)
    ann.page.mouse.move(400, 400)
    ann.page.mouse.down()
    ann.page.mouse.up()
    ann.catch_up()
    assert when(ann) == here
    assert ann.text(".replay-tag") == "Recorded"
    for part in (".dock", ".tour-button", ".share-button", ".offers", ".tour", ".notice-words"):
        assert ann.text(part) == ""
    ann.page.keyboard.press("ArrowLeft")
    ann.until(lambda: share(ann) < 1.0, "a frame back")


def test_surfaces_in_the_file_are_shown_and_what_is_not_is_told(
    show: Show, visitors: Open, tmp_path: Path
) -> None:
    pictures = list[Floats]()
    viscous = build_body("balloon", damping=2.0)
    kinds: tuple[tuple[str, dict[str, Any], dict[str, Any]], ...] = (
        ("viscous", {"body": viscous, "surfaces": True}, {"body": "balloon", "relaxation": 0.03}),
        ("unknown", {}, {"body": "liver.obj"}),
    )
    for name, more, settings in kinds:
        ann = visitors(Look(1280, 800, engineer=False))
        made = record(tmp_path / f"{name}.mcap", 4.0, settings=settings, **more)
        open_at(ann, show(made), 2.9)
        pictures.append(whole_picture(ann))
        told = ann.text(".session-note")
        assert ("liver.obj is no object of the catalogue" in told) is (name == "unknown")
    assert difference(*pictures) > 0.05


@pytest.mark.parametrize(
    "look",
    [
        Look(360, 740, phone=True), Look(768, 1024), Look(1280, 800), Look(1920, 1080),
        Look(844, 390, phone=True),
    ],
    ids=str,
)  # fmt: skip
def test_nothing_is_cut_off_and_everybody_can_use_it(
    show: Show, visitors: Open, path: Path, look: Look
) -> None:
    ann = visitors(look)
    ann.page.add_init_script(path=AXE)
    open_at(ann, show(path), 5.5)
    OUT.mkdir(parents=True, exist_ok=True)
    schemes: tuple[Theme, ...] = ("light", "dark")
    for scheme in schemes:
        assert violations(ann, scheme) == []
        ann.page.screenshot(
            path=OUT / f"session-{look.width}x{look.height}-{scheme}.png", caret="initial"
        )
    assert ann.page.evaluate(_OUTSIDE) == []
    assert ann.height(".replay") < 0.36 * ann.height(".stage")
