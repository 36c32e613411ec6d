import { expect, test } from "vitest";
import { decode, type Effects, encode, type Held, OUTPUT } from "../../src/gamepad/reports";
import { fromHex, toHex, vectors } from "../vectors";

const { reports, effects } = vectors("gamepad") as {
  readonly reports: readonly { readonly hex: string; readonly held: Held | null }[];
  readonly effects: readonly { readonly effects: Effects; readonly hex: string }[];
};

/** A report as the browser hands it out: its id apart. */
function split(hex: string): [number, DataView] {
  const bytes = fromHex(hex);
  return [bytes[0] ?? 0, new DataView(bytes.buffer, 1)];
}

test("a report holds what Python finds in it, and what is none is none", () => {
  expect(reports.length).toBeGreaterThan(5);
  for (const { hex, held } of reports) {
    const found = decode(...split(hex));
    if (held === null) {
      expect(found).toBeNull();
      continue;
    }
    expect([found?.pull, found?.buttons]).toEqual([held.pull, held.buttons]);
    for (const stick of ["left", "right"] as const) {
      held[stick].forEach((share, k) => { expect(found?.[stick][k]).toBeCloseTo(share, 12); });
    }
  }
});

test("a report to the pad is Python's to the last bit", () => {
  for (const { effects: given, hex } of effects) {
    expect(toHex(Uint8Array.from([OUTPUT, ...encode(given)]))).toBe(hex);
  }
});

test("a part of a longer buffer is read from its own beginning", () => {
  const [report] = reports;
  if (report === undefined) throw new Error("no vectors");
  const bytes = new Uint8Array(80);
  bytes.set(fromHex(report.hex), 7);
  expect(decode(1, new DataView(bytes.buffer, 8, 63))?.pull).toBe(report.held?.pull);
});
