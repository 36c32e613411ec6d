/** The notices of the page in abnormal states: the cause and the remedy. */

import { NO_WORD, type WatchPhase } from "../model/scene";
import { FORBIDDEN, NAME_TAKEN, OBJECT_CHANGED, ROOM_FULL, SERVER_STOPS, TOO_MANY, TOO_SLOW, UNAUTHENTICATED, WRONG_VERSION } from "../protocol/close_codes";

export interface Notice {
  /** Key of the cause: a dismissed notice stays away until the key changes. */
  readonly key: string;
  readonly tone: "busy" | "bad" | "info";
  readonly title: string;
  readonly text: string;
  readonly action: "reload" | "dismiss" | "wait" | null;
}

/** All facts on which the choice of a notice depends. */
export interface NoticeFacts {
  /** State of the graphics; "well" also while they are being loaded. */
  readonly picture: "well" | "no webgl" | "not loaded" | "lost";
  /** Whether the address had a token before the #, where servers log it. */
  readonly misplaced: boolean;
  /** Step of the clock of the own hand [s]; 0 if the clock is fine, and without a hand. */
  readonly clockStep: number;
  readonly phase: WatchPhase;
  /** Close code of the last connection; 0 for none. */
  readonly code: number;
  readonly reason: string;
  /** Seconds to the next attempt; 0 when it is being made. */
  readonly retryIn: number;
  /** Time since the newest message of the server [s]. */
  readonly silent: number;
  /** Whether there was a scene before. */
  readonly seen: boolean;
  /** Length of a pause of the page that ended a moment ago [s]; 0 for none. */
  readonly slept: number;
  /** Whether that pause has let a hand go. */
  readonly letGo: boolean;
  /** Reason why the own hand is not in the room; empty for none. */
  readonly touch: string;
  readonly touchCode: number;
  /** Reason why the own hand did not get the requested name; empty for none. */
  readonly nameRefused: string;
  /** Whether an administrator has muted the own hand, or frozen the object while it is there. */
  readonly muted: boolean;
  readonly frozen: boolean;
}

/** Text in place of the server's words, which count messages. */
const SLOW = "This page did not keep up.";
const MISPLACED = "Tokens belong behind #, as in /#token=\u2026: before it servers may write them down, so this one was not used.";
/** Step of a clock from which on a notice is given [s]: clearly longer than a picture. */
const COARSE = 0.04;
const PUT_OUT = /put out|banned/; // words of the server's reasons

/** The most urgent notice; null if there is none. */
export function notice(c: NoticeFacts): Notice | null {
  if (c.picture === "not loaded") {
    return make("picture", "bad", "The picture did not load",
      "A part of this page did not come from the server, so the object cannot be drawn.", "reload");
  }
  if (c.picture === "no webgl") {
    return make("webgl", "bad", "This browser shows no 3-D graphics",
      "WebGL is off or missing, so the object cannot be drawn; hands, forces and plots are live all the same. "
      + "Hardware acceleration in the browser's settings usually brings it back.", "dismiss");
  }
  if (c.picture === "lost") {
    return make("graphics", "busy", "The graphics are gone for a moment",
      "The system took them, and the picture comes back with them; if it does not, reload.", "reload");
  }
  const watch = ofWatch(c);
  if (watch !== null) return watch;
  if (c.touch !== "") return ofTouch(c);
  if (c.nameRefused !== "") return make(`name-${c.nameRefused}`, "info", "You keep your name", sentence(c.nameRefused), "dismiss");
  if (c.slept > 0) {
    const hand = c.letGo ? " Your hand was let go meanwhile." : "";
    return make(`slept-${Math.round(c.slept)}`, "info", "Welcome back",
      `The page was paused for ${period(c.slept)}.${hand}`, "dismiss");
  }
  return ofRestraints(c) ?? ofBrowser(c);
}

