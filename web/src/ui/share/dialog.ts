/** The dialog with the address of this room, to read, photograph, copy or send it. */

import { addressesToShare, framesOf, frameWords } from "../../share/addresses";
import { openWindow, serveCommand, type Visit } from "../../share/windows";
import { el, say, show } from "../dom";
import { icon } from "../icons";
import { qrPicture } from "./qr";

const ASIDE = "Whoever opens it sees the object, and touches it with the first press.";
const NEEDS = "This room asks for an invitation: the address alone lets nobody in. Make links with: cohaptic invite";
const NONE = "Only this machine reaches this server.";
const PROXY = `${NONE} To let others in, put a proxy that encrypts before it.`;
const ANEW = `${NONE} To let others in, stop it with Ctrl-C in its terminal and start it with this, and with the other options that it had:`;
const THEN = "Then come back here for the address.";
const OPEN = `Whoever reaches this machine over its network may touch then, and nothing is encrypted. ${THEN} The how-to \u201cInvite people\u201d has links for chosen people alone.`;
const CLOSED = `Keys and certificate are files that you have. ${THEN}`;
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
  private readonly command = el("code", { class: "share-command", attrs: { tabindex: "0" } });
  private readonly commandCopied: HTMLButtonElement;
  private readonly anew: HTMLElement;
  private readonly then = el("p", { class: "fine" });

  /**
   * @param name Returns the visitor's name.
   */
  constructor(private readonly visit: Visit, name: () => string) {
    const press = (text: string, kind: string, act: () => void): HTMLButtonElement =>
      el("button", { class: `button ${kind}`, text, attrs: { type: "button" }, on: { click: act } });
    this.copied = press("Copy", "", () => { copy(this.copied, this.address.value, this.address); });
    this.commandCopied = press("Copy", "", () => { copy(this.commandCopied, this.command.textContent, this.command); });
    this.sent = press("Send\u2026", "primary", () => { this.send(); });
    this.others.addEventListener("change", () => { this.pick(this.others.value); });
    for (const field of [this.address, this.frameWords]) field.addEventListener("focus", () => { field.select(); });
    this.frame = el("div", { class: "share-frame" }, this.frameNote, this.frameWords);
    this.found = el("div", { class: "share-found" }, this.picture, this.others, this.address, el("div", {}, this.copied, " ", this.sent), this.frame);
    this.anew = el("div", { class: "share-found" }, this.command, this.commandCopied, this.then);
    this.root = el("dialog", { class: "dialog", attrs: { "aria-labelledby": "share-title" } },
      el("button", { class: "icon-button dialog-close", attrs: { type: "button", "aria-label": "Close" }, on: { click: () => { this.root.close(); } } }, icon("close")),
      el("h2", { id: "share-title", text: "Invite somebody" }), this.found, this.words, this.anew,
      el("div", { class: "beside" }, press("Open a second window", "", () => { openWindow(visit, name()); })));
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
    show(this.anew, false);
    show(this.frame, false);
    say(this.words, "");
    this.root.showModal();
    // The server sends this header with each answer, so the page requests itself and reads the header.
    fetch(this.visit.address).then((answer) => { this.offerFrame(framesOf(answer.headers.get("Content-Security-Policy") ?? "")); }, () => undefined);
    const ask = async (url: string): Promise<string> => {
      const answer = await fetch(url);
      if (!answer.ok) throw new Error(`${url}: ${answer.status}`);
      return answer.text();
    };
    addressesToShare(this.visit.address, ask).then((found) => { this.offer(found); }, () => { say(this.words, FAILED); });
  }

  private offer(found: readonly string[]): void {
    const [best] = found;
    if (best === undefined) {
      this.offerCommand();
      return;
    }
    this.others.replaceChildren(...found.map((address) => el("option", { text: new URL(address).host, attrs: { value: address } })));
    show(this.others, found.length > 1);
    // Only encrypted pages and pages of this machine get a clipboard, and only few browsers can send an address.
    show(this.copied, "clipboard" in navigator);
    show(this.sent, "share" in navigator);
    show(this.found, true);
    this.pick(best);
    say(this.words, this.visit.invited() ? NEEDS : ASIDE);
  }

  private offerCommand(): void {
    const command = serveCommand(this.visit.address, this.visit.invited());
    say(this.words, command === "" ? PROXY : ANEW);
    // Each word is an element, so that no line breaks within a word.
    this.command.replaceChildren(...command.split(" ").flatMap((word) => [el("span", { text: word }), " "]).slice(0, -1));
    say(this.commandCopied, "Copy");
    say(this.then, /insecure/i.test(command) ? OPEN : CLOSED);
    show(this.commandCopied, "clipboard" in navigator);
    show(this.anew, command !== "");
  }

  /** @param origins Origins of the pages that may show this page. */
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

  private send(): void {
    // A visitor who cancels has sent nothing, which is no error.
    navigator.share({ title: document.title, url: this.address.value }).catch(() => undefined);
  }
}

/** @param otherwise Element with the words, from which they can be copied by hand if the clipboard fails. */
function copy(button: HTMLButtonElement, words: string, otherwise: HTMLElement): void {
  navigator.clipboard.writeText(words).then(
    () => { say(button, "Copied"); },
    () => { otherwise.focus(); },
  );
}
