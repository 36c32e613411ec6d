import { describe, expect, it } from "vitest";
import { attachPointer } from "../../../src/view/pointing/pointer";

/** A canvas on which every press meets the object, and what its pointers ask for. */
function pressed(by: object = {}): { canvas: EventTarget; asked: string[]; detach: () => void; say: (type: string, of?: object) => void } {
  const canvas = Object.assign(new EventTarget(), { setPointerCapture: () => undefined, focus: () => undefined });
  const asked: string[] = [];
  const note = (words: string) => (): void => { asked.push(words); };
  const detach = attachPointer(canvas as unknown as HTMLElement, {
    press: () => asked.push("press") > 0, point: () => false, pointing: () => false,
    slide: note("slide"), hover: note("hover"), release: note("release"), deeper: note("deeper"), depth: note("depth"),
    rotate: note("rotate"), zoom: note("zoom"), took: () => undefined,
  });
  const say = (type: string, of: object = {}): void => {
    canvas.dispatchEvent(Object.assign(new Event(type), { pointerId: 1, pointerType: "mouse", button: 0, buttons: 1, clientX: 9, clientY: 9, ...of }));
  };
  say("pointerdown", by);
  return { canvas, asked, detach, say };
}

describe("a press ends", () => {
  it("where the pointer goes up, and once", () => {
    const { asked, say } = pressed();
    say("pointerup", { buttons: 0 });
    say("lostpointercapture", { buttons: 0 });
    expect(asked).toEqual(["press", "release"]);
  });

  it("where the browser takes the pointer away, without another word of it", () => {
    const { asked, say } = pressed();
    say("lostpointercapture");
    expect(asked).toEqual(["press", "release"]);
    say("pointermove", { buttons: 0 });
    expect(asked.at(-1)).toBe("hover");
  });

  it("where the first of two buttons goes up, of which only a move tells", () => {
    const { asked, say } = pressed();
    say("pointermove", { button: 2, buttons: 3 });
    say("pointermove", { button: 0, buttons: 2 });
    expect(asked).toEqual(["press", "slide", "release", "rotate"]);
    say("pointerup", { button: 2, buttons: 0 });
    expect(asked.filter((one) => one === "release")).toHaveLength(1);
  });

  it("where the tip of a pen is lifted while its barrel button is held, of which only a move tells", () => {
    const { asked, say } = pressed({ pointerType: "pen", pressure: 0.5 });
    say("pointermove", { pointerType: "pen", button: 2, buttons: 3, pressure: 0.6 });
    say("pointermove", { pointerType: "pen", button: 0, buttons: 2, pressure: 0 });
    expect(asked).toEqual(["press", "depth", "depth", "slide", "release", "rotate"]);
  });

  it("where the listeners go, as they do with the graphics", () => {
    const { asked, detach, say } = pressed();
    detach();
    expect(asked).toEqual(["press", "release"]);
    say("pointerup");
    expect(asked).toHaveLength(2);
  });

  it("by the finger that pressed, and not by one beside it", () => {
    const { asked, say } = pressed();
    say("pointerdown", { pointerId: 2, pointerType: "touch" });
    say("pointermove", { pointerId: 2, pointerType: "touch", clientY: 40 });
    say("pointerup", { pointerId: 2, pointerType: "touch" });
    expect(asked).toEqual(["press", "deeper"]);
    say("pointercancel");
    expect(asked.at(-1)).toBe("release");
  });
});
