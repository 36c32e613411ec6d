import { describe, expect, test } from "vitest";
import { Player } from "../../src/replay/player";
import type { Overview } from "../../src/session/overview";
import { intervalOf, SessionStore, type Source } from "../../src/session/store";
import { decodeServerControl, type Watching } from "../../src/protocol/messages";
import { MESH, record, sceneFrame, WATCHING } from "../watch/scenes";

const settled = async (): Promise<void> => { for (let i = 0; i < 200; i += 1) await Promise.resolve(); };

function store(surfaces: boolean, unshown: string): SessionStore {
  const watching = { ...(decodeServerControl(JSON.stringify(WATCHING)) as Watching), model: null };
  const overview: Overview = { name: "x.mcap", first: 100, last: 110, watching, unshown, names: new Map([[1, "ana"]]), moments: [], further: 0, complete: true };
  const source: Source = {
    scenes: (from, to) => {
      const frames = Array.from({ length: 10 * (to - from) }, (_, k) => sceneFrame(k + 1, from + k / 10, [record(1, from + k / 10 - 100)], surfaces && k % 2 === 0 ? k : null));
      const bytes = frames.flatMap((frame) => [...new Uint8Array(Uint32Array.of(frame.length).buffer), ...frame]);
      return Promise.resolve(Uint8Array.from([...new Uint8Array(Float64Array.of(to).buffer), ...bytes]).buffer);
    },
    green: () => () => Promise.reject(new Error("no functions here")),
    now: () => 0,
  };
  return new SessionStore(overview, MESH, source, 105);
}

describe("a recorded session", () => {
  test("is a recording round each time, which a player shows with the names of its people", async () => {
    const session = store(false, "");
    expect(session.recorded().times.length).toBe(0);
    await settled();
    const part = session.round(105, 1);
    expect(session.round(105.5, 1)).toBe(part);
    const shown = new Player(part).at(105.5);
    expect(shown.users[0]?.name).toBe("ana");
    expect(shown.users[0]?.probe[0]).toBeCloseTo(5.5, 5);
    expect(shown.known).toBe(true);
  });

  test("says that its surface is not shown where no scene brings it, and only there", async () => {
    for (const [surfaces, words] of [[false, "at rest"], [true, ""]] as const) {
      const session = store(surfaces, "at rest");
      expect(session.unshown(105)).toBe("");
      session.round(105, 1);
      await settled();
      session.round(105, 1);
      expect(session.unshown(105)).toBe(words);
    }
  });
});

test("the interval is that of most scenes, and a pause or a scene more changes nothing", () => {
  expect(intervalOf(Float64Array.from([0, 0.1, 0.2, 0.3, 5, 5.1]), 1 / 60)).toBeCloseTo(0.1, 9);
  expect(intervalOf(Float64Array.of(), 1 / 60)).toBe(1 / 60);
  expect(intervalOf(Float64Array.of(3), 1 / 60)).toBe(1 / 60);
});
