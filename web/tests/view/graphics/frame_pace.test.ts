import { describe, expect, it } from "vitest";
import { FramePace, isSoftware } from "../../../src/view/graphics/frame_pace";

const FRAME = 1 / 60; // s

/** Frames that take `slow` when something is drawn, and one of the display otherwise; whether each was drawn. */
function run(pace: FramePace, frames: number, slow: number): boolean[] {
  const drawn: boolean[] = [];
  for (let i = 0; i < frames; i++) drawn.push(pace.next(drawn.at(-1) === true ? slow : FRAME, true));
  return drawn;
}

describe("a machine with graphics", () => {
  it("draws each frame with all pixels while it keeps up", () => {
    const pace = new FramePace(false, 2);
    expect(run(pace, 200, FRAME)).not.toContain(false);
    expect(pace.ratio).toBe(2);
  });

  it("draws fewer pixels once it does not, down to a bound", () => {
    const pace = new FramePace(false, 2);
    run(pace, 300, 0.2);
    expect(pace.ratio).toBe(0.6);
  });

  it("keeps its pixels where only the first pictures are slow, as those that compile are", () => {
    const pace = new FramePace(false, 2);
    run(pace, 4, 0.5);
    run(pace, 100, FRAME);
    expect(pace.ratio).toBe(2);
  });
});

describe("a page that pauses", () => {
  it("draws with all pixels afterwards, however often, and though nobody said so", () => {
    for (const said of [true, false]) {
      const pace = new FramePace(false, 2);
      run(pace, 60, FRAME);
      for (let change = 0; change < 50; change++) {
        if (said) pace.pause();
        pace.next(60, true);
        run(pace, 30, FRAME);
      }
      expect(pace.ratio).toBe(2);
    }
  });

  it("counts no picture that a pause was in, where each has one", () => {
    const pace = new FramePace(false, 2);
    run(pace, 60, FRAME);
    for (let change = 0; change < 50; change++) {
      pace.next(60, true);
      pace.pause();
    }
    expect(pace.ratio).toBe(2);
  });

  it("begins no other picture for it while one is being drawn", () => {
    const pace = new FramePace(true, 2);
    expect(pace.next(FRAME, true)).toBe(true);
    pace.pause();
    for (let i = 0; i < 50; i++) expect(pace.next(FRAME, true, true)).toBe(false);
  });
});

describe("a machine that was slow for a while", () => {
  it("draws with all pixels again once it keeps up, at 30 pictures a second too", () => {
    for (const frame of [FRAME, 2 * FRAME]) {
      const pace = new FramePace(false, 2);
      run(pace, 300, 0.2);
      expect(pace.ratio).toBe(0.6);
      for (let i = 0; i < 2000; i++) pace.next(frame, true);
      expect(pace.ratio).toBe(2);
    }
  });

  it("tries what is too much for it ever more rarely", () => {
    const pace = new FramePace(false, 2);
    const changes: number[] = [];
    for (let i = 0, ratio = 2; i < 40_000; i++) {
      pace.next(pace.ratio > 1.2 ? 0.1 : FRAME, true);
      if (pace.ratio > ratio) changes.push(i);
      ratio = pace.ratio;
    }
    expect(changes.length).toBeGreaterThan(2);
    expect(changes.length).toBeLessThan(12);
    expect(pace.ratio).toBeLessThanOrEqual(1.2);
  });
});

describe("a window on another display", () => {
  it("is drawn with its pixels, and back again", () => {
    const pace = new FramePace(false, 1);
    pace.fit(2);
    expect(pace.ratio).toBe(2);
    run(pace, 100, FRAME);
    pace.fit(2);
    pace.fit(1);
    expect(pace.ratio).toBe(1);
  });

  it("keeps to what its machine can draw, and within the bounds", () => {
    const pace = new FramePace(false, 2);
    run(pace, 300, 0.2);
    pace.fit(1);
    expect(pace.ratio).toBe(0.6);
    pace.fit(0.5);
    expect(pace.ratio).toBe(0.5);
    run(pace, 300, 0.2);
    expect(pace.ratio).toBe(0.5);
    pace.fit(2);
    expect(pace.ratio).toBeLessThanOrEqual(2);
    const software = new FramePace(true, 1);
    software.fit(2);
    expect(software.ratio).toBe(0.75);
  });
});

describe("a machine that draws in software", () => {
  it("rests as long as a picture took", () => {
    const drawn = run(new FramePace(true, 2), 1000, 0.1);
    const pictures = drawn.filter(Boolean).length;
    const busy = 0.1 * pictures;
    const free = FRAME * (drawn.length - pictures);
    expect(free / busy).toBeGreaterThan(0.9);
    expect(free / busy).toBeLessThan(1.3);
  });

  it("begins no picture while the one before is drawn, and counts all of that as its time", () => {
    const pace = new FramePace(true, 2);
    expect(pace.next(FRAME, true)).toBe(true);
    for (let i = 0; i < 5; i++) expect(pace.next(FRAME, true, true)).toBe(false);
    let rests = 0;
    while (!pace.next(FRAME, true)) rests += 1;
    expect(rests).toBeGreaterThanOrEqual(5);
    expect(rests).toBeLessThanOrEqual(7);
  });

  it("draws fewer pixels where pictures take long that nobody waits for", () => {
    const pace = new FramePace(true, 2);
    for (let i = 0; i < 600; i++) pace.next(FRAME, true, i % 16 !== 0);
    expect(pace.ratio).toBe(0.6);
  });

  it("never rests so long that the picture stands still", () => {
    const drawn = run(new FramePace(true, 2), 200, 5);
    const longest = Math.ceil(0.2 / FRAME) + 1;
    for (let i = 0; i + longest < drawn.length; i++) expect(drawn.slice(i, i + longest + 1)).toContain(true);
  });

  it("begins with fewer pixels than the display has", () => {
    expect(new FramePace(true, 2).ratio).toBeLessThan(1);
  });
});

it("draws nothing where nothing changed, and at once what changes then", () => {
  for (const software of [false, true]) {
    const pace = new FramePace(software, 1);
    for (let i = 0; i < 50; i++) expect(pace.next(FRAME, false)).toBe(false);
    expect(pace.next(FRAME, true)).toBe(true);
  }
});

it.each([
  ["ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero) (0x0000C0DE)), SwiftShader driver)", true],
  ["llvmpipe (LLVM 15.0.7, 256 bits)", true],
  ["ANGLE (Microsoft, Microsoft Basic Render Driver (0x0000008C) Direct3D11 vs_5_0 ps_5_0, D3D11)", true],
  ["Apple Software Renderer", true],
  ["ANGLE (Intel, Mesa Intel(R) UHD Graphics 620 (KBL GT2), OpenGL 4.6)", false],
  ["ANGLE (NVIDIA, NVIDIA GeForce RTX 3060 Direct3D11 vs_5_0 ps_5_0, D3D11)", false],
  ["Apple GPU", false],
  ["Adreno (TM) 650", false],
  ["WebKit WebGL", false],
])("%s draws with the processor: %s", (renderer, software) => {
  expect(isSoftware(renderer)).toBe(software);
});
