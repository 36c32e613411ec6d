"""A visitor brings an object: dropped, looked at, painted, prepared; the room then has it."""

from __future__ import annotations

import base64
from pathlib import Path

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.visitor import DESKTOP, PHONE, Look, Visitor
from tests.server.upload.test_worker import block_vtu

OUT = Path(__file__).parents[2] / "out" / "browser"
TABLET = Look(820, 1180)
OPENER = '[aria-label="An object of your own"]'
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
    ann.page.locator(".upload-names .button", has_text="liver").click()
    assert ann.text(".upload-soft").startswith("Like liver")
    ann.page.locator(".upload .choice-option", has_text="Paint").click()
    go = ann.page.locator(".upload-foot .primary")
    assert go.is_disabled()
    box = ann.page.locator(".upload-host").bounding_box()
    assert box is not None
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    ann.page.mouse.move(x - 20, y)
    ann.page.mouse.down()
    ann.page.mouse.move(x + 20, y + 10, steps=4)
    ann.page.mouse.up()
    ann.until(go.is_enabled, "something to be painted")
    OUT.mkdir(parents=True, exist_ok=True)
    ann.page.screenshot(path=OUT / f"upload-{look.width}.png", caret="initial")
    for part in (".upload", ".upload-host", ".upload-foot"):
        found = ann.page.locator(part).bounding_box()
        assert found is not None, part
        assert found["x"] >= 0.0, part
        assert found["x"] + found["width"] <= look.width, part
    go.click()
    ann.until(lambda: "everybody" in ann.text(".upload-words"), "the object to be served")
    ann.page.locator(".upload .dialog-close").click()
    ann.until(ann.watches, "the page to come back")
    if not look.phone:
        ann.until(lambda: ann.text(".room").startswith("my-block-"), "the new object's name")
    ann.take_part("ann")


def test_a_file_that_is_none_is_one_sentence_and_nobody_else_notices(
    visitors: Open, serve: Serve
) -> None:
    room = serve("--allow-upload")
    with room.hand("steady", "--angle", "180"):
        ann = visitors()
        ann.visit(room.address)
        drop(ann, "evil.glb", b"glTF" + b"\xff" * 200)
        ann.until(lambda: "Evil.glb: " in ann.text(".upload-words"), "the sentence")
        assert "Traceback" not in ann.text(".upload-words")
        ann.page.locator(".upload .dialog-close").click()
        assert len(room.users()) == 1
        assert ann.watches()


def test_where_no_file_may_come_there_is_no_way_in(visitors: Open, serve: Serve) -> None:
    ann = visitors()
    ann.visit(serve().address)
    assert not ann.page.locator(OPENER).first.is_visible()
    drop(ann, "my block.vtu", block_vtu())
    assert not ann.page.locator(".upload").is_visible()
