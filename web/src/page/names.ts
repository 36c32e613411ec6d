/** Names of visitors: 1 to 32 printable characters, as the protocol wants them. */

import type { TouchState } from "../model/hand";
import { keep, recall } from "../ui/theme";

const NAME = "cohaptic.name";

const FIRST = ["calm", "kind", "brisk", "quiet", "bold", "gentle", "bright", "steady"];
const SECOND = ["otter", "heron", "lynx", "finch", "badger", "hare", "wren", "seal"];

/** A random name for a visitor who did not choose one. */
export function freshName(random: () => number): string {
  const of = (list: readonly string[]): string => list[Math.floor(random() * list.length)] ?? "guest";
  return `${of(FIRST)} ${of(SECOND)}`;
}

// Invisible characters, which a server refuses or leaves out; `cohaptic/protocol/control/message.py`.
const UNSEEN = /\p{C}|\p{Zl}|\p{Zp}|\p{Default_Ignorable_Code_Point}|\u2800/u;

/** Make a text a valid name; `otherwise` if none of its characters is printable. */
export function usableName(text: string, otherwise: string): string {
  const printable = Array.from(text.normalize("NFKC")).filter((c) => !UNSEEN.test(c)).join("");
  const tidy = Array.from(printable.replace(/\s+/gu, " ").trim()).slice(0, 32).join("").trim();
  return tidy === "" ? otherwise : tidy;
}

/** The visitor's name: that of the address, or else the one that the browser remembers. */
export class VisitorName {
  name = usableName(new URLSearchParams(location.search).get("name") ?? recall(NAME) ?? "", freshName(Math.random));

  /** @returns The valid name that replaces the typed text. */
  choose(text: string): string {
    this.name = usableName(text, this.name);
    keep(NAME, this.name);
    return this.name;
  }

  /** Take the room's name for the visitor if it refused the one asked for. */
  take({ name, name_refused }: Pick<TouchState, "name" | "name_refused">): void {
    if (name_refused === "" || name === this.name) return;
    this.name = name;
    keep(NAME, name);
  }
}
