/** Fig. 8, live: the set of stable gains, and each user's gains in it. */

import { type Gains, isStable, stableOutline } from "../../control/stable_set";
import { answersOwnDent } from "../../model/laws";
import { linear } from "../../model/scale";
import type { UserState } from "../../model/scene";
import { type Inks, sharpen } from "./canvas";

/** K_o by which the gains are measured: that of the contact alone, or coupled with the other contacts. */
export type Yardstick = "alone" | "coupled";

/** Delay of a loop in whole simulation periods beyond the first. */
export function periods(loopDelay: number, simulationPeriod: number): number {
  return Math.min(64, Math.max(0, Math.ceil(loopDelay / simulationPeriod - 1e-6)));
}

/** A user's gains as shares of K_o; null without a contact. The predictive law's gain is a share of the contact alone, K_i C_ii. */
export function gainsOf(user: UserState, simulationPeriod: number, yardstick: Yardstick): Gains | null {
  const k_o = yardstick === "alone" || !answersOwnDent(user.law) ? (user.c_ii > 0 ? 1 / user.c_ii : 0) : user.k_o_coupled;
  if (!(k_o > 0) || !(user.k_h > 0)) return null;
  return { kappa: user.k_h / k_o, int: (user.integral_gain * simulationPeriod) / k_o };
}

/** Whether a user's gains are in the set; the predictive law has its own proof of stability and is no point of the figure. */
export function verdict(user: UserState, simulationPeriod: number, yardstick: Yardstick): "inside" | "outside" | "own" | "none" {
  const gains = gainsOf(user, simulationPeriod, yardstick);
  if (gains === null) return "none";
  if (!answersOwnDent(user.law)) return "own";
  return isStable(gains, periods(user.loop_delay, simulationPeriod)) ? "inside" : "outside";
}

const WIDE = 1.5;
const HIGH = 2.2;
const BOX = { left: 34, right: 10, top: 10, bottom: 20 } as const;
const outlines = new Map<number, [number, number][]>();

function outline(delay: number): [number, number][] {
  let points = outlines.get(delay);
  if (points === undefined) {
    points = stableOutline(delay, delay > 8 ? 40 : 60);
    outlines.set(delay, points);
  }
  return points;
}

export function drawArea(
  canvas: HTMLCanvasElement,
  users: readonly UserState[],
  simulationPeriod: number,
  yardstick: Yardstick,
  colour: (user: number) => string,
  ink: Inks,
): void {
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (width === 0 || height === 0) return;
  const c = sharpen(canvas, width, height);
  if (c === null) return;
  c.clearRect(0, 0, width, height);
  c.font = getComputedStyle(canvas).font;
  const x = linear({ low: 0, high: WIDE }, { low: BOX.left, high: width - BOX.right });
  const y = linear({ low: 0, high: HIGH }, { low: height - BOX.bottom, high: BOX.top });
  c.save();
  c.beginPath();
  c.rect(x(0), y(HIGH), x(WIDE) - x(0), y(0) - y(HIGH));
  c.clip();
  const longest = Math.max(0, ...users.map((user) => periods(user.loop_delay, simulationPeriod)));
  fill(c, outline(0), x, y, ink.get("--area-0"), ink.get("--area-edge"));
  if (longest > 0) fill(c, outline(longest), x, y, ink.get("--area-1"), ink.get("--accent"));
  c.strokeStyle = ink.text;
  c.setLineDash([2, 3]);
  c.beginPath();
  c.moveTo(x(1), y(0));
  c.lineTo(x(1), y(HIGH));
  c.stroke();
  c.setLineDash([]);
  c.restore();
  frame(c, x, y, ink);
  for (const user of users) {
    const gains = gainsOf(user, simulationPeriod, yardstick);
    if (gains === null) continue;
    dot(c, x(Math.min(WIDE, gains.kappa)), y(Math.min(HIGH, gains.int)), colour(user.user), !answersOwnDent(user.law), ink);
  }
}

function fill(
  c: CanvasRenderingContext2D,
  points: readonly [number, number][],
  x: (v: number) => number,
  y: (v: number) => number,
  inside: string,
  edge: string,
): void {
  c.beginPath();
  points.forEach(([kappa, int], i) => {
    if (i === 0) c.moveTo(x(kappa), y(int));
    else c.lineTo(x(kappa), y(int));
  });
  c.closePath();
  c.fillStyle = inside;
  c.fill();
  c.strokeStyle = edge;
  c.lineWidth = 1.2;
  c.stroke();
}

function frame(c: CanvasRenderingContext2D, x: (v: number) => number, y: (v: number) => number, ink: Inks): void {
  c.strokeStyle = ink.faint;
  c.lineWidth = 1;
  c.beginPath();
  c.moveTo(x(0) - 0.5, y(HIGH));
  c.lineTo(x(0) - 0.5, y(0) + 0.5);
  c.lineTo(x(WIDE), y(0) + 0.5);
  c.stroke();
  c.fillStyle = ink.text;
  c.textBaseline = "middle";
  c.textAlign = "right";
  for (const mark of [0, 1, 2]) c.fillText(`${mark}`, x(0) - 7, y(mark));
  c.textAlign = "center";
  for (const mark of [0.5, 1, 1.5]) c.fillText(`${mark}`, x(mark) - (mark === WIDE ? 6 : 0), y(0) + 11);
}

function dot(c: CanvasRenderingContext2D, x: number, y: number, colour: string, hollow: boolean, ink: Inks): void {
  c.beginPath();
  c.arc(x, y, 5.5, 0, 2 * Math.PI);
  c.lineWidth = hollow ? 2.4 : 1.5;
  c.fillStyle = hollow ? ink.get("--panel") : colour;
  c.strokeStyle = hollow ? colour : ink.get("--panel");
  c.fill();
  c.stroke();
}
