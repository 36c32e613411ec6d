import { describe, expect, test } from "vitest";
import type { Recording } from "../../src/model/recording";
import { Player } from "../../src/replay/player";
import { MESH, N, record, sceneFrame, WATCHING } from "../watch/scenes";

/** Ten frames a second, in which a hand and all vertices go along x. */
function recording(surfaces: boolean, surface: Recording["surface"] = null, times = Array.from({ length: 20 }, (_, k) => 100 + k / 10)): Recording {
  return {
    mesh: MESH, info: WATCHING as unknown as Recording["info"], times: Float64Array.from(times), names: new Map([[1, "ana"]]), interval: 0.1, surface,
    frames: times.map((t, k) => sceneFrame(k + 1, t, [record(1, t - 100)], surfaces ? k * 10 : null)),
  };
}

describe("a recording", () => {
  test("shows what was received, at its times and straight between them, in any order", () => {
    const player = new Player(recording(true));
    for (const t of [101.9, 100, 100.05, 101.25, 100.7, 101.25, 3, 300]) {
      const then = Math.min(1.9, Math.max(0, t - 100));
      const shown = player.at(t);
      expect(shown.users[0]?.probe[0], `${t}`).toBeCloseTo(then, 5);
      expect(shown.users[0]?.name).toBe("ana");
      expect(shown.positions[0], `${t}`).toBeCloseTo(0.1 + 1e-3 * then, 6);
      expect(shown.complete).toBe(true);
    }
  });

  test("says that nothing has moved only where it has not", () => {
    const player = new Player(recording(true));
    expect(player.at(100.5).moved).toBe(true);
    expect(player.at(100.5).moved).toBe(false);
    expect(player.at(100.55).moved).toBe(true);
    expect(player.at(100.5).moved).toBe(true);
  });

  test("makes surfaces from forces, and says when they are still on their way", () => {
    let come = false;
    const player = new Player(recording(false, (loads) => (come ? new Float32Array(3 * N).fill(loads[0]?.force[0] ?? 0) : null)));
    expect(player.at(100.5)).toMatchObject({ complete: false, moved: true });
    expect(player.at(100.5).moved).toBe(true);
    come = true;
    const shown = player.at(100.5);
    expect(shown.complete).toBe(true);
    expect(shown.positions[0]).toBeCloseTo(1.1, 6);
  });

  test("keeps a surface through signs of life without one", () => {
    const times = [100, 100.5, 101, 101.5];
    const frames = [sceneFrame(1, 100, [record(1)], 100), ...[100.5, 101, 101.5].map((t, k) => sceneFrame(k + 2, t, [record(1)], null))];
    const shown = new Player({ ...recording(true, null, times), frames }).at(101.5);
    expect(shown.positions[0]).toBeCloseTo(0.101, 6);
    expect(shown.complete).toBe(true);
  });

  test("knows nothing of a silence", () => {
    const player = new Player(recording(true, null, [100, 100.1, 104, 104.1]));
    for (const [t, known] of [[99, false], [100, true], [101.05, true], [101.2, false], [103.95, false], [104, true], [104.1, true]] as const) {
      expect(player.known(t), `${t}`).toBe(known);
      if (t > 99) expect(player.at(t).known).toBe(known);
      if (!known) expect(player.hand(1, t)).toBeNull();
    }
    expect(player.hand(1, 100.05)?.probe[0]).toBeCloseTo(0.05, 6);
    expect(player.hand(2, 100.05)).toBeNull();
  });

  test("moves the surface straight between scenes that have it, past those that have not", () => {
    const times = Array.from({ length: 13 }, (_, k) => 100 + k / 60);
    const frames = times.map((t, k) => sceneFrame(k + 1, t, [record(1)], k % 4 === 0 ? 100 * k : null));
    const player = new Player({ ...recording(true, null, times), frames, interval: 1 / 60 });
    for (const k of [0, 1, 2, 3, 4, 7.5, 11, 12]) expect(player.at(100 + k / 60).positions[0], `${k}`).toBeCloseTo(0.1 + 1e-3 * k, 5);
  });

  test("goes on with the surfaces of the part before", () => {
    const before = new Player(recording(true));
    const { positions } = before.at(100.5);
    const part = recording(true);
    const after = new Player({ ...part, times: part.times.slice(3), frames: part.frames.slice(3) }, before);
    expect(after.at(101.25).positions).toBe(positions);
    expect(positions[0]).toBeCloseTo(0.1 + 1.25e-3, 6);
  });

  test("shows a damaged surface of a file as none", () => {
    const damaged = sceneFrame(2, 100.1, [record(1)], 50);
    damaged.set([0, 0, 0, 0], damaged.length - 4);
    const frames = [sceneFrame(1, 100, [record(1)], 50), damaged];
    const shown = new Player({ ...recording(true, null, [100, 100.1]), frames }).at(100.1);
    expect(shown.positions[0]).toBeCloseTo(0.1005, 6);
  });
});
