/** The rule on what the hand meets. A cursor's hand cannot jump, and the page has no models: rules for both are missing. */

import { sub } from "../../../model/vec";
import { isSilent, play, progress, shown } from "../arrival";
import type { Period } from "../period";

/** Move the shown surface on its way from patch to patch, and sample it at the probe. */
export function showSurface(period: Period): void {
  const { now, sample, settings } = period;
  period.silent = isSilent(period.state, now, settings);
  const state = (period.state = play(period.state, now, settings));
  period.fraction = progress(state, now);
  period.sight = shown(state, sample.position, period.fraction);
  period.fade = state.fade;
  period.moved = sub(sample.position, state.probe);
}
