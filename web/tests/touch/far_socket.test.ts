/** A delay of the page's own is what the same delay of the server would be, and takes nothing from the hand's safety. */

import { describe, expect, test } from "vitest";
import { FarSocket } from "../../src/touch/far_socket";
import { Browser } from "./browser";
import { C_II } from "./server";

const FAR = 0.12; // s each way
const QUANTUM = 0.005; // s; the client looks at what is due every few milliseconds, as browsers have timers

const size = (browser: Browser): number => Math.hypot(...browser.state.force);

/** As a page whose pictures go on. */
function live(browser: Browser, seconds: number, ticking = true): void {
  for (let left = seconds; left > 0; left -= 0.5) {
    browser.client.obey({ type: "alive" });
    browser.run(Math.min(left, 0.5), ticking);
  }
}

function pressing(law: "predictive" | "proportional", delayed: (browser: Browser) => void): Browser {
  const browser = new Browser();
  browser.line.server.law = law;
  browser.join();
  delayed(browser);
  browser.run(1);
  browser.client.obey({ type: "point", target: [0.08, 0, 0], presses: true });
  return browser;
}

const own = (browser: Browser): void => { browser.client.obey({ type: "delay", delay: FAR }); };
const servers = (browser: Browser): void => { browser.far = FAR; };

describe.each(["predictive", "proportional"] as const)("the %s law behind a delay of the page's own", (law) => {
  test("feels what it feels behind the server's, while it presses and while others move", () => {
    const pair = [pressing(law, own), pressing(law, servers)] as const;
    let [on_the_way, most, largest] = [0, 0, 0];
    for (let i = 0; i < 200; i += 1) {
      for (const browser of pair) {
        browser.line.server.others = i < 100 ? [0, 0, 0] : [0.004 * Math.sin(0.1 * (i - 100)), 0, 0];
        live(browser, 0.04);
      }
      const apart = Math.abs(size(pair[0]) - size(pair[1]));
      if (i < 50) on_the_way = Math.max(on_the_way, apart);
      else most = Math.max(most, apart);
      largest = Math.max(largest, size(pair[0]));
    }
    expect(largest).toBeGreaterThan(2);
    // On its way in the tip makes 0.3 m/s: 40 N/s, of which the answers come a few milliseconds apart.
    expect(on_the_way).toBeLessThan(QUANTUM * 40);
    // A surface that goes at 10 mm/s is this much farther after a few milliseconds more.
    expect(most).toBeLessThan((2 * QUANTUM * 0.01) / C_II);
    expect(pair[0].state.round_trip).toBeGreaterThan(2 * FAR - 0.001);
    expect(Math.abs(pair[0].state.round_trip - pair[1].state.round_trip)).toBeLessThan(2 * QUANTUM);
    expect(Math.abs(pair[0].state.clock_offset - pair[1].state.clock_offset)).toBeLessThan(QUANTUM);
  });
});

describe("a hand behind a delay of its own", () => {
  test("fades when the server falls silent, and gives it up, as late as the newest word comes", () => {
    const browser = pressing("predictive", own);
    live(browser, 3);
    const force = size(browser);
    expect(force).toBeGreaterThan(2);
    live(browser, FAR + 0.05, false);
    expect(size(browser)).toBeCloseTo(force, 1);
    // The gap that came with the delay was as long as that: twice as long it waits for a patch.
    live(browser, 2 * FAR + 0.05 + force / 10, false);
    expect(browser.state.doing).toBe("server silent");
    expect(size(browser)).toBe(0);
    expect(browser.lines.length).toBe(1);
    live(browser, 5.4, false);
    expect(browser.lines.length).toBe(2);
  });

  test("gives way as soon as any when its page stands still", () => {
    const [far, near] = [pressing("predictive", own), pressing("predictive", () => undefined)];
    for (const browser of [far, near]) {
      live(browser, 3);
      browser.run(8);
      expect(size(browser)).toBeLessThan(0.15);
    }
  });

  test("ends as soon as any: what is on its way goes out before the last words", () => {
    const browser = pressing("predictive", own);
    live(browser, 3);
    browser.client.obey({ type: "name", name: "ann" });
    browser.client.obey({ type: "close" });
    browser.run(1.1);
    expect(browser.line.closed).toBe(1000);
    expect(browser.line.texts.map(({ type }) => type)).toEqual(["hello", "set_name", "bye"]);
    expect(browser.line.server.samples.at(-1)?.force).toEqual([0, 0, 0]);
    expect(browser.posts.at(-1)).toEqual({ type: "ended" });
  });

  test("hears why the server closes, though it was still on its way", () => {
    const browser = new Browser();
    browser.join();
    own(browser);
    browser.line.say({ type: "error", code: 4403, field: "", message: "you are put out" });
    browser.run(0.05);
    expect(browser.state.phase).toBe("joined");
    browser.line.break(4403);
    expect(browser.state).toMatchObject({ phase: "closed", reason: "the server refused: you are put out", code: 4403 });
  });

  test("keeps its delay when it comes back, and is near again without it", () => {
    const browser = new Browser();
    own(browser);
    browser.line.break();
    browser.run(0.6, false);
    browser.line.onopen?.();
    expect(browser.line.texts).toEqual([]);
    browser.run(FAR + 0.01, false);
    expect(browser.line.texts).toMatchObject([{ type: "hello" }]);
    browser.client.obey({ type: "delay", delay: 0 });
    browser.join();
    browser.run(0.5);
    expect(browser.state.round_trip).toBeLessThan(QUANTUM);
  });
});

test("nothing overtakes, also where what is heard sends", () => {
  const socket = { readyState: 1, bufferedAmount: 0, send: () => undefined, close: () => undefined } as unknown as WebSocket;
  const heard: string[] = [];
  let now = 0;
  const far: FarSocket = new FarSocket(socket, () => now, {
    opened: () => undefined,
    heard: (data) => {
      heard.push(String(data));
      now = 0.35; // while it is heard, the next is due
      far.send("answer");
    },
    lost: () => undefined,
  });
  far.delay = 0.1;
  for (const [at, data] of [[0, "a"], [0.01, "b"], [0.09, "c"]] as const) {
    now = at;
    socket.onmessage?.({ data } as MessageEvent<string>);
  }
  now = 0.15; // two are due
  far.pass();
  far.pass();
  expect(heard).toEqual(["a", "b", "c"]);
});
