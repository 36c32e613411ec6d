/** Makes elements without markup: text is inserted as text, style as classes. */

type Child = Node | string | null;

export interface Props {
  readonly class?: string;
  readonly id?: string;
  readonly text?: string;
  readonly title?: string;
  readonly attrs?: Readonly<Record<string, string>>;
  readonly on?: Readonly<Partial<Record<keyof HTMLElementEventMap, (event: Event) => void>>>;
}

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: readonly Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  if (props.class !== undefined) made.className = props.class;
  if (props.id !== undefined) made.id = props.id;
  if (props.text !== undefined) made.textContent = props.text;
  if (props.title !== undefined) made.title = props.title;
  for (const [name, value] of Object.entries(props.attrs ?? {})) made.setAttribute(name, value);
  for (const [name, listener] of Object.entries(props.on ?? {})) made.addEventListener(name, listener);
  made.append(...children.filter((child) => child !== null));
  return made;
}

/** Write text only if it differs; otherwise a live region would speak again, and the layout would be computed again. */
export function say(node: Element, text: string): void {
  if (node.textContent !== text) node.textContent = text;
}

/** Show or hide an element; the keyboard cannot reach a hidden element either. */
export function show(node: HTMLElement, visible: boolean): void {
  if (node.hidden === visible) node.hidden = !visible;
}

/** A quantity as books print it: an italic letter with its index. */
export function symbol(letter: string, index = ""): HTMLElement {
  const made = el("var", { text: letter });
  if (index !== "") made.append(el("sub", { text: index }));
  return made;
}

/** A button with a picture, a name for screen readers, and the key that does the same. */
export function iconButton(icon: SVGElement, name: string, key: string, press: () => void): HTMLButtonElement {
  const title = key === "" ? name : `${name} (${key})`;
  return el("button", { class: "icon-button", title, attrs: { type: "button", "aria-label": name }, on: { click: press } }, icon);
}

/** A choice of one of several: radio buttons that look like a switch. */
export interface Choice<T extends string> {
  readonly root: HTMLElement;
  /** Choose a value; null chooses none. */
  set(value: T | null): void;
  enable(value: T, enabled: boolean): void;
}

let groups = 0;

export function choice<T extends string>(
  label: string,
  options: readonly (readonly [T, string, string?])[],
  picked: (value: T) => void,
): Choice<T> {
  const name = `choice-${groups++}`;
  const inputs = new Map<T, HTMLInputElement>();
  const root = el("div", { class: "choice", attrs: { role: "radiogroup", "aria-label": label } });
  for (const [value, words, title] of options) {
    const input = el("input", { attrs: { type: "radio", name, value } });
    input.addEventListener("change", () => {
      if (input.checked) picked(value);
    });
    inputs.set(value, input);
    root.append(el("label", { class: "choice-option", ...(title === undefined ? {} : { title }) }, input, el("span", { text: words })));
  }
  return {
    root,
    set: (value) => {
      for (const [key, input] of inputs) input.checked = key === value;
    },
    enable: (value, enabled) => {
      const input = inputs.get(value);
      if (input !== undefined) input.disabled = !enabled;
    },
  };
}
