/** The page's handle on the haptic Worker: starts the Worker, exchanges the newest values, and ends it. */

import type { TouchHandle, TouchSettings, TouchState } from "../model/hand";
import { Longest } from "./longest";
import type { FromWorker, ToWorker } from "./worker_messages";

const ALIVE_EVERY = 1000; // ms between two messages that the page draws; it draws far more often, or not at all
const GRACE = 1500; // ms for the Worker to end by itself; the force may take a second to fade
// The former hand may still be leaving the room, under the same name.
let previous: Promise<void> = Promise.resolve();

// A started Worker that waits for the first hand; later Workers find the script in the browser's cache.
let ready: Worker | null = null;
let prepared = false;
// Secret with which this page gets its name back at once. A copy of the tab loads anew and makes its own.
export const KEY = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");

/** Start a Worker early, so that the first touch does not wait for its script. */
export function prepareTouch(): void {
  if (prepared) return;
  prepared = true;
  const worker = newWorker();
  // The Worker that is started with the touch reports the reason.
  worker.onerror = () => {
    if (ready === worker) ready = null;
  };
  ready = worker;
}

function newWorker(): Worker {
  return new Worker(new URL("./worker.ts", import.meta.url), { type: "module", name: "haptics" });
}

/**
 * Bring a hand into the room.
 *
 * @param beside Whether this is a second hand of this page: it has another name and need not wait for the former hand.
 */
export function startTouch(settings: TouchSettings, beside = false): TouchHandle {
  const worker = beside ? newWorker() : (ready ?? newWorker());
  if (!beside) ready = null;
  prepared = true;
  const turn = beside ? Promise.resolve() : previous;
  const say = (message: ToWorker): void => {
    void turn.then(() => {
      worker.postMessage(message);
    });
  };
  const listeners = new Set<() => void>();
  let state: TouchState | null = null;
  let said = -Infinity;
  let failure = "";
  let clock_step = 0;
  let delay = 0;
  let explained = false;
  const [wait, tick, stall] = [new Longest(), new Longest(), new Longest()];
  let ended = (): void => undefined;
  const end = new Promise<void>((resolve) => {
    ended = resolve;
  }).then(() => {
    worker.terminate();
  });
  if (!beside) previous = end;
  worker.onmessage = ({ data }: MessageEvent<FromWorker>) => {
    if (data.type === "ended") ended();
    else {
      [state, clock_step] = [data.state, data.clock_step ?? 0];
      const now = performance.now() / 1000;
      wait.note(now - state.t, now);
      tick.note(state.tick_late, now);
      stall.note(state.loop_stall, now);
    }
    for (const listener of listeners) listener();
  };
  worker.onerror = ({ message }) => {
    failure = `the haptic Worker failed: ${message || "it could not be loaded"}`;
    ended();
    for (const listener of listeners) listener();
  };
  say({ type: "start", settings: { key: KEY, ...settings }, time_origin: performance.timeOrigin });
  return {
    get state() {
      return state;
    },
    get failure() {
      return failure;
    },
    get link() {
      // The measured value may not yet contain a delay that was added a moment ago.
      const network = state === null || state.network === null ? null : Math.max(state.network, 2 * delay);
      return { network, page_wait: wait.value, clock_step, tick_late: tick.value, loop_stall: stall.value, wavers: state?.wavers ?? 0 };
    },
    point: (target, presses = true) => {
      say({ type: "point", target, presses });
    },
    alive: () => {
      const now = performance.now();
      if (now - said < ALIVE_EVERY) return;
      said = now;
      say({ type: "alive" });
    },
    setLaw: (law, fixed = null) => {
      say({ type: "law", law, fixed });
    },
    setHand: (hand) => {
      say({ type: "hand", hand });
    },
    setName: (name) => {
      say({ type: "name", name });
    },
    setFriction: (mu) => {
      say({ type: "friction", mu });
    },
    setDelay: (seconds) => {
      if (seconds !== delay) say({ type: "delay", delay: (delay = seconds) });
    },
    explain: (wanted) => {
      if (wanted !== explained) say({ type: "explain", wanted: (explained = wanted) });
    },
    subscribe: (listener) => {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
    close: () => {
      say({ type: "close" });
      setTimeout(ended, GRACE);
      return end;
    },
  };
}
