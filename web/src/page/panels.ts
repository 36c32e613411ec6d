/**
 * Panels: parts of the page that register themselves, so that the page knows none of them by name.
 *
 * A panel is a value with one function, `mount`, in a module of `src/panels/`, and a line in `src/panels/list.ts`. A panel
 * that throws when the page calls it pays for that alone: it is taken out, the console says so, and the page and all other
 * panels go on.
 */

import type { Scheme } from "../model/colours";
import type { TouchHandle } from "../model/hand";
import type { SceneSnapshot, SceneStore } from "../model/scene";
import type { Vec3 } from "../model/vec";
import type { Visit } from "../share/windows";
import type { Inks } from "../ui/plots/canvas";
import type { NoticeFacts } from "../ui/notice";
import type { Colouring, Legend } from "../view/body/surface";
import type { PageActions } from "./controls";
import type { Put } from "./layout";
import type { VisitorName } from "./names";
import type { StartTouch } from "./own_hand";

export interface PageSettings extends Visit {
  readonly openStore: () => SceneStore;
  readonly startTouch: StartTouch;
  /** Prepare what the first touch needs, when there is something to touch. */
  readonly prepareTouch: () => void;
  /** Whether the address had a token in the part that servers log. */
  readonly misplaced: boolean;
  /** The secret of this page's hand. */
  readonly key: string;
}

/** Troubles that only the page knows. */
export type Trouble = Pick<NoticeFacts, "picture" | "misplaced" | "seen" | "slept" | "letGo">;

/** The page as panels see it. */
export interface PanelHost extends PageActions {
  /** The element of the whole page. */
  readonly root: HTMLElement;
  readonly settings: PageSettings;
  /** Websocket of the server. */
  readonly url: string;
  readonly visitor: VisitorName;
  /** The present scene; null before it has come. */
  readonly view: SceneSnapshot | null;
  /** The shown scene, present or past; null before it has come. */
  readonly shown: SceneSnapshot | null;
  /** Whether the server is heard. */
  readonly live: boolean;
  /** Resolved when the graphics are loaded, before which nothing else should ask for the network. */
  readonly graphics: Promise<unknown>;
  /** Whether the body has been drawn. */
  readonly drawn: boolean;
  readonly scheme: Scheme;
  /** Legend of the surface colours; null until there is a picture. */
  readonly legend: Legend | null;
  setColouring(by: Colouring): void;
  colour(user: number): string;
  /** Present colours for drawing. */
  inks(): Inks;
  /** Direction from the middle of the body towards the eye. */
  towardsEye(): Vec3;
  /** The hand of a partner whom the visitor has brought, null for none; set by the panel that brings one. */
  partner: () => TouchHandle | null;
  /** Troubles of the page itself, beside those of connection and hand. */
  trouble(now: number): Trouble;
}

/** A panel on the page. Whatever it does not need, it leaves out. */
export interface Mounted {
  /** Write words, numbers and plots: ten times a second, and with each change. `now` is the page's clock [s]. */
  update?(now: number): void;
  /** Called for each picture, before the hand moves and the picture is drawn. */
  paint?(now: number): void;
  /** Let the hand go: nobody watches it. */
  rest?(): void;
  /** Open or close the panel, since a button or a key of another part asks for it. */
  toggle?(): void;
  /** The panel was taken out: end what would go on without it. */
  dispose?(): void;
}

export interface Panel {
  readonly id: string;
  /**
   * Make the panel, once, when the page is made.
   *
   * @param put Puts an element of the panel onto the page; whoever takes the panel out removes these elements.
   */
  mount(page: PanelHost, put: Put): Mounted;
}

/** A panel with its elements and its functions; without both once it was taken out. */
interface Entry {
  readonly id: string;
  readonly parts: HTMLElement[];
  mounted: Mounted;
}

/** The panels that are on the page. */
export class Panels {
  private readonly entries: Entry[] = [];

  constructor(panels: readonly Panel[], page: PanelHost, put: Put) {
    for (const panel of panels) {
      const entry: Entry = { id: panel.id, parts: [], mounted: {} };
      this.entries.push(entry);
      guard(entry, () => {
        entry.mounted = panel.mount(page, (place, part, covers) => {
          entry.parts.push(part);
          put(place, part, covers);
        });
      });
    }
  }

  /** Call one function of all panels that have it, at a time on the page's clock [s]. */
  each(hook: "update" | "paint" | "rest", now = performance.now() / 1000): void {
    for (const entry of this.entries) guard(entry, () => entry.mounted[hook]?.(now));
  }

  /** Open or close the panel of this name; nothing happens where it was taken out. */
  toggle(id: string): void {
    for (const entry of this.entries) if (entry.id === id) guard(entry, () => entry.mounted.toggle?.());
  }
}

/** Do what a panel asks for, and take the panel out if it throws. */
function guard(entry: Entry, act: () => void): void {
  try {
    act();
  } catch (error) {
    console.error(`The panel "${entry.id}" failed; the page goes on without it.`, error);
    for (const part of entry.parts.splice(0)) part.remove();
    const { mounted } = entry;
    entry.mounted = {};
    guard(entry, () => mounted.dispose?.());
  }
}
