"""A visitor brings an object: dropped, looked at, painted, prepared; the room then has it."""

from __future__ import annotations

import base64
from pathlib import Path

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.visitor import DESKTOP, PHONE, Look, Visitor
from tests.uploads.test_worker import block_vtu

pytestmark = pytest.mark.live

OUT = Path(__file__).parents[2] / "out" / "browser"
TABLET = Look(820, 1180)
BESIDE = 0.71  # of the picture's width, where the middle of a block of 10 cm is beside a hand
_DROP = """([name, content]) => {
  const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
  const transfer = new DataTransfer();
  transfer.items.add(new File([bytes], name));
  for (const kind of ["dragover", "drop"])
    dispatchEvent(new DragEvent(kind, { dataTransfer: transfer, bubbles: true, cancelable: true }));
}"""


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is left in the user's store."""
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))


def drop(visitor: Visitor, name: str, content: bytes) -> None:
    visitor.page.evaluate(_DROP, [name, base64.b64encode(content).decode()])


def shown(visitor: Visitor) -> bool:
    return visitor.page.locator(".upload-work:not([inert])").is_visible()


@pytest.mark.parametrize("look", [DESKTOP, TABLET, PHONE], ids=["desktop", "tablet", "phone"])
def test_a_dropped_file_is_painted_prepared_and_touched(
    visitors: Open, serve: Serve, look: Look
) -> None:
    room = serve("--allow-upload")
    ann = visitors(look)
    ann.visit(room.address)
    drop(ann, "my block.vtu", block_vtu(6))
    ann.until(lambda: shown(ann), "the object to be shown")
    assert "432 triangles" in ann.text(".upload-findings")
    assert "10 \u00d7 10 \u00d7 10 cm" in ann.text("#upload-size-words")
    assert ann.text(".upload-beside") == "Beside it: a hand, 18 cm"
    length = ann.page.locator(".upload-length")
    length.fill("0.4")
    assert "too small to be touched" in ann.text("#upload-size-words")
    assert ann.page.locator(".upload-foot .primary").first.is_disabled()
    length.fill("12")
    assert "12 \u00d7 12 \u00d7 12 cm, shorter than a hand" in ann.text("#upload-size-words")
    ann.page.locator(".upload-names .button", has_text="liver").click()
    assert ann.text(".upload-soft").startswith("Like liver")
    ann.page.locator(".upload .choice-option", has_text="Paint").click()
    go = ann.page.locator(".upload-foot .primary").first
    assert go.is_disabled()
    ann.page.locator(".upload-host").scroll_into_view_if_needed()
    box = ann.page.locator(".upload-host").bounding_box()
    assert box is not None
    # What it is compared with stands on the left, so the object is on the right of the middle.
    x, y = box["x"] + BESIDE * box["width"], box["y"] + 0.5 * box["height"]

    def painted() -> bool:
        ann.catch_up()  # a slow page has not drawn it there yet
        ann.page.mouse.move(x - 20, y)
        ann.page.mouse.down()
        ann.page.mouse.move(x + 20, y + 10, steps=4)
        ann.page.mouse.up()
        return go.is_enabled()

    ann.until(painted, "something to be painted")
    OUT.mkdir(parents=True, exist_ok=True)
    ann.page.screenshot(path=OUT / f"upload-{look.width}.png", caret="initial")
    ann.prefer("dark")
    ann.page.screenshot(path=OUT / f"upload-{look.width}-dark.png", caret="initial")
    ann.prefer("light")
    for part in (".upload", ".upload-host", ".upload-foot"):
        found = ann.page.locator(part).bounding_box()
        assert found is not None, part
        assert found["x"] >= 0.0, part
        assert found["x"] + found["width"] <= look.width, part
    go.click()
    ann.until(lambda: "everybody" in ann.text(".upload-words"), "the object to be served")
    assert "--scale 1.2" in ann.text(".upload-words")
    assert "--body 'my block.vtu' " in ann.text(".upload-words"), "the visitor's own name of it"
    ann.page.locator(".upload-foot .primary", has_text="Touch it").click()
    ann.until(ann.watches, "the page to come back")
    if look is DESKTOP:  # a narrower stage has no room for it
        ann.until(lambda: ann.text(".room").startswith("my-block-"), "the new object's name")
    ann.until(lambda: ann.doing() == "in the air", "the hand, without another press")


def test_who_touches_comes_back_touching_when_somebody_brings_another_object(
    visitors: Open, serve: Serve
) -> None:
    """Pages and native hands, without a word from anybody."""
    room = serve("--allow-upload")
    with room.hand("steady", "--angle", "180"):
        ann, ben = visitors(), visitors()
        for visitor in (ann, ben):
            visitor.visit(room.address)
        ann.take_part("ann")
        ann.press()
        ann.until(lambda: ann.force > 0.1, "a force from the balloon")
        drop(ben, "my block.vtu", block_vtu(4))
        ben.until(lambda: shown(ben), "the object to be shown")
        ben.page.locator(".upload-foot .primary").first.click()
        ben.until(lambda: "everybody" in ben.text(".upload-words"), "the object to be served")
        ann.until(ann.watches, "the page to come back")
        ann.until(lambda: ann.text(".dock-facts") == "in the air", "the hand to be engaged again")
        ann.release()
        ann.until(lambda: ann.notice == "", "no notice")
        ann.press()
        ann.until(lambda: ann.force > 0.1, "a force from the block")
        room.until(lambda users: len(users) == 2, "the native hand")
        for visitor in (ann, ben):
            visitor.away = True  # the server ends before the pages


def test_all_of_it_goes_by_keys_and_is_said_to_those_who_do_not_see(
    visitors: Open, serve: Serve
) -> None:
    ann = visitors(DESKTOP)
    ann.visit(serve("--allow-upload").address)
    drop(ann, "my block.vtu", block_vtu(2))
    ann.until(lambda: shown(ann), "the object to be shown")
    focused = "document.activeElement"
    names: list[str] = []
    for _ in range(40):
        ann.page.keyboard.press("Tab")
        said = ann.page.evaluate(
            f"{focused}.getAttribute('aria-label') ?? {focused}.closest('label')?.innerText"
            f" ?? {focused}.innerText"
        )
        assert said, ann.page.evaluate(f"{focused}.outerHTML")
        if said in names and said != "Bottom":
            break
        names.append(said)
    for name in ("How much is held", "How soft", "Prepare it", "Cancel", "Another file"):
        assert name in names
    assert any(name.startswith("Longest side") for name in names)
    ann.page.locator("input[aria-label='How soft']").focus()
    before = ann.text(".upload-soft")
    ann.page.keyboard.press("ArrowRight")
    assert ann.text(".upload-soft") != before
    ann.page.keyboard.press("Escape")
    ann.until(lambda: not ann.page.locator(".upload").is_visible(), "the dialog to be closed")
