/** The gamepad's desk with what it uses of the page; loaded when a gamepad is first asked for. */

import type { Hid } from "../gamepad/webhid";
import { isLive } from "../model/scene";
import type { PanelHost } from "../page/panels";
import { GamepadDesk } from "../ui/gamepad/desk";

/** A desk whose pad rests while the tour leads the hand or a replay is shown. */
export function openDesk(hid: Hid, page: PanelHost): GamepadDesk {
  const rests = (): boolean => page.tour.running || page.replay.active;
  return new GamepadDesk(hid, {
    touch: () => { page.touch(true); },
    towardsEye: () => page.towardsEye(),
    body: () => page.store.info?.body ?? null,
    felt: () => {
      const state = page.own.state;
      if (state === null || rests()) return null;
      const { force, t, fault, phase } = state;
      return { force, t, fault, live: phase === "joined" && isLive(page.store.status) };
    },
    steer: (target) => {
      if (!rests() || target === null) page.own.steer(target);
    },
  });
}
