/** Names of visitors: 1 to 32 printable characters, as the protocol wants them. */

import type { TouchState } from "../model/hand";
import { keep, recall } from "../ui/theme";

const NAME = "cohaptic.name";

const FIRST = ["calm", "kind", "brisk", "quiet", "bold", "gentle", "bright", "steady"];
const SECOND = ["otter", "heron", "lynx", "finch", "badger", "hare", "wren", "seal"];

/** A name for somebody who did not choose one. */
export function freshName(random: () => number): string {
  const of = (list: readonly string[]): string => list[Math.floor(random() * list.length)] ?? "guest";
  return `${of(FIRST)} ${of(SECOND)}`;
}

// What nobody sees, which a server refuses or leaves out; `cohaptic/protocol/control/chosen_name.py`.
const UNSEEN = /\p{C}|\p{Zl}|\p{Zp}|\p{Default_Ignorable_Code_Point}|\u2800/u;

/** The text made a valid name; `otherwise` where nothing of it is printable. */
export function usableName(text: string, otherwise: string): string {
  const printable = Array.from(text.normalize("NFKC")).filter((c) => !UNSEEN.test(c)).join("");
  const tidy = Array.from(printable.replace(/\s+/gu, " ").trim()).slice(0, 32).join("").trim();
  return tidy === "" ? otherwise : tidy;
}

/** The visitor's name, that of the address or else what the browser remembers. */
export class VisitorName {
  name = usableName(new URLSearchParams(location.search).get("name") ?? recall(NAME) ?? "", freshName(Math.random));

  /** @returns The name that is used for what was typed. */
  choose(text: string): string {
    this.name = usableName(text, this.name);
    keep(NAME, this.name);
    return this.name;
  }

  /** The name that the room knows, where it did not give the one that was asked for; returns whether it is another one. */
  take({ name, name_refused }: Pick<TouchState, "name" | "name_refused">): boolean {
    if (name_refused === "" || name === this.name) return false;
    this.name = name;
    keep(NAME, name);
    return true;
  }
}
