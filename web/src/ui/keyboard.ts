/**
 * Keys of the page, as a table; the help has the words for each.
 *
 * A key counts as the sign that is printed on it, so that T is the T of a Dvorak or a French keyboard. A key with a letter
 * of another alphabet counts as the key of a Latin keyboard in the same place.
 */

export type KeyAction =
  | "left" | "right" | "up" | "down" | "closer" | "farther" | "reset" | "full" | "touch" | "press" | "deeper" | "shallower"
  | "tour" | "replay" | "delay" | "point" | "follow" | "theme" | "help" | "escape";

interface Shortcut {
  readonly keys: readonly string[];
  readonly action: KeyAction;
}

export const SHORTCUTS: readonly Shortcut[] = [
  { keys: ["ArrowLeft"], action: "left" },
  { keys: ["ArrowRight"], action: "right" },
  { keys: ["ArrowUp"], action: "up" },
  { keys: ["ArrowDown"], action: "down" },
  { keys: ["+", "="], action: "closer" },
  { keys: ["-", "_"], action: "farther" },
  { keys: ["r"], action: "reset" },
  { keys: ["f"], action: "full" },
  { keys: ["t"], action: "touch" },
  { keys: [" "], action: "press" },
  { keys: ["]", "."], action: "deeper" },
  { keys: ["[", ","], action: "shallower" },
  { keys: ["g"], action: "tour" },
  { keys: ["b"], action: "replay" },
  { keys: ["l"], action: "delay" },
  { keys: ["p"], action: "point" },
  { keys: ["v"], action: "follow" },
  { keys: ["d"], action: "theme" },
  { keys: ["?", "\u061f"], action: "help" },
  { keys: ["Escape"], action: "escape" },
];

/** The fields of an event that tell the key. */
export type Keystroke = Pick<KeyboardEvent, "key" | "code" | "ctrlKey" | "metaKey" | "altKey" | "getModifierState">;

/** Signs of a Latin keyboard for the keys where another alphabet has a letter. */
const SIGNS: Readonly<Record<string, string>> = { BracketLeft: "[", BracketRight: "]", Comma: ",", Period: ".", Minus: "-", Equal: "=", Space: " " };
const FOREIGN = /^(?!\p{Script=Latin})[\p{L}\p{M}]/u;
const UNTOLD = /^(Process|Unidentified)$/; // reported in place of a key that an input method keeps for itself
/** Signs that neither the page nor a browser uses: keyboards whose brackets need a third level have them in the brackets' place. */
const BESIDE = /^([^ -~]|Dead|[$^`])$/u;
const SIGN = /^[^\p{L}\s]$/u;

/** Name of a key in the table. */
export function keyOf(event: Pick<Keystroke, "key" | "code" | "getModifierState">): string {
  const { code } = event;
  // An input method may make full-width signs. Only these are normalised, as some single accents would become a space.
  const typed = /^[\u3000\uff01-\uff5e]$/.test(event.key) ? event.key.normalize("NFKC") : event.key;
  const key = typed.length === 1 ? typed.toLowerCase() : typed;
  if (SHORTCUTS.some(({ keys }) => keys.includes(key)) || event.getModifierState("AltGraph")) return key;
  if (FOREIGN.test(key) || UNTOLD.test(key)) return /^Key[A-Z]$/.test(code) ? code.slice(3).toLowerCase() : (SIGNS[code] ?? key);
  return code.startsWith("Bracket") && BESIDE.test(key) ? (SIGNS[code] ?? key) : key;
}

/** The action of a key; null where the key belongs to a field, a button or the browser. */
export function actionOf(event: Keystroke, target: { readonly tagName: string; readonly type?: string } | null): KeyAction | null {
  const key = keyOf(event);
  // A sign of the third level is a typed sign, though Windows reports Ctrl and Alt with it.
  const typed = event.getModifierState("AltGraph") && SIGN.test(key);
  if (event.metaKey || ((event.ctrlKey || event.altKey) && !typed)) return null;
  const shortcut = SHORTCUTS.find((s) => s.keys.includes(key));
  if (shortcut === undefined) return null;
  const tag = target?.tagName ?? "";
  if (tag === "INPUT" || tag === "TEXTAREA" || tag === "SELECT") {
    const typing = tag !== "INPUT" || target?.type === "text";
    const moves = shortcut.action === "press" || key.startsWith("Arrow");
    if (typing ? shortcut.action !== "escape" : moves) return null;
  }
  // Space on a button presses the button.
  if (tag === "BUTTON" && shortcut.action === "press") return null;
  return shortcut.action;
}
