/** The gains of the newest patch where the probe is now. */

import type { Sight } from "../../control/geometry";
import type { Gains } from "../../control/law";
import { answersOwnDent } from "../../model/laws";
import { MIN_COMPLIANCE } from "../../protocol/layout";
import type { Patch } from "../../protocol/patch";
import type { LoopSettings } from "./state";

const MOST_CHANGE = 2; // largest ratio of compliances within one patch; more is an error in the patch
const AS_STIFF = 1 - 1e-5; // K_h C_ii of a hand with the object's own stiffness, rounded to 32 bits

/**
 * The gains of a patch at the present place of the probe: gains are shares of 1 / C_ii, and C_ii is in transition from
 * the previous patch to the newest.
 */
export function gainsUnder(patch: Patch, sight: Sight, settings: Pick<LoopSettings, "follow" | "max_stiffness">): Gains {
  const { law, k_h, integral_gain } = patch;
  if (!settings.follow) return { k_h: Math.min(k_h, settings.max_stiffness), integral_gain };
  const least = patch.c_ii / MOST_CHANGE;
  const most = patch.c_ii * MOST_CHANGE;
  const c_ii = Math.max(MIN_COMPLIANCE, least, Math.min(most, sight.c_ii));
  if (!answersOwnDent(law)) {
    // The object's stiffness here, or the device's where the server says that it is softer.
    const softer = k_h * patch.c_ii < AS_STIFF;
    const limit = softer ? Math.min(settings.max_stiffness, k_h) : settings.max_stiffness;
    return { k_h: Math.min(1 / c_ii, limit), integral_gain };
  }
  const ratio = patch.c_ii / c_ii;
  return {
    k_h: Math.min(k_h * ratio, settings.max_stiffness),
    integral_gain: integral_gain * ratio,
  };
}
