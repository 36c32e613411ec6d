/**
 * The ledger of a period: what each rule did to the force on the hand, in the order of the rules.
 *
 * A force begins as that of the shown surface, and each rule adds to it or takes from it; the entries together are the
 * force that the hand was given. They are made from a period when somebody asks, and cost nothing elsewhere.
 * `client/cohaptic_client/loop/ledger.py` in TypeScript, which says what each entry is.
 */

import type { Ledger } from "../../model/hand";
import { norm } from "../../model/vec";
import type { Period } from "./period";

const NOTHING: Ledger = { surface: 0, models: 0, gain: 0, depth: 0, law: 0, damping: 0, friction: 0, limit: 0, fade: 0, rate: 0 };

export function ledgerOf(period: Period): Ledger {
  const { sight, fade, local, damped_force, k_wanted, safety: { scale }, settings: { limits } } = period;
  const given = norm(period.force);
  const size = period.compliance === null ? damped_force : norm(period.asked);
  // Without a surface, or with a force or a depth that is no number, there is at most what is left of a force that is taken away.
  if (sight === null || fade === null || !Number.isFinite(size + k_wanted * sight.depth)) return { ...NOTHING, rate: given };
  const { k_h } = fade.now.gains;
  const [shown, depth, pressed] = [sight.depth, period.depth, period.law_depth].map((below) => Math.max(0, below)) as [number, number, number];
  const most = Math.min(size, limits.max_force);
  return {
    surface: k_wanted * shown,
    models: 0,
    gain: (k_h - k_wanted) * shown,
    depth: k_h * (depth - shown),
    law: local.normal_force - k_h * pressed,
    damping: damped_force - local.normal_force,
    friction: k_h * (pressed - depth) + size - damped_force,
    limit: most - size,
    fade: (scale - 1) * most,
    rate: given - scale * most,
  };
}
