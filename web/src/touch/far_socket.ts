/**
 * A connection to the server, and as far away as is asked for: a page may delay itself without asking anybody.
 *
 * All that the hand measures and all that its laws use lies behind the delay, as behind a longer network: a message
 * that is held is not sent yet, or not heard yet.
 */

import { DelayLine, type Message } from "./network/delay_line";

const OPEN = 1; // of a socket

/** What becomes of a connection. */
export interface Ends {
  readonly opened: () => void;
  readonly heard: (data: Message) => void;
  readonly lost: (code: number, reason: string) => void;
}

export class FarSocket {
  private readonly up = new DelayLine();
  private readonly down = new DelayLine();

  /** @param now Of the clock of the loop [s]. */
  constructor(private readonly socket: WebSocket, private readonly now: () => number, private readonly ends: Ends) {
    socket.binaryType = "arraybuffer";
    socket.onopen = ends.opened;
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      this.down.push(typeof data === "string" ? data : new Uint8Array(data), now());
      this.pass();
    };
    socket.onclose = ({ code, reason }) => {
      // Why it closes may be on its way; the surface that is on its way belongs to a time to come.
      for (const data of this.down.take(Infinity)) if (typeof data === "string") ends.heard(data);
      ends.lost(code, reason);
    };
  }

  /** Each way, of later messages [s]. */
  set delay(seconds: number) {
    this.up.delay = this.down.delay = seconds;
  }

  send(data: Message): void {
    this.up.push(data, this.now());
    this.sendDue(this.now()); // and hears nothing: what is heard may be what sends, and nothing overtakes
  }

  /** Pass on what is due. */
  pass(now = this.now()): void {
    this.sendDue(now);
    for (const data of this.down.take(now)) this.ends.heard(data);
  }

  private sendDue(now: number): void {
    for (const data of this.up.take(now)) {
      // Newest wins: the next sample is one period away.
      if (typeof data === "string" || this.socket.bufferedAmount === 0) this.socket.send(data);
    }
  }

  /** At once; what is on its way goes out before, and then the last words. */
  close(code?: number, last: readonly Message[] = []): void {
    if (this.socket.readyState === OPEN) {
      for (const data of [...this.up.take(Infinity), ...last]) this.socket.send(data);
    }
    this.socket.close(code);
  }
}
