/** The place of an administrator's buttons, whose code is loaded only for visitors who may use them. */

import { el, show } from "../dom";
import type * as Orders from "./orders";

const AGAIN = 10_000; // ms after which code that could not be loaded is requested again

export class OrdersPlace<Part extends Orders.RoomOrders | Orders.UserOrders> {
  readonly root = el("div");
  private part: Part | null = null;
  private asked = false;

  constructor(private readonly make: (orders: typeof Orders) => Part) {
    show(this.root, false);
  }

  /** The buttons when their code is loaded, which the first wish requests; null before. */
  get(wanted: boolean): Part | null {
    if (wanted && !this.asked) {
      this.asked = true;
      void import("./orders").then((orders) => {
        this.part = this.make(orders);
        this.root.append(this.part.root);
        show(this.root, true);
      }, () => { setTimeout(() => { this.asked = false; }, AGAIN); });
    }
    return this.part;
  }
}
