import { expect, test } from "vitest";
import { qrPath } from "../../../src/ui/share/qr";

test("a QR code of an address is square, has its three finders, and white all round", () => {
  const { path, size } = qrPath("http://192.168.1.7:8765/r/jelly/");
  const dark = new Set([...path.matchAll(/M(\d+) (\d+)h1v1h-1z/g)].map(([, x, y]) => `${x} ${y}`));
  const at = (x: number, y: number): boolean => dark.has(`${x} ${y}`);
  expect((size - 8 - 17) % 4).toBe(0); // 17 + 4 v modules, and 4 of white at each side
  const end = size - 1;
  for (let i = 0; i < size; i += 1) {
    for (let edge = 0; edge < 4; edge += 1) expect([at(i, edge), at(edge, i), at(i, end - edge), at(end - edge, i)]).toEqual([false, false, false, false]);
  }
  for (const [x, y] of [[4, 4], [end - 10, 4], [4, end - 10]] as const) {
    for (let i = 0; i < 7; i += 1) expect([at(x + i, y), at(x, y + i), at(x + 6, y + i), at(x + i, y + 6)]).toEqual([true, true, true, true]);
    expect(at(x + 1, y + 1)).toBe(false);
    expect(at(x + 3, y + 3)).toBe(true);
  }
});
