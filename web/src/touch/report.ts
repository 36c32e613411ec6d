/** The report of the haptic Worker to the page, as a pure function. */

import { normalShift } from "../control/friction";
import { wavers } from "../control/playout";
import type { TouchPhase, TouchSettings, TouchState } from "../model/hand";
import { add, norm, scale, type Vec3 } from "../model/vec";
import type { Welcome } from "../protocol/messages";
import { LACKING } from "./loop/chain";
import { ledgerOf } from "./loop/ledger";
import type { Period } from "./loop/period";
import type { LoopState } from "./loop/state";
import { clockOffset, type LinkTiming, shortestTrip } from "./network/timing";

/** State of the connection, as the Worker sees it. */
export interface Connection {
  readonly phase: TouchPhase;
  /** Reason for the state in one sentence; empty for none. */
  readonly reason: string;
  /** Close code behind the reason; 0 for none. */
  readonly code: number;
}

/** Inputs of a report. */
export interface Known {
  readonly connection: Connection;
  readonly settings: TouchSettings;
  readonly welcome: Welcome | null;
  readonly place: TouchState["place"];
  readonly name_refused: string;
  readonly loop: LoopState;
  /** Newest period; null before the first. */
  readonly newest: Period | null;
  readonly explains: boolean;
  readonly cursor: Vec3;
  readonly timing: LinkTiming;
  readonly leaving: boolean;
  readonly late: Pick<TouchState, "tick_late" | "loop_stall">;
  readonly trace: Float64Array;
  readonly now: number;
}

export function reportOf(known: Known): TouchState {
  const { connection, settings, welcome, loop, newest, timing, now } = known;
  const { sight, patch, safety } = loop;
  const probe = welcome === null ? known.cursor : loop.probe;
  const normal: Vec3 = sight?.normal ?? [0, 0, 1];
  const depth = sight?.depth ?? -1;
  const indentation = safety.scale * (newest?.local.indentation ?? 0);
  // The tip is drawn on the surface free of the own force, less the own dent.
  const dent = indentation + (loop.compliance === null ? 0 : safety.scale * normalShift(loop.friction, normal, loop.compliance));
  const proxy = depth > 0 ? add(probe, scale(normal, Math.max(0, depth - dent))) : probe;
  return {
    ...connection,
    doing: doing(known),
    place: known.place,
    user: welcome?.user ?? 0,
    name: welcome?.name ?? settings.name,
    name_refused: known.name_refused,
    t: now,
    target: known.cursor,
    probe,
    proxy,
    normal,
    force: newest?.force ?? [0, 0, 0],
    along: safety.scale * norm(loop.friction.force),
    felt_from_others: safety.scale * (newest?.local.felt_from_others ?? 0),
    depth,
    indentation,
    law: loop.fade?.now.law ?? null,
    requested_law: settings.law,
    k_o: patch === null ? 0 : 1 / patch.c_ii,
    k_h: loop.fade?.now.gains.k_h ?? 0,
    scale: safety.scale,
    fault: safety.fault,
    round_trip: timing.round_trip,
    network: shortestTrip(timing),
    clock_offset: clockOffset(timing),
    wavers: wavers(loop.playout),
    simulation_period: welcome?.simulation_period ?? 0,
    ...known.late,
    trace: known.trace,
    explained: known.explains ? { lacking: LACKING, ledger: newest === null ? null : ledgerOf(newest) } : null,
  };
}

/** State of the loop in words, the same as those of the Python client. */
function doing({ connection, loop, newest, leaving }: Known): string {
  if (leaving || connection.phase === "closed") return "stopped";
  if (loop.patch === null) return "connecting";
  if (newest?.silent === true) return "server silent";
  if (loop.safety.scale === 0) return "waiting";
  return newest !== null && newest.local.normal_force > 0 ? "touching" : "free";
}
