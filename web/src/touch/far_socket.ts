/**
 * A connection to the server with an added delay, which a page may choose for itself.
 *
 * For the measurements and the laws of the hand the delay looks like a longer network: a message that is held counts as
 * not yet sent, or not yet received.
 */

import { DelayLine, type Message } from "./network/delay_line";

const OPEN = 1; // `readyState` of a socket

/** Functions to be called on the events of a connection. */
export interface Ends {
  readonly opened: () => void;
  readonly heard: (data: Message) => void;
  readonly lost: (code: number, reason: string) => void;
}

export class FarSocket {
  private readonly up = new DelayLine();
  private readonly down = new DelayLine();

  /** @param now Time on the loop's clock [s]. */
  constructor(private readonly socket: WebSocket, private readonly now: () => number, private readonly ends: Ends) {
    socket.binaryType = "arraybuffer";
    socket.onopen = ends.opened;
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      this.down.push(typeof data === "string" ? data : new Uint8Array(data), now());
      this.pass();
    };
    socket.onclose = ({ code, reason }) => {
      // Held texts may say why the connection closes; held patches are dropped, because they belong to a later time.
      for (const data of this.down.take(Infinity)) if (typeof data === "string") ends.heard(data);
      ends.lost(code, reason);
    };
  }

  /** Delay of later messages, each way [s]. */
  set delay(seconds: number) {
    this.up.delay = this.down.delay = seconds;
  }

  send(data: Message): void {
    this.up.push(data, this.now());
    this.sendDue(this.now()); // received messages are not passed on here: their handler may be the caller, and none may overtake another
  }

  /** Pass on the messages that are due. */
  pass(now = this.now()): void {
    this.sendDue(now);
    for (const data of this.down.take(now)) this.ends.heard(data);
  }

  private sendDue(now: number): void {
    for (const data of this.up.take(now)) {
      // A sample is dropped while the socket is busy: the next one comes a period later.
      if (typeof data === "string" || this.socket.bufferedAmount === 0) this.socket.send(data);
    }
  }

  /** Close at once, after sending all held messages and then the last ones. */
  close(code?: number, last: readonly Message[] = []): void {
    if (this.socket.readyState === OPEN) {
      for (const data of [...this.up.take(Infinity), ...last]) this.socket.send(data);
    }
    this.socket.close(code);
  }
}
