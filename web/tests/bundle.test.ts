/** What comes over the network before the first touch: a budget, counted in the bundle as it is served. */

import { resolve } from "node:path";
import { gzipSync } from "node:zlib";
import { build, type Rolldown } from "vite";
import { beforeAll, expect, test } from "vitest";

const kB = 1000;

let output: Rolldown.RolldownOutput["output"];

beforeAll(async () => {
  const root = resolve(import.meta.dirname, "..");
  const built = await build({ root, logLevel: "silent", build: { write: false } });
  if (!("output" in built)) throw new Error("vite watches instead of building");
  output = built.output;
});

function chunkOf(name: string): Rolldown.OutputChunk {
  const found = output.find((file) => file.type === "chunk" && file.name === name);
  if (found?.type !== "chunk") throw new Error(`there is no chunk ${name}`);
  return found;
}

/** A chunk with all that it imports at once. */
function withImports(name: string): Set<Rolldown.OutputChunk> {
  const chunks = new Set<Rolldown.OutputChunk>([chunkOf(name)]);
  for (const chunk of chunks) {
    for (const file of chunk.imports) {
      const next = output.find(({ fileName }) => fileName === file);
      if (next?.type === "chunk") chunks.add(next);
    }
  }
  return chunks;
}

function zipped(...contents: readonly (string | Uint8Array)[]): number {
  return contents.reduce((sum, content) => sum + gzipSync(content).length, 0);
}

function assets(ending: string): (string | Uint8Array)[] {
  return output.flatMap((file) => (file.type === "asset" && file.fileName.endsWith(ending) ? [file.source] : []));
}

const codeOf = (chunks: Iterable<Rolldown.OutputChunk>): string[] => [...chunks].map(({ code }) => code);

test("words, buttons and socket come without the graphics, in 53 kB", () => {
  const first = withImports("index");
  expect([...first].flatMap(({ moduleIds }) => moduleIds).filter((id) => id.includes("/three/"))).toEqual([]);
  const styles = assets(".css");
  expect(styles.length).toBe(1);
  expect(zipped(...codeOf(first), ...styles, ...assets(".html"))).toBeLessThan(53 * kB);
});

test("all before the first touch comes in 218 kB, without what only an upload, an engineer, a dent or a recorded session needs", () => {
  const needed = new Set([...withImports("index"), ...withImports("scene_view")]);
  const later = ["/view/preview.ts", "/campaign_rooms.json", "/pointing/lean.ts", "/plots/strip_chart.ts", "/session/start.ts"];
  expect([...needed].flatMap(({ moduleIds }) => moduleIds).filter((id) => later.some((name) => id.endsWith(name)))).toEqual([]);
  const workers = output.filter(({ fileName }) => fileName.includes("worker-"));
  expect(workers.length).toBe(1);
  const worker = workers.map((file) => (file.type === "asset" ? file.source : file.code));
  expect(zipped(...codeOf(needed), ...worker, ...assets(".css"), ...assets(".html"))).toBeLessThan(218 * kB);
});

test("the campaign's rooms come for who opens Engineer, in 56 kB", () => {
  expect(zipped(...codeOf([chunkOf("neighbours_part")]))).toBeLessThan(56 * kB);
});
