/** The haptic Worker: its own thread, so that drawing never holds the hand up. */

import { TouchClient } from "./client";
import type { FromWorker, ToWorker } from "./worker_messages";

let client: TouchClient | null = null;

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.type !== "start") {
    client?.obey(data);
    return;
  }
  const ahead = performance.timeOrigin - data.time_origin; // ms
  client = new TouchClient(data.settings, {
    now: () => (performance.now() + ahead) / 1000,
    later: (seconds, action) => {
      setTimeout(action, 1000 * seconds);
    },
    socket: (url, protocol) => new WebSocket(url, protocol),
    post: (message: FromWorker) => {
      self.postMessage(message);
    },
  });
};
