/** The legend of the surface colours at the foot of the stage. */

import type { Panel } from "../page/panels";
import { LegendBox } from "../ui/legend";

export const legend: Panel = {
  id: "legend",
  mount: (page, put) => {
    const box = new LegendBox((by) => { page.setColouring(by); });
    put("foot", box.root);
    return {
      update: () => {
        if (page.legend !== null) box.update(page.legend, page.scheme);
      },
    };
  },
};