/** Notice about the visitor's browser or link, which does not keep the visitor from going on. */
function ofBrowser(c: NoticeFacts): Notice | null {
  if (c.misplaced) return make("misplaced", "info", "The token of your link is in the wrong place", MISPLACED, "dismiss");
  if (c.clockStep < COARSE) return null;
  return make("clock", "info", "This browser\u2019s clock is coarse",
    `It goes in steps of ${Math.round(1000 * c.clockStep)} ms, as in browsers that protect privacy. Your hand moves evenly all the same; `
    + "delays on this page, and the motion of others, are less exact.", "dismiss");
}

function ofRestraints(c: NoticeFacts): Notice | null {
  if (c.muted) {
    return make("muted", "info", "You are muted",
      "An administrator has muted you: the object takes none of your force.", "dismiss");
  }
  if (c.frozen) {
    return make("frozen", "info", "The object is frozen", "An administrator has frozen it: it takes nobody's force.", "dismiss");
  }
  return null;
}

function ofWatch(c: NoticeFacts): Notice | null {
  if (c.code === WRONG_VERSION && c.phase !== "watching") {
    return make("version", "bad", "The server was upgraded",
      "This page is older than the server. Reloading brings the new one.", "reload");
  }
  const reason = c.code === TOO_SLOW ? SLOW : sentence(c.reason);
  if (c.phase === "refused" && c.code === UNAUTHENTICATED) return make("invitation", "bad", "You need an invitation", c.misplaced ? `${reason} ${MISPLACED}` : reason);
  if (c.phase === "refused" && c.code === FORBIDDEN) {
    return make("forbidden", "bad", PUT_OUT.test(reason) ? "You are out of this room" : "You may not come in", reason);
  }
  switch (c.phase) {
    case "watching":
      return c.seen && c.silent >= NO_WORD
        ? make("silent", "busy", "No word from the server",
          `No word for ${period(c.silent)}. What you see is how it was then; it goes on by itself.`)
        : null;
    case "refused":
      return make("refused", "bad", "The server refused this page", reason === "" ? "It gave no reason." : reason, "reload");
    case "connecting":
      return c.seen
        ? make("lost", "busy", "Connecting again\u2026", reason)
        : make("connecting", "busy", "Connecting\u2026", "Asking the server for the object.");
    case "waiting":
      return make("lost", "busy", lostTitle(c.code),
        [reason, c.retryIn > 0 ? `Trying again in ${Math.ceil(c.retryIn)} s.` : "Trying again."].filter((s) => s !== "").join(" "));
  }
}

function lostTitle(code: number): string {
  if (code === SERVER_STOPS) return "The server has stopped";
  if (code === OBJECT_CHANGED) return "The object is another one now";
  if (code === TOO_SLOW) return "This page was too slow";
  if (code === TOO_MANY) return "This page asked for too much";
  if (code === ROOM_FULL) return "The room is full";
  return "The server is gone";
}

function ofTouch(c: NoticeFacts): Notice {
  const reason = sentence(c.touch);
  if (c.touchCode === ROOM_FULL) return make("full", "bad", "No place to touch", reason, /wait/.test(reason) ? "wait" : "dismiss");
  if (c.touchCode === FORBIDDEN) return make("no-touch", "info", "You may not touch", reason, "dismiss");
  if (c.touchCode === UNAUTHENTICATED) return make("no-token", "bad", "Your invitation is not valid any more", reason, "dismiss");
  if (c.touchCode === NAME_TAKEN) return make("name", "bad", "That name is taken", `${reason} Choose another name and touch again.`, "dismiss");
  return make(`touch-${c.touch}`, "bad", "You are not touching", reason, "dismiss");
}

function make(key: string, tone: Notice["tone"], title: string, text: string, action: Notice["action"] = null): Notice {
  return { key, tone, title, text, action };
}

/** The text with a capital and a full stop. */
export function sentence(text: string): string {
  const trimmed = text.trim();
  if (trimmed === "") return "";
  const first = trimmed.charAt(0).toUpperCase() + trimmed.slice(1);
  return /[.!?\u2026]$/.test(first) ? first : `${first}.`;
}

/** Words for a length of time. */
export function period(seconds: number): string {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${Math.round(seconds / 3600)} h`;
}
