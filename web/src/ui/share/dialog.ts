/** The dialog with the address of this room: to be read, photographed, copied or sent. */

import { addressesToShare, framesOf, frameWords } from "../../share/addresses";
import { el, say, show } from "../dom";
import { icon } from "../icons";
import { qrPicture } from "./qr";

const ASIDE = "Whoever opens it sees the object, and touches it with the first press.";
const NEEDS = "This room asks for an invitation: the address alone lets nobody in. Make links with: cohaptic invite";
const NONE = "Only this machine reaches this server. To let others in, start it with --host 0.0.0.0 (cohaptic serve --help says with what else), or put a proxy before it.";
const FAILED = "The server did not say by which address others reach it. Its terminal does.";

export class ShareDialog {
  readonly root: HTMLDialogElement;
  private readonly picture = el("div", { class: "share-picture" });
  private readonly address = el("input", { class: "share-address", attrs: { type: "text", readonly: "", "aria-label": "Address of this room" } });
  private readonly others = el("select", { class: "share-others", attrs: { "aria-label": "Another address of this server" } });
  private readonly words = el("p", { class: "fine", attrs: { role: "status" } });
  private readonly copied: HTMLButtonElement;
  private readonly sent: HTMLButtonElement;
  private readonly frameNote = el("p", { class: "fine" });
  private readonly frameWords = el("input", { class: "share-frame-words", attrs: { type: "text", readonly: "", "aria-label": "Words for a page that shows this one in a frame" } });
  private readonly frame: HTMLElement;
  private readonly found: HTMLElement;

  /**
   * @param page Address of this page.
   * @param invited Whether who comes needs an invitation.
   */
  constructor(private readonly page: string, private readonly invited: () => boolean) {
    const press = (text: string, kind: string, act: () => void): HTMLButtonElement =>
      el("button", { class: `button ${kind}`, text, attrs: { type: "button" }, on: { click: act } });
    this.copied = press("Copy", "", () => { this.copy(); });
    this.sent = press("Send\u2026", "primary", () => { this.send(); });
    this.others.addEventListener("change", () => { this.pick(this.others.value); });
    for (const field of [this.address, this.frameWords]) field.addEventListener("focus", () => { field.select(); });
    this.frame = el("div", { class: "share-frame" }, this.frameNote, this.frameWords);
    this.found = el("div", { class: "share-found" }, this.picture, this.others, this.address, el("div", {}, this.copied, " ", this.sent), this.frame);
    this.root = el("dialog", { class: "dialog", attrs: { "aria-labelledby": "share-title" } },
      el("button", { class: "icon-button dialog-close", attrs: { type: "button", "aria-label": "Close" }, on: { click: () => { this.root.close(); } } }, icon("close")),
      el("h2", { id: "share-title", text: "Invite somebody" }), this.found, this.words);
    this.root.addEventListener("click", (event) => {
      if (event.target === this.root) this.root.close();
    });
  }

  toggle(): void {
    if (this.root.open) {
      this.root.close();
      return;
    }
    show(this.found, false);
    show(this.frame, false);
    say(this.words, "");
    this.root.showModal();
    // The server says it with each answer, to the browser; it is asked as a browser would be.
    fetch(this.page).then((answer) => { this.offerFrame(framesOf(answer.headers.get("Content-Security-Policy") ?? "")); }, () => undefined);
    const ask = async (url: string): Promise<string> => {
      const answer = await fetch(url);
      if (!answer.ok) throw new Error(`${url}: ${answer.status}`);
      return answer.text();
    };
    addressesToShare(this.page, ask).then((found) => { this.offer(found); }, () => { say(this.words, FAILED); });
  }

  private offer(found: readonly string[]): void {
    const [best] = found;
    if (best === undefined) {
      say(this.words, NONE);
      return;
    }
    this.others.replaceChildren(...found.map((address) => el("option", { text: new URL(address).host, attrs: { value: address } })));
    show(this.others, found.length > 1);
    // A clipboard is given only to pages that came encrypted, or of this machine; sending to few browsers.
    show(this.copied, "clipboard" in navigator);
    show(this.sent, "share" in navigator);
    show(this.found, true);
    this.pick(best);
    say(this.words, this.invited() ? NEEDS : ASIDE);
  }

  /** @param origins Of the pages that may show this one. */
  private offerFrame(origins: readonly string[]): void {
    show(this.frame, origins.length > 0);
    say(this.frameNote, `To show it in a page of ${origins.join(" or ")}, copy this into that page:`);
  }

  private pick(address: string): void {
    this.address.value = address;
    this.frameWords.value = frameWords(address);
    this.picture.replaceChildren(qrPicture(address));
    say(this.copied, "Copy");
  }

  private copy(): void {
    navigator.clipboard.writeText(this.address.value).then(
      () => { say(this.copied, "Copied"); },
      () => { this.address.focus(); }, // to be copied by hand
    );
  }

  private send(): void {
    // Who changes its mind has sent nothing.
    navigator.share({ title: document.title, url: this.address.value }).catch(() => undefined);
  }
}
