import { readdirSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { expect, it } from "vitest";
import { PANELS } from "../../src/panels/list";

const SRC = resolve(import.meta.dirname, "../../src");
const names = PANELS.map(({ id }) => id);

it("no two panels have one name", () => {
  expect(new Set(names).size).toBe(names.length);
});

it("a button or a key that opens a panel finds it in the list", () => {
  const sources = readdirSync(SRC, { recursive: true, encoding: "utf8" }).filter((name) => name.endsWith(".ts"));
  const asked = sources.flatMap((name) => [...readFileSync(join(SRC, name), "utf8").matchAll(/page\.toggle\("(\w+)"\)/g)]).map(([, id]) => id);
  expect(asked.length).toBeGreaterThan(0);
  for (const id of asked) expect(names).toContain(id);
});
