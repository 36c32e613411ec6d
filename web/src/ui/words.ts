/** Numbers and names as people read them; the only place with millimetres and milliseconds. */

import type { RoomLag } from "../model/body";
import type { OwnLink } from "../model/hand";
import { answersOwnDent, type LawName } from "../model/laws";
import type { UserState } from "../model/scene";
import { written } from "./plots/lanes";

const THIN = "\u202f";

/** A number with `places` digits, a true minus sign, and no minus on zero. */
export const fixed = written;

export const newtons = (f: number): string => `${fixed(f, 2)}${THIN}N`;
export const millimetres = (x: number, places = 1): string => `${fixed(1e3 * x, places)}${THIN}mm`;
export const milliseconds = (t: number): string => `${fixed(1e3 * t, 0)}${THIN}ms`;

/** Letters that are written from right to left (Hebrew, Arabic and their kin). */
const LEFTWARD = /[\u0590-\u08ff\ufb1d-\ufdff\ufe70-\ufefc]/;

/** A name before a number, isolated if it is written from right to left: it would move the number to its other side. */
export const named = (name: string): string => (LEFTWARD.test(name) ? `\u2068${name}\u2069` : name);

/** Stiffness with three digits. */
export function stiffness(k: number): string {
  if (!(k > 0) || !Number.isFinite(k)) return "\u2013";
  return k >= 1e4 ? `${fixed(k / 1e3, 0)}${THIN}N/mm` : `${fixed(k, k >= 100 ? 0 : 1)}${THIN}N/m`;
}

export function bytesPerSecond(b: number): string {
  return b < 1000 ? `${fixed(b, 0)}${THIN}B/s` : `${fixed(b / 1000, b < 1e4 ? 1 : 0)}${THIN}kB/s`;
}

const WHOLE = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });
const AS_STIFF = 0.99; // share of the object's stiffness; a device that renders so much is no softer to the hand
const LEAST_LAG = 0.005; // s; a smaller lag is shown as none
const FAR = 100; // a larger margin is no better

/** Words on the stiffness of a device that is softer than the object; empty for other devices. */
export function softWords(user: Pick<UserState, "law" | "k_h" | "c_ii">): string {
  const k_o = user.c_ii > 0 ? 1 / user.c_ii : 0;
  if (answersOwnDent(user.law) || !(user.k_h > 0 && user.k_h < AS_STIFF * k_o)) return "";
  return `device renders ${WHOLE.format(user.k_h)} of ${WHOLE.format(k_o)} N/m`;
}

/** Words on how soon a hand feels the others; empty while there are none. */
export function lagWords(room: RoomLag, hands: number): string {
  if (hands < 2) return "";
  return room.lag < LEAST_LAG ? "The object answers the others at once" : `The object answers the others in ${fixed(room.lag, 2)} s`;
}

/** Words on the reasons for the room's lag, with the numbers. */
export function lagReasons({ lag, coupling, margin }: RoomLag): string {
  const m = `The hands\u2019 coupling m is ${fixed(coupling, 2)}`;
  const far = margin < FAR ? ` (margin ${fixed(margin, 1)})` : "";
  if (lag < LEAST_LAG) return `${m}: below 1 no lag is needed${far}.`;
  if (coupling < 1) return `${m}: hands at rest need no lag${far}; moving hands on devices that damp little do.`;
  return `${m}${far}: this lag keeps moving hands steady at any delay; K_o stays.`;
}

/** Name and a sentence for each law, in the order in which they are offered. */
export const LAW_WORDS: Readonly<Record<LawName, readonly [name: string, hint: string]>> = {
  predictive: ["Predictive", "Presses on the surface free of its own force: the object's own stiffness, at any delay"],
  pi: ["PI", "The paper's proportional-integral law, its gains chosen for the measured delay"],
  proportional: ["Proportional", "The paper's proportional law, its gain chosen for everybody's coupling"],
};

const NEAR = 0.15; // s; hardly anybody notices so short a loop: two ticks, two ways across a town, a picture
const FAR_OFF = 0.4; // s; with a longer loop a voice call would be tiring

const WAVERS = 0.01; // s; scheduling alone makes a few milliseconds
const NOTED = 0.05; // s; from this delay of its own on, a page says so
const OFTEN = 0.1; // s by which a loop may exceed its shortest trip: ticks of the server, a sample's wait

/**
 * Words on a person's connection, without numbers of the control.
 *
 * The server measures the loop as a whole, including the time in the person's machine. For its own hand a page knows the
 * shares: the time in the network, and the time that the page itself adds.
 *
 * @param own The page's measurements of its own hand; null for other hands and for a past time.
 */
export function connectionWords(user: Pick<UserState, "fresh" | "loop_delay" | "latency" | "presence">, own: OwnLink | null = null): string {
  if (!user.fresh) return "Connection lost";
  const added = user.latency.delay > 0 ? `, ${milliseconds(user.latency.delay)} of it each way added here` : "";
  if (!(user.loop_delay > 0)) return "Just came";
  if (own === null || own.network === null) return `${farness(user.loop_delay)}: ${milliseconds(user.loop_delay)} there and back, its machine included${added}`;
  // The measured value may not yet contain a delay that was added a moment ago.
  const network = Math.max(own.network, 2 * user.latency.delay);
  const finest = Math.max(0.001, own.clock_step);
  const way = network < finest ? `under ${milliseconds(finest)}` : milliseconds(network);
  // A message may wait in both directions; a clock that goes in steps adds apparent waits.
  const share = Math.max(0, Math.min(user.loop_delay - network, 2 * own.page_wait - own.clock_step));
  // Time that neither the shortest trip nor the page explains comes from a path that holds messages up.
  const longest = user.loop_delay - share;
  const heldUp = longest - network - own.clock_step >= OFTEN;
  const now = heldUp ? `, now and then up to ${milliseconds(longest)}` : "";
  return `${farness(heldUp ? longest : network)}: ${way} there and back${now}${added}${late("this page", share)}${late("the server", own.tick_late)}${late("this browser", own.loop_stall, own.clock_step)}${own.wavers < WAVERS ? "" : `; the link wavers: ${milliseconds(own.wavers)}`}`;
}

/** Words on what is late by itself; a clock that goes in steps shows no less than these. */
function late(who: string, time: number, step = 0): string {
  return time - step < NOTED ? "" : `; ${who} is up to ${milliseconds(time)} late`;
}

function farness(delay: number): string {
  return delay < NEAR ? "Close by" : delay < FAR_OFF ? "Some way off" : "Far away";
}
