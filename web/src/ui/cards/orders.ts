/** Buttons for an administrator of the room: to mute, put out and ban somebody; to freeze and reset the object. */

import type { Order } from "../../model/orders";
import type { SceneStore } from "../../model/scene";
import { el, say, show } from "../dom";

const SURE_FOR = 4000; // ms for which a button waits for the second press

interface OrderButton {
  readonly root: HTMLButtonElement;
  /** Set the button's words; `about` completes them for screen readers. */
  set(words: string, about: string): void;
}

/** Make a button; if its order cannot be undone, the button asks for a second press. */
function orderButton(press: () => void, sure: string | null): OrderButton {
  let asked = 0;
  let [words, about] = ["", ""];
  const root = el("button", { class: "order", attrs: { type: "button" } });
  const write = (): void => {
    const text = asked === 0 ? words : (sure ?? words);
    say(root, text);
    root.setAttribute("aria-label", `${text} ${about}`.trim());
    root.classList.toggle("sure", asked !== 0);
  };
  const forget = (): void => {
    clearTimeout(asked);
    asked = 0;
    write();
  };
  root.addEventListener("click", () => {
    if (sure !== null && asked === 0) {
      asked = window.setTimeout(forget, SURE_FOR);
      write();
      return;
    }
    forget();
    press();
  });
  root.addEventListener("blur", forget);
  return {
    root,
    set: (next, name) => {
      if (next === words && name === about) return;
      [words, about] = [next, name];
      write();
    },
  };
}

/** Orders about one user, in that user's card. */
export class UserOrders {
  readonly root: HTMLElement;
  private readonly mute: OrderButton;
  private readonly kick: OrderButton;
  private readonly ban: OrderButton;
  private muted = false;

  constructor(order: (order: Order) => void) {
    this.mute = orderButton(() => { order(this.muted ? "unmute" : "mute"); }, null);
    this.kick = orderButton(() => { order("kick"); }, null);
    this.ban = orderButton(() => { order("ban"); }, "Ban for good?");
    this.mute.root.title = "The object takes none of this user\u2019s force";
    this.kick.root.title = "Out of the room, for five minutes";
    this.ban.root.title = "Out of the room for good, with everybody who comes later by the same invitation";
    this.root = el("div", { class: "orders", attrs: { role: "group" } }, this.mute.root, this.kick.root, this.ban.root);
  }

  write(name: string, muted: boolean, visible: boolean): void {
    this.muted = muted;
    show(this.root, visible);
    this.root.setAttribute("aria-label", `Orders about ${name}`);
    this.mute.set(muted ? "Unmute" : "Mute", name);
    this.kick.set("Put out", name);
    this.ban.set("Ban", name);
  }
}

/** Orders about the room, above the cards. */
export class RoomOrders {
  readonly root: HTMLElement;
  private readonly freeze: OrderButton;
  private readonly reset: OrderButton;
  private readonly record: OrderButton;
  private readonly buttons: HTMLElement;
  private readonly out = el("ul", { class: "orders put-out", attrs: { "aria-label": "Who was put out" } });
  private names: readonly string[] = [];
  private frozen = false;
  private onRecord = false;

  constructor(private readonly order: (order: Order, user?: number, name?: string) => void) {
    this.freeze = orderButton(() => { order(this.frozen ? "unfreeze" : "freeze"); }, null);
    this.reset = orderButton(() => { order("reset"); }, null);
    this.reset.set("Reset", "the object");
    this.reset.root.title = "All forces fade, and the object begins anew";
    this.freeze.root.title = "The object takes nobody\u2019s force, until you let it";
    this.record = orderButton(() => { order(this.onRecord ? "end_recording" : "record"); }, null);
    this.record.root.title = "Everything that happens goes to a file of the server; everybody in the room is told";
    this.buttons = el("div", { class: "orders", attrs: { role: "group", "aria-label": "Orders about the object" } }, this.freeze.root, this.reset.root, this.record.root);
    this.root = el("div", { class: "room-orders" }, this.buttons, this.out);
  }

  write({ restraints, putOut, onRecord, info }: Pick<SceneStore, "restraints" | "putOut" | "onRecord" | "info">): void {
    const [admin, records] = [info?.room_admin === true, info?.can_record === true];
    this.list(admin ? putOut : []);
    [this.frozen, this.onRecord] = [restraints.frozen, onRecord];
    this.freeze.set(this.frozen ? "Unfreeze" : "Freeze", "the object");
    this.record.set(onRecord ? "End the recording" : "Record", "the session");
    show(this.freeze.root, admin);
    show(this.reset.root, admin);
    show(this.record.root, records);
    show(this.root, admin || records);
  }

  /** A button for each user who was put out; made anew only if the list has changed, so that a press does not miss its button. */
  private list(names: readonly string[]): void {
    show(this.out, names.length > 0);
    if (names.length === this.names.length && names.every((name, i) => name === this.names[i])) return;
    this.names = names;
    this.out.replaceChildren(...names.map((name) => {
      const back = orderButton(() => { this.order("unban", undefined, name); }, null);
      back.set("Let back in", name);
      back.root.title = "Put out or banned: with this it may come in again";
      return el("li", {}, el("span", { class: "fine", text: name }), back.root);
    }));
  }
}
