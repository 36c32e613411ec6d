/** The column's offers to who is alone; their code is loaded behind the picture. */

import type { Panel } from "../page/panels";
import { el } from "../ui/dom";
import { lazily } from "../ui/lazy";
import type { Offers } from "./offers";

export const beside: Panel = {
  id: "beside",
  mount: (page, put) => {
    let offers: Offers | null = null;
    const place = el("div");
    put("offers", place);
    lazily(() => page.graphics.then(() => import("./offers")), ({ Offers }) => {
      offers = new Offers(page, place);
      page.partner = () => offers?.hand ?? null;
    })();
    return {
      update: () => { offers?.update(); },
      paint: () => { offers?.frame(); },
      dispose: () => { offers?.sendAway(); },
    };
  },
};
