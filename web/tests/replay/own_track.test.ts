import { describe, expect, test } from "vitest";
import { OwnTrack } from "../../src/replay/own_track";

describe("the own tip in the last minute", () => {
  test("is between two reports where it was, and nowhere else", () => {
    const track = new OwnTrack(8);
    for (let n = 0; n < 20; n += 1) track.push(0.1 * n, [n, 2 * n, 0]);
    expect(track.at(1.55)?.[0]).toBeCloseTo(15.5, 9);
    expect(track.at(1.55)?.[1]).toBeCloseTo(31, 9);
    for (const t of [-1, 0.5, 1.19, 1.91, NaN]) expect(track.at(t), `${t}`).toBeNull();
  });

  test("is not known in a pause of the page, and a clock that begins anew is another one", () => {
    const track = new OwnTrack();
    track.push(5, [0, 0, 0]);
    track.push(5.5, [1, 0, 0]);
    expect(track.at(5.2)).toBeNull();
    track.push(5.5, [2, 0, 0]);
    track.push(1, [3, 0, 0]);
    track.push(1.1, [4, 0, 0]);
    expect(track.at(5.2)).toBeNull();
    expect(track.at(1.05)?.[0]).toBeCloseTo(3.5, 9);
  });

  test("stays as it was copied", () => {
    const track = new OwnTrack(4);
    for (const t of [1, 1.1, 1.2]) track.push(t, [t, 0, 0]);
    const copy = track.copy();
    for (let t = 1.3; t < 3; t += 0.1) track.push(t, [9, 9, 9]);
    expect(copy.at(1.15)?.[0]).toBeCloseTo(1.15, 9);
    expect(track.at(1.15)).toBeNull();
  });
});
