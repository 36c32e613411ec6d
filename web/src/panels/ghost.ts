/** The ghost hand over the object, for a visitor who has never pressed. */

import type { Panel } from "../page/panels";
import { Ghost } from "../ui/ghost";

export const ghost: Panel = {
  id: "ghost",
  mount: (page, put) => {
    const hand = new Ghost();
    put("over", hand.root);
    return {
      update: () => {
        const { own, store, tour, replay, company } = page;
        // A visitor whose press met a full room has not learned the gesture yet.
        if (own.held !== null && own.state?.doing === "touching") hand.learned();
        hand.show(!own.pressing && !company.armed && page.drawn && page.live && !tour.running && !replay.active && store.info?.can_touch === true);
      },
    };
  },
};
