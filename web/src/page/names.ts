/** Names of visitors: 1 to 32 printable characters, as the protocol wants them. */

const FIRST = ["calm", "kind", "brisk", "quiet", "bold", "gentle", "bright", "steady"];
const SECOND = ["otter", "heron", "lynx", "finch", "badger", "hare", "wren", "seal"];

/** A name for somebody who did not choose one. */
export function freshName(random: () => number): string {
  const of = (list: readonly string[]): string => list[Math.floor(random() * list.length)] ?? "guest";
  return `${of(FIRST)} ${of(SECOND)}`;
}

/** The text made a valid name; `otherwise` where nothing of it is printable. */
export function usableName(text: string, otherwise: string): string {
  const printable = Array.from(text.normalize("NFC")).filter((c) => !/\p{C}|\p{Zl}|\p{Zp}/u.test(c)).join("");
  const tidy = Array.from(printable.replace(/\s+/gu, " ").trim()).slice(0, 32).join("").trim();
  return tidy === "" ? otherwise : tidy;
}
