/** The haptic Worker: a thread of its own, so that drawing never holds the hand up. */

import { TouchClient } from "./client";
import { EvenClock } from "./clock";
import type { FromWorker, ToWorker } from "./worker_messages";

let client: TouchClient | null = null;

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.type !== "start") {
    client?.obey(data);
    return;
  }
  const ahead = performance.timeOrigin - data.time_origin; // ms
  const clock = new EvenClock(() => (performance.now() + ahead) / 1000);
  client = new TouchClient(data.settings, {
    now: () => clock.now(),
    later: (seconds, action) => {
      setTimeout(() => {
        clock.beat();
        action();
      }, 1000 * seconds);
    },
    socket: (url, protocol) => new WebSocket(url, protocol),
    post: (message: FromWorker) => {
      self.postMessage(message.type === "state" ? { ...message, clock_step: clock.step } : message);
    },
  });
};
