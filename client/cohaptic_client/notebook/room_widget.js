/**
 * The front end of a view, by the contract of anywidget: the page of the server in a frame, a line about who presses, or
 * why there is no picture. All texts come from servers and are set as text, never as HTML.
 */

const REPLY = 4000; // ms until a kernel that does not answer is called busy
const SHOWN = 5000; // ms in which the page says that it is there

/**
 * What anywidget gives `render`.
 * @typedef {{ request: string, address: string }} Answer
 * @typedef {Record<string, [number, number, number]>} Forces
 * @typedef {object} Model
 * @property {(name: string) => any} get
 * @property {(message: object) => void} send
 * @property {(event: string, call: (content: any) => void) => void} on
 * @property {(event: string, call: (content: any) => void) => void} off
 */

/**
 * An element with its style and text.
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name
 * @returns {HTMLElementTagNameMap[Name]}
 */
function el(name, /** @type {string} */ style, text = "") {
  const made = document.createElement(name);
  made.style.cssText = style;
  made.textContent = text;
  return made;
}

/**
 * The force on each hand, in one line.
 * @param {Forces} forces
 */
function line(forces) {
  const parts = Object.entries(forces).map(([name, force]) => `${name} ${Math.hypot(...force).toFixed(2)} N`);
  return parts.length === 0 ? "nobody touches" : parts.join(", ");
}

/**
 * Why the page may not be seen, and what helps.
 * @param {string} address
 * @param {string} origin
 */
function reasons(address, origin) {
  const page = new URL(address);
  const insecure = page.protocol === "http:" && origin.startsWith("https:");
  return [
    `The page of ${page.origin} does not show here.`,
    /^https?:/.test(origin)
      ? `Its server has to allow this notebook, as a room of the notebook itself does: cohaptic serve --allow-frame ${origin}.`
      : `This notebook (${origin}) shows no pages of other servers, as VS Code does not.`,
    ...(insecure ? ["A notebook with https: shows pages with https: only."] : []),
    "And the browser has to reach the server: where it is on another machine, give page= its address from there.",
    "The forces below come by way of the kernel all the same.",
  ].join(" ");
}

/** @param {{ model: Model, el: HTMLElement }} parts */
function render({ model, el: host }) {
  const origin = location.origin;
  const height = `${model.get("height")}px`;
  const request = String(Math.random()); // the same view in another cell asks, too, and all hear every answer
  const box = el("div", "position:relative;overflow:hidden;border:1px solid #8886;border-radius:6px");
  const notice = el("div", "padding:12px 16px;line-height:1.5;overflow-wrap:anywhere");
  const foot = el("div", "padding:4px 2px;font-size:0.85em;overflow-wrap:anywhere");
  host.append(box, foot);
  /** @type {HTMLIFrameElement | null} */
  let frame = null;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;

  const say = (/** @type {string} */ words, address = "") => {
    notice.textContent = words;
    if (address !== "") {
      const link = el("a", "margin-left:0.5em;text-decoration:underline", "Open it in a tab");
      Object.assign(link, { href: address, target: "_blank", rel: "noopener" });
      notice.append(link);
    }
    if (!notice.isConnected) box.prepend(notice);
  };
  const wait = (/** @type {number} */ milliseconds, /** @type {() => void} */ then) => {
    clearTimeout(timer);
    timer = setTimeout(then, milliseconds);
  };
  const show = (/** @type {Answer} */ answer) => {
    if (answer.request !== request || !/^https?:/.test(answer.address)) return;
    const { address } = answer;
    frame?.remove();
    notice.remove();
    frame = el("iframe", "display:block;width:100%;border:0");
    frame.style.height = height;
    frame.title = "cohaptic";
    frame.allow = "fullscreen; gamepad; clipboard-write";
    frame.src = address;
    box.append(frame);
    // Until the page says that it is there, an empty frame may as well be a refused one.
    wait(SHOWN, () => {
      say(reasons(address, origin), address);
      if (frame !== null) frame.style.height = "0"; // it goes on loading
    });
  };
  const heard = (/** @type {MessageEvent<unknown>} */ { source, data }) => {
    if (frame === null || source !== frame.contentWindow || data !== "cohaptic") return;
    clearTimeout(timer);
    notice.remove();
    frame.style.height = height;
  };
  const told = () => { foot.textContent = `${line(model.get("forces"))} · ${model.get("status")}`; };

  addEventListener("message", heard);
  model.on("msg:custom", show);
  model.on("change:forces", told);
  model.on("change:status", told);
  told();
  wait(REPLY, () => { say("The kernel does not answer: the picture comes when its cell has ended. Without a kernel, run the cell again."); });
  model.send({ origin, request });

  return () => {
    clearTimeout(timer);
    removeEventListener("message", heard);
    model.off("msg:custom", show);
    model.off("change:forces", told);
    model.off("change:status", told);
  };
}

export default { render };
