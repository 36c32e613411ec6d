/** The layout of `src/`: which folder may import which, no circles, no crowded folders, no long files. */

import { existsSync, readdirSync, readFileSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";
import ts from "typescript";
import { describe, expect, test } from "vitest";

const WEB = resolve(import.meta.dirname, "..");
const SRC = join(WEB, "src");
const MOST_MODULES = 15;
const MOST_LINES = 300;

/** A folder imports from lines above its own only, and from a folder on its own line if one of the two lies in the other. */
const ORDER: readonly (readonly string[])[] = [
  ["model"],
  ["control"],
  ["protocol"],
  ["touch/loop", "touch/loop/rules"],
  ["touch/network"],
  ["gamepad", "share", "touch", "upload", "watch"],
  ["replay", "view/body", "view/graphics", "view/pointing"],
  ["view"],
  ["ui/plots"],
  ["ui"],
  ["ui/cards", "ui/gamepad", "ui/replay", "ui/share", "ui/upload"],
  ["tour"],
  ["company", "page/replay"],
  ["page"],
  ["panels"],
  ["session"],
];
/** Modules beside the folders: `address.ts` is a leaf, `main.ts` puts everything together. */
const LOOSE: Readonly<Record<string, number>> = { "address.ts": -1, "main.ts": ORDER.length };

/** Tests of several modules together, which mirror none. */
const NOT_MIRRORED: readonly string[] = ["bundle", "layout", "protocol/frames"];

function typescriptFiles(folder: string): string[] {
  return readdirSync(folder, { recursive: true, encoding: "utf8" })
    .filter((name) => name.endsWith(".ts"))
    .map((name) => name.replaceAll("\\", "/"))
    .sort();
}

const modules = typescriptFiles(SRC);

function importsOf(module: string): string[] {
  const { importedFiles } = ts.preProcessFile(readFileSync(join(SRC, module), "utf8"), true, true);
  return importedFiles
    .filter(({ fileName }) => fileName.startsWith("."))
    .map(({ fileName }) => fileName.replace(/\?inline$/, ""))
    .map((name) => (/\.(json|css)$/.test(name) ? name : `${name}.ts`))
    .map((name) => relative(SRC, resolve(SRC, dirname(module), name)).replaceAll("\\", "/"));
}

const imports = new Map(modules.map((module) => [module, importsOf(module)]));

function rankOf(module: string): number {
  const folder = dirname(module);
  return folder === "." ? (LOOSE[module] ?? NaN) : ORDER.findIndex((folders) => folders.includes(folder));
}

/** Whether a module lies in the folder of another one, or below it. */
function within(module: string, other: string): boolean {
  return `${dirname(module)}/`.startsWith(`${dirname(other)}/`);
}

/** The first circle of imports that is met on the way from a module; null without one. */
function circleFrom(module: string, way: readonly string[], done: Set<string>): string[] | null {
  if (way.includes(module)) return [...way.slice(way.indexOf(module)), module];
  if (done.has(module)) return null;
  for (const next of imports.get(module) ?? []) {
    const circle = circleFrom(next, [...way, module], done);
    if (circle !== null) return circle;
  }
  done.add(module);
  return null;
}

describe("imports", () => {
  test("lead to modules that exist", () => {
    const files = readdirSync(SRC, { recursive: true, encoding: "utf8" }).map((name) => name.replaceAll("\\", "/"));
    for (const [module, targets] of imports) {
      for (const target of targets) expect(files, module).toContain(target);
    }
  });

  test("make no circle", () => {
    const done = new Set<string>();
    for (const module of modules) expect(circleFrom(module, [], done)).toBeNull();
  });

  test("follow the order of the folders", () => {
    for (const module of modules) expect(rankOf(module), `${module} is in no known folder`).toBeGreaterThanOrEqual(-1);
    const upward = [...imports].flatMap(([module, targets]) =>
      targets.filter((target) => rankOf(target) > rankOf(module)).map((target) => `${module} imports ${target}`));
    expect(upward).toEqual([]);
  });

  test("do not join folders of one line", () => {
    const sideways = [...imports].flatMap(([module, targets]) =>
      targets
        .filter((target) => rankOf(target) === rankOf(module) && !within(target, module) && !within(module, target))
        .map((target) => `${module} imports ${target}`));
    expect(sideways).toEqual([]);
  });
});

describe("sizes", () => {
  test(`at most ${MOST_MODULES} modules in a folder`, () => {
    for (const folder of new Set(modules.map((module) => dirname(module)))) {
      expect(modules.filter((module) => dirname(module) === folder).length, folder).toBeLessThanOrEqual(MOST_MODULES);
    }
  });

  test(`at most ${MOST_LINES} lines in a file`, () => {
    const files = [...modules.map((name) => join(SRC, name)), ...typescriptFiles(join(WEB, "tests")).map((name) => join(WEB, "tests", name))];
    for (const file of files) {
      const text = readFileSync(file, "utf8");
      if (text.startsWith("// Made by ")) continue; // nobody reads it from end to end
      const lines = text.trimEnd().split("\n").length;
      expect(lines, relative(WEB, file)).toBeLessThanOrEqual(MOST_LINES);
    }
  });
});

test("a test lies where its module does", () => {
  const tests = typescriptFiles(join(WEB, "tests")).filter((name) => name.endsWith(".test.ts"));
  const names = tests.map((name) => name.slice(0, -".test.ts".length));
  for (const name of names.filter((name) => !NOT_MIRRORED.includes(name))) {
    expect(existsSync(join(SRC, `${name}.ts`)), `tests/${name}.test.ts`).toBe(true);
  }
  for (const name of NOT_MIRRORED) expect(names).toContain(name);
});

test("the README names every module by its path, but for the panels, which their list names", () => {
  const readme = readFileSync(join(WEB, "README.md"), "utf8");
  const named = [...readme.matchAll(/^\| `src\/([\w/]+\.ts)` \|/gm)].map(([, path]) => path ?? "");
  const registered = (imports.get("panels/list.ts") ?? []).filter((module) => module.startsWith("panels/"));
  expect([...named, ...registered].sort()).toEqual(modules);
});
