/**
 * One upload at one server: the exchange of messages, over a socket that is an argument.
 *
 * The file goes out in pieces, a few at a time, so that the progress on the page is what has really been sent.
 */

import type { RestMesh } from "../model/body";
import { ABNORMAL, NORMAL } from "../protocol/close_codes";
import { ProtocolError } from "../protocol/frame";
import { decodeRestMesh } from "../protocol/rest_mesh";
import { type About, CHUNK, decodeUploadAnswer, encodeUploadRequest, type Examined, type UploadAnswer } from "./messages";

/** News of an upload for the visitor. */
export type UploadNews =
  | { readonly type: "sending"; readonly share: number }
  | { readonly type: "looking" }
  | { readonly type: "shown"; readonly examined: Examined; readonly mesh: RestMesh }
  | { readonly type: "preparing"; readonly phase: string; readonly share: number }
  | { readonly type: "refused"; readonly about: About; readonly why: string; readonly tries: number }
  | { readonly type: "done"; readonly command: string }
  | { readonly type: "failed"; readonly why: string };

/** Choices of the visitor. */
export interface Wish {
  /** Rule for the held part; its lengths are in metres after scaling. */
  readonly rule: string;
  /** Metres in one unit of the file. */
  readonly scale: number;
  /** Young's modulus [Pa]; null for one with which a press is felt, which the server chooses. */
  readonly young: number | null;
}

/** The fields of a File that are used. */
export interface Brought {
  readonly name: string;
  readonly size: number;
  slice(from: number, to: number): { arrayBuffer(): Promise<ArrayBuffer> };
}

const AHEAD = 8 * CHUNK; // bytes that may wait in the browser
const PAUSE = 0.02; // s until the next check whether they have been sent

/** The services of the browser. */
export interface World {
  /** Calls `action` after a while [s]. */
  later(seconds: number, action: () => void): void;
  socket(): WebSocket;
}

export class UploadClient {
  private readonly socket: WebSocket;
  private examined: Examined | null = null;
  private over = false;

  constructor(
    private readonly file: Brought,
    private readonly world: World,
    private readonly tell: (news: UploadNews) => void,
  ) {
    const socket = world.socket();
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      this.hear(data);
    };
    socket.onclose = ({ code, reason }) => {
      this.end({ type: "failed", why: reason || (code === ABNORMAL ? "the server does not take this file from here" : `closed with ${code}`) });
    };
  }

  prepare({ rule, scale, young }: Wish): void {
    if (this.over) return;
    this.socket.send(encodeUploadRequest({ type: "prepare_object", fix: rule, scale, young, poisson: 0.45 }));
    this.tell({ type: "preparing", phase: "starting", share: 0 });
  }

  /** Cancel: no news is reported any more, and the server ends its work. */
  cancel(): void {
    this.over = true;
    this.socket.close(NORMAL);
  }

  private hear(data: string | ArrayBuffer): void {
    if (this.over) return;
    try {
      if (typeof data === "string") {
        this.answer(decodeUploadAnswer(data));
      } else if (this.examined === null) {
        throw new ProtocolError("message", "bytes", "what is in the file, first");
      } else {
        this.tell({ type: "shown", examined: this.examined, mesh: decodeRestMesh(new Uint8Array(data)) });
      }
    } catch (error) {
      if (!(error instanceof ProtocolError)) throw error;
      this.end({ type: "failed", why: `the server broke the protocol: ${error.message}` });
    }
  }

  private answer(answer: UploadAnswer): void {
    switch (answer.type) {
      case "upload_offer":
        this.begin(answer.kinds, answer.max_bytes);
        break;
      case "examined":
        this.examined = answer;
        break;
      case "progress":
        this.tell({ type: "preparing", phase: answer.phase, share: answer.share });
        break;
      case "refused":
        this.tell({ type: "refused", about: answer.about, why: answer.message, tries: answer.tries });
        break;
      case "prepared":
        this.end({ type: "done", command: answer.command });
        break;
      case "error":
        this.end({ type: "failed", why: answer.message });
    }
  }

  private begin(kinds: readonly string[], most: number): void {
    const { name, size } = this.file;
    if (!kinds.some((kind) => name.toLowerCase().endsWith(kind))) {
      this.end({ type: "failed", why: `${name}: files of this kind are not read; these are: ${kinds.join(" ")}` });
    } else if (size > most || size === 0) {
      const mib = 2 ** 20;
      this.end({ type: "failed", why: `${name} has ${(size / mib).toFixed(1)} MiB; it must be more than nothing and at most ${most / mib} MiB` });
    } else {
      this.socket.send(encodeUploadRequest({ type: "begin_upload", name: name.slice(-200), size }));
      void this.send(0);
    }
  }

  private async send(from: number): Promise<void> {
    if (this.over) return;
    this.tell({ type: "sending", share: Math.max(0, from - this.socket.bufferedAmount) / this.file.size });
    if (this.socket.bufferedAmount > AHEAD) {
      this.world.later(PAUSE, () => { void this.send(from); });
      return;
    }
    if (from >= this.file.size) {
      this.tell({ type: "looking" });
      return;
    }
    let piece: ArrayBuffer;
    try {
      piece = await this.file.slice(from, from + CHUNK).arrayBuffer();
    } catch {
      this.end({ type: "failed", why: `${this.file.name} cannot be read any more` });
      return;
    }
    if (!this.isOver()) this.socket.send(piece);
    await this.send(from + CHUNK);
  }

  /** Whether the upload is over; a method, because the state may change during an `await`. */
  private isOver(): boolean {
    return this.over;
  }

  private end(news: UploadNews): void {
    if (this.over) return;
    this.over = true;
    this.socket.close(NORMAL);
    this.tell(news);
  }
}
