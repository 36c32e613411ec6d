import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { DEFAULT_HAND } from "../../src/touch/loop/simulated_hand";

/** A Worker that only counts: the loop inside has tests of its own. */
class Idle {
  static made: Idle[] = [];
  readonly heard: unknown[] = [];
  onerror: ((event: { message: string }) => void) | null = null;
  onmessage: unknown = null;

  constructor() {
    Idle.made.push(this);
  }
  postMessage(message: unknown): void {
    this.heard.push(message);
  }
  terminate(): void {
    // There is no thread.
  }
}

const SETTINGS = {
  url: "ws://host", name: "ann", law: "predictive", geometry: "sphere", max_force: 10, friction: 0, passivity: true,
  hand: DEFAULT_HAND, target: [0, 0, 0],
} as const;

async function fresh(): Promise<typeof import("../../src/touch/handle")> {
  vi.resetModules();
  return import("../../src/touch/handle");
}

beforeEach(() => {
  Idle.made = [];
  vi.stubGlobal("Worker", Idle);
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("the first hand takes the Worker that was made ready, and later ones none that waits", async () => {
  const { prepareTouch, startTouch } = await fresh();
  prepareTouch();
  prepareTouch();
  expect(Idle.made.length).toBe(1);
  startTouch(SETTINGS);
  await Promise.resolve();
  expect(Idle.made.length).toBe(1);
  expect(Idle.made[0]?.heard).toMatchObject([{ type: "start" }]);
  prepareTouch();
  startTouch(SETTINGS);
  expect(Idle.made.length).toBe(2);
});

test("a Worker that failed before the touch is not taken; the hand's own says why", async () => {
  const { prepareTouch, startTouch } = await fresh();
  prepareTouch();
  Idle.made[0]?.onerror?.({ message: "gone" });
  const handle = startTouch(SETTINGS);
  expect(Idle.made.length).toBe(2);
  Idle.made[1]?.onerror?.({ message: "still gone" });
  expect(handle.failure).toContain("still gone");
});

test("a hand that comes before anything was made ready has its own Worker, and none is made beside it", async () => {
  const { prepareTouch, startTouch } = await fresh();
  startTouch(SETTINGS);
  prepareTouch();
  expect(Idle.made.length).toBe(1);
});

test("a hand has its page's secret, and that of another page another", async () => {
  for (let page = 0; page < 2; page++) {
    const { startTouch } = await fresh();
    startTouch(SETTINGS);
    await Promise.resolve();
  }
  const keys = Idle.made.map(({ heard }) => (heard as { settings: { key: string } }[])[0]?.settings.key);
  expect(keys[0]).toMatch(/^[0-9a-f]{32}$/);
  expect(keys[1]).toMatch(/^[0-9a-f]{32}$/);
  expect(keys[1]).not.toBe(keys[0]);
});

test("how long a report waits for the page, and by which clock it was made, is known of the hand", async () => {
  const { startTouch } = await fresh();
  const handle = startTouch(SETTINGS);
  expect(handle.link).toEqual({ network: null, page_wait: 0, clock_step: 0, tick_late: 0, loop_stall: 0, wavers: 0 });
  const hear = Idle.made[0]?.onmessage as (event: object) => void;
  hear({ data: { type: "state", state: { t: performance.now() / 1000 - 0.2, network: 0.01 }, clock_step: 0.1 } });
  expect(handle.link).toMatchObject({ network: 0.01, clock_step: 0.1 });
  expect(handle.link.page_wait).toBeGreaterThanOrEqual(0.2);
});

test("a page that draws says so once a second, and one that does not says nothing", async () => {
  vi.useFakeTimers();
  const { startTouch } = await fresh();
  const handle = startTouch(SETTINGS);
  const said = (): number => (Idle.made[0]?.heard as { type: string }[]).filter(({ type }) => type === "alive").length;
  for (let picture = 0; picture < 210; picture++) {
    handle.alive();
    await vi.advanceTimersByTimeAsync(1000 / 60);
  }
  expect(said()).toBe(4);
  await vi.advanceTimersByTimeAsync(10_000);
  expect(said()).toBe(4);
});
