/** Elements enough to make a page without a browser: a tree with classes and attributes, and no layout. */

import { vi } from "vitest";

export class StandIn {
  readonly children: StandIn[] = [];
  readonly dataset: Record<string, string> = {};
  readonly attributes = new Map<string, string>();
  readonly style = { setProperty: (): void => undefined, transform: "" };
  readonly offsetHeight = 0;
  readonly offsetTop = 0;
  readonly offsetParent = null;
  readonly classes = new Set<string>();
  parent: StandIn | null = null;
  textContent = "";
  value = "";
  hidden = false;

  get className(): string { return [...this.classes].join(" "); }

  set className(names: string) {
    for (const name of names.split(" ")) this.classes.add(name);
  }

  get classList(): object {
    const { classes } = this;
    return {
      add: (name: string) => { classes.add(name); },
      toggle: (name: string, on = !classes.has(name)) => {
        if (on) classes.add(name);
        else classes.delete(name);
        return on;
      },
    };
  }

  setAttribute(name: string, value: string): void { this.attributes.set(name, value); }

  getAttribute(name: string): string | null { return this.attributes.get(name) ?? null; }

  addEventListener(): void { return undefined; }

  getContext(): null { return null; }

  append(...children: (StandIn | string)[]): void {
    for (const child of children) if (child instanceof StandIn) this.insertBefore(child, null);
  }

  insertBefore(child: StandIn, before: StandIn | null): void {
    child.remove();
    child.parent = this;
    this.children.splice(before === null ? this.children.length : this.children.indexOf(before), 0, child);
  }

  replaceChildren(): void { return undefined; }

  remove(): void {
    const at = this.parent?.children.indexOf(this) ?? -1;
    if (at >= 0) this.parent?.children.splice(at, 1);
    this.parent = null;
  }
}

/** Put the stand-ins in place of a browser; returns the body, and a function that shows a picture some seconds from now. */
export function browser(): { body: StandIn; picture: (later: number) => void } {
  const body = new StandIn();
  let next: (t: number) => void = () => undefined;
  const make = (): StandIn => new StandIn();
  vi.stubGlobal("document", {
    body, documentElement: new StandIn(), fullscreenEnabled: true, createElement: make, createElementNS: make,
    addEventListener: () => undefined,
  });
  vi.stubGlobal("window", {});
  vi.stubGlobal("navigator", { userActivation: { hasBeenActive: false }, getGamepads: () => [] });
  vi.stubGlobal("location", { search: "", hash: "", href: "http://localhost/" });
  vi.stubGlobal("addEventListener", () => undefined);
  vi.stubGlobal("matchMedia", () => ({ matches: false, addEventListener: () => undefined }));
  vi.stubGlobal("getComputedStyle", () => ({ getPropertyValue: () => "" }));
  vi.stubGlobal("requestAnimationFrame", (then: (t: number) => void) => { next = then; });
  return { body, picture: (later) => { next(performance.now() + 1000 * later); } };
}
