// Notes of a page's start, for page_start.py: runs before the page's own script, of which it knows
// no more than what is seen: what is drawn, and words. Times are since 1970 [s].

window.noted = { received: 0 };

const note = (name, at = performance.now()) => {
  noted[name] ??= (performance.timeOrigin + at) / 1000;
};

new PerformanceObserver((list) => {
  for (const { name, startTime } of list.getEntries()) {
    if (name === "first-contentful-paint") note("content", startTime);
  }
}).observe({ type: "paint", buffered: true });

// The first picture with as many triangles as only the object has: seen once the graphics made it.
const graphics = WebGL2RenderingContext.prototype;
const draw = graphics.drawElements;
graphics.drawElements = function (mode, count, ...rest) {
  draw.call(this, mode, count, ...rest);
  if (count < 6000 || graphics.drawElements === draw) return;
  graphics.drawElements = draw;
  const drawn = this.fenceSync(this.SYNC_GPU_COMMANDS_COMPLETE, 0);
  this.flush();
  const look = () => {
    const status = this.clientWaitSync(drawn, 0, 0);
    if (status === this.TIMEOUT_EXPIRED) setTimeout(look, 4);
    else note("seen");
  };
  setTimeout(look, 0);
};

const Socket = WebSocket;
window.WebSocket = class extends Socket {
  constructor(...given) {
    super(...given);
    this.addEventListener("message", ({ data }) => {
      noted.received += data.byteLength ?? data.length;
    });
  }
};

const read = () => {
  const words = (name) => document.querySelector(name)?.textContent ?? "";
  if (words(".dock-facts") === "in the air") note("engaged");
  if (parseFloat(words(".dock-force")) > 0) note("force");
};
addEventListener("DOMContentLoaded", () => {
  const all = { subtree: true, childList: true, characterData: true };
  new MutationObserver(read).observe(document.body, all);
});

// Middle of the button, and of what bar and dock leave free of the object's picture [px].
window.places = () => {
  const box = (name) => document.querySelector(name).getBoundingClientRect();
  const [button, stage, dock, bar] = [".touch-button", ".stage-canvas", ".dock", ".bar"].map(box);
  const middle = ({ x, y, width, height }) => [x + width / 2, y + height / 2];
  const [x, y] = middle(stage);
  return [middle(button), [x, y - (dock.height - bar.height) / 2]];
};

// Bytes that came: the page's files, and messages of the page's own socket.
window.bytes = () => {
  const files = ["navigation", "resource"].flatMap((type) => performance.getEntriesByType(type));
  return files.reduce((sum, file) => sum + file.transferSize, noted.received);
};

// When the frame after this one begins: the one before has been shown.
window.frame = () => new Promise((done) => {
  requestAnimationFrame(() => requestAnimationFrame((at) => {
    done((performance.timeOrigin + at) / 1000);
  }));
});
