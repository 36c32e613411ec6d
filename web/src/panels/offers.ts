/** The column's offers while nobody else is here: a second window of this room, or a simulated partner beside the visitor. */

import { type RestMesh, sameMesh } from "../model/body";
import type { TouchHandle } from "../model/hand";
import { isLive } from "../model/scene";
import { sub, unit } from "../model/vec";
import { el, say, show } from "../ui/dom";
import { sentence } from "../ui/notice";
import { openWindow } from "../share/windows";
import type { PanelHost } from "../page/panels";
import type { Partner } from "../page/partner";

const ASIDE = 1.05; // rad round from the visitor: in sight, and with a stronger coupling on a full balloon than at a quarter turn
const MOST = 6; // places that are tried, because an object may be open on one side

export class Offers {
  private readonly words = el("p", { class: "fine", attrs: { role: "status" } });
  private readonly bring: HTMLButtonElement;
  private partner: Partner | null = null;
  private failed = "";
  /** Mesh of the object at the time when the partner came. */
  private met: RestMesh | null = null;

  /** @param root Element that holds the offers. */
  constructor(private readonly page: PanelHost, private readonly root: HTMLElement) {
    const button = (text: string, press: () => void): HTMLButtonElement =>
      el("button", { class: "button", text, attrs: { type: "button" }, on: { click: press } });
    this.bring = button("Bring a partner", () => { this.toggle(); });
    const second = button("Open a second window", () => { openWindow(page.settings, page.visitor.name); });
    root.append(el("div", { class: "beside" }, second, this.bring), this.words);
  }

  /** The partner's hand; null for none. */
  get hand(): TouchHandle | null {
    return this.partner?.handle ?? null;
  }

  frame(): void {
    this.partner?.frame();
  }

  update(): void {
    this.partner?.update();
    const { mesh } = this.page.store;
    if (this.hand !== null && this.met !== null && mesh !== null && !sameMesh(mesh, this.met)) {
      this.sendAway();
      this.failed = "the object is another one";
    }
    const { store: { info, roster }, view, own, tour, replay } = this.page;
    const mine = [own.state?.user, this.hand?.state?.user];
    const others = [...roster, ...(view?.users ?? [])].some(({ user }) => !mine.includes(user));
    if (others && this.partner !== null) this.partner.why = "";
    show(this.root, info !== null && (this.hand !== null || (!others && !tour.running && !replay.active)));
    show(this.bring, info?.can_touch !== false);
    say(this.bring, this.hand === null ? "Bring a partner" : "Send the partner away");
    const words = this.told();
    say(this.words, words);
    show(this.words, words !== "");
  }

  sendAway(): void {
    this.partner?.leave();
  }

  private told(): string {
    const { store, own } = this.page;
    const { hand } = this;
    if (hand === null) {
      const why = this.failed || (this.partner?.why ?? "");
      if (why !== "") return `No partner comes. ${sentence(why)}`;
      return own.handle === null ? "" : "Nobody else is here.";
    }
    if (hand.state?.phase === "joined") return "Your partner is simulated: a hand of this page, which presses and holds still.";
    if (!isLive(store.status)) return "The server is silent. Your partner comes once it answers.";
    return `A simulated partner is on its way. ${sentence(hand.state?.reason ?? "")}`.trim();
  }

  private toggle(): void {
    this.failed = "";
    if (this.hand !== null) {
      this.sendAway();
      this.update();
      return;
    }
    import("../page/partner").then(({ besides, Partner }) => {
      const { store: { info, mesh, roster }, own } = this.page;
      if (info === null || mesh === null) return;
      const partner = (this.partner ??= new Partner(this.page.settings.startTouch));
      const at = own.held?.point ?? own.state?.proxy;
      const visitor = at === undefined ? this.page.towardsEye() : sub(at, info.body.center);
      // Without height: a partner on the top would be beside every visitor.
      const level = unit([visitor[0], visitor[1], 0], [0, -1, 0]);
      const places = Array.from({ length: MOST }, (_, i) => besides(level, ASIDE * (i + 1)));
      const names = [this.page.visitor.name, ...roster.map(({ name }) => name)];
      this.met = mesh;
      if (!places.some((place) => partner.come(this.page.url, names, mesh, info, place))) partner.why = "it finds no place on this object";
      this.update();
    }, () => {
      this.failed = "that part of the page did not come from the server; try again";
      this.update();
    });
  }
}
