import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { TouchHandle } from "../../src/model/hand";
import type { SceneStore } from "../../src/model/scene";
import { Page } from "../../src/page/page";
import type { Mounted, Panel } from "../../src/page/panels";
import { PANELS } from "../../src/panels/list";
import { el } from "../../src/ui/dom";
import { browser, type StandIn } from "./elements";

// A page without graphics; what they draw is seen in a browser.
vi.mock("../../src/view/scene_view", () => ({ openScene: () => null }));

const status = { phase: "watching", reason: "", code: 0, retry_at: 0, silent: 0, bytes_per_second: 0, frames_per_second: 0, blocks_missing: 0, playout_delay: 0 };
const store = {
  status, mesh: null, events: [], roster: [], putOut: [], onRecord: false, restraints: { frozen: false, muted: [] }, company: { state: null, marks: [] },
  info: { body: { name: "balloon", center: [0, 0, 0], radius: 0.1 }, model: null, can_touch: true },
  at: () => null, subscribe: () => () => undefined, setView: () => undefined,
};

let errors: unknown[][];
let tree: ReturnType<typeof browser>;
let alive: number;

beforeEach(() => {
  [errors, alive] = [[], 0];
  tree = browser();
  vi.spyOn(console, "error").mockImplementation((...words: unknown[]) => { errors.push(words); });
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

function open(panels: readonly Panel[]): Page {
  return new Page({
    address: "http://localhost/", misplaced: false, key: "key", invited: () => false, invitation: () => undefined,
    openStore: () => store as unknown as SceneStore,
    startTouch: () => ({ state: null, link: { clock_step: 0 }, alive: () => { alive += 1; } }) as unknown as TouchHandle,
    prepareTouch: () => undefined,
  }, panels);
}

/** A panel with an element of the class `name`, whose calls are written down; it throws where it is told to. */
function panel(name: string, said: string[], fails = ""): Panel {
  const say = (what: string): void => {
    said.push(`${name} ${what}`);
    if (what === fails) throw new Error(what);
  };
  return {
    id: name,
    mount: (_, put): Mounted => {
      put("cards", el("div", { class: name }));
      say("mount");
      return { update: () => { say("update"); }, paint: () => { say("paint"); }, dispose: () => { say("dispose"); } };
    },
  };
}

function classes(of: StandIn): string[] {
  return [of.className, ...of.children.flatMap(classes)];
}

describe("a panel", () => {
  it("is mounted, updated and painted by a page that has never heard of it", () => {
    const said: string[] = [];
    open([panel("mine", said)]);
    expect(said).toEqual(["mine mount", "mine update"]);
    expect(classes(tree.body)).toContain("mine");
    said.length = 0;
    tree.picture(1);
    expect(said).toEqual(["mine paint", "mine update"]);
    expect(errors).toEqual([]);
  });

  it.each(["mount", "update", "paint"])("that throws in %s is taken out, and nothing else suffers", (where) => {
    const said: string[] = [];
    const page = open([panel("first", said), panel("bad", said, where), panel("last", said)]);
    page.touch(true);
    tree.picture(1);
    tree.picture(2);
    expect(page.own.handle).not.toBeNull();
    expect(alive).toBe(2); // a hand whose page is not heard of gives way
    expect(classes(tree.body).filter((name) => ["first", "bad", "last"].includes(name))).toEqual(["first", "last"]);
    const bad = said.filter((words) => words.startsWith("bad")).map((words) => words.slice(4));
    const until = { mount: ["mount"], update: ["mount", "update", "dispose"], paint: ["mount", "update", "update", "paint", "dispose"] }[where];
    expect(bad).toEqual(until);
    const others = (name: string): string[] => said.filter((words) => words.startsWith(name)).map((words) => words.slice(name.length));
    expect(others("first")).toEqual(others("last"));
    expect(others("last").filter((words) => words === " paint").length).toBe(2);
    expect(errors).toEqual([[expect.stringContaining('"bad"'), new Error(where)]]);
  });

  it("that throws once more when it is disposed of is out all the same", () => {
    let updates = 0;
    const page = open([{
      id: "bad",
      mount: () => ({ update: () => { updates += 1; throw new Error("update"); }, dispose: () => { throw new Error("dispose"); } }),
    }]);
    page.touch(true);
    tree.picture(1);
    expect(updates).toBe(1);
    expect(errors.map(([, error]) => error)).toEqual([new Error("update"), new Error("dispose")]);
    expect(alive).toBe(1);
  });
});

describe("the page's own panels", () => {
  it("all work without a scene, and lie in this order", async () => {
    const page = open(PANELS);
    page.touch(true);
    tree.picture(1);
    // What is loaded behind the picture.
    await vi.waitFor(() => { expect(classes(tree.body)).toContain("beside"); });
    tree.picture(2);
    expect(errors).toEqual([]);
    const stage = tree.body.children[0]?.children.find(({ className }) => className === "stage");
    expect(stage?.children.map(({ className }) => className.split(" ")[0])).toEqual([
      "stage-host", "bar", "ghost", "trace-place", "stack", "replay-place", "dock", "legend",
    ]);
    const [bar, stack] = ["bar", "stack"].map((name) => stage?.children.find(({ className }) => className === name));
    expect(stack?.children.map(({ className }) => className)).toEqual(["notice", "pill-place"]);
    expect(bar?.children.map((one) => one.getAttribute("aria-label")).filter((name) => name !== null)).toEqual([
      "Guided tour", "An object of your own", "Use a gamepad", "Look back at the last minute", "First view again", "Full screen",
      "Day or night", "Help", "Hands and plots",
    ]);
  });
});
