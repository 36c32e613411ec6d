import { describe, expect, test } from "vitest";
import { type Brought, UploadClient, type UploadNews } from "../../src/upload/client";
import { CHUNK } from "../../src/upload/messages";
import { MESH, meshFrame } from "../watch/scenes";

const OFFER = { type: "upload_offer", kinds: [".stl"], max_bytes: 3 * CHUNK, max_memory: 1, max_seconds: 1 };
const EXAMINED = { type: "examined", findings: [], fix: "z < 5%", scale: 0.001, triangles: 12, middle: [0, 0, 0] };

/** The end of a socket that a server holds. */
class Line {
  binaryType = "";
  bufferedAmount = 0;
  closed = false;
  onmessage: ((event: { data: string | ArrayBuffer }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  readonly texts: unknown[] = [];
  readonly pieces: number[] = [];

  send(data: string | ArrayBuffer): void {
    if (typeof data === "string") this.texts.push(JSON.parse(data));
    else this.pieces.push(data.byteLength);
  }
  close(): void {
    this.closed = true;
  }
  say(message: object): void {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
}

function fileOf(name: string, size: number): Brought {
  return { name, size, slice: (from, to) => ({ arrayBuffer: () => Promise.resolve(new ArrayBuffer(Math.min(to, size) - from)) }) };
}

function begun(file: Brought): { line: Line; news: UploadNews[]; client: UploadClient; waits: (() => void)[] } {
  const line = new Line();
  const news: UploadNews[] = [];
  const waits: (() => void)[] = [];
  const world = { later: (_: number, action: () => void) => { waits.push(action); }, socket: () => line as unknown as WebSocket };
  const client = new UploadClient(file, world, (n) => { news.push(n); });
  return { line, news, client, waits };
}

const settle = async (): Promise<void> => {
  for (let i = 0; i < 50; i++) await Promise.resolve();
};

test("a file goes out in pieces, and its object comes back", async () => {
  const { line, news, client } = begun(fileOf("a.STL", 2.5 * CHUNK));
  line.say(OFFER);
  await settle();
  expect(line.texts).toEqual([{ type: "begin_upload", name: "a.STL", size: 2.5 * CHUNK }]);
  expect(line.pieces).toEqual([CHUNK, CHUNK, CHUNK / 2]);
  expect(news.at(-1)).toEqual({ type: "looking" });
  line.say(EXAMINED);
  line.onmessage?.({ data: meshFrame(MESH).slice().buffer });
  expect(news.at(-1)?.type).toBe("shown");
  client.prepare({ rule: "z < 1%", scale: 0.001, young: 6e3 });
  line.say({ type: "refused", about: "held", message: "it holds nothing", tries: 7 });
  expect(news.at(-1)).toEqual({ type: "refused", about: "held", why: "it holds nothing", tries: 7 });
  expect(line.closed).toBe(false);
  client.prepare({ rule: "z < 5%", scale: 0.01, young: 6e3 });
  expect(line.texts.at(-1)).toEqual({ type: "prepare_object", fix: "z < 5%", scale: 0.01, young: 6e3, poisson: 0.45 });
  line.say({ type: "progress", phase: "factoring", share: 0.5 });
  line.say({ type: "prepared", command: "serve" });
  expect(news.at(-1)).toEqual({ type: "done", command: "serve" });
  expect(line.closed).toBe(true);
});

test("no more than a little waits in the browser", async () => {
  const { line, waits } = begun(fileOf("a.stl", 3 * CHUNK));
  line.bufferedAmount = 100 * CHUNK;
  line.say(OFFER);
  await settle();
  expect(line.pieces).toEqual([]);
  line.bufferedAmount = 0;
  waits[0]?.();
  await settle();
  expect(line.pieces.length).toBe(3);
});

test.each(["scan.nii.gz", "A.b.NII.GZ", "x.stl"])("%s is of a kind that is offered", async (name) => {
  const { line, news } = begun(fileOf(name, 5));
  line.say({ ...OFFER, kinds: [".stl", ".nii", ".nii.gz"] });
  await settle();
  expect(line.texts).toEqual([{ type: "begin_upload", name, size: 5 }]);
  expect(news.at(-1)).toEqual({ type: "looking" });
});

describe("it fails in one sentence", () => {
  test.each([
    ["another kind", "a.exe", CHUNK, "files of this kind are not read; these are: .stl"],
    ["a kind that only begins alike", "a.stl.gz", CHUNK, "files of this kind are not read"],
    ["no kind", "stl", CHUNK, "files of this kind are not read"],
    ["too large", "a.stl", 4 * CHUNK, "a.stl has 0.1 MiB; it must be"],
    ["empty", "a.stl", 0, "a.stl has 0.0 MiB; it must be"],
  ])("%s", (_, name, size, why) => {
    const { line, news } = begun(fileOf(name, size));
    line.say(OFFER);
    expect(news).toEqual([{ type: "failed", why: expect.stringContaining(why) as string }]);
    expect(line.texts).toEqual([]);
  });

  test("the server's", () => {
    const { line, news } = begun(fileOf("a.stl", 5));
    line.say({ type: "error", code: 4422, field: "", message: "it is open" });
    line.onclose?.({ code: 4422, reason: "it is open" });
    expect(news).toEqual([{ type: "failed", why: "it is open" }]);
  });

  test("a connection that is lost", () => {
    const { line, news } = begun(fileOf("a.stl", 5));
    line.onclose?.({ code: 1006, reason: "" });
    expect(news).toEqual([{ type: "failed", why: "the server does not take this file from here" }]);
  });

  test("a mesh before its findings, and bytes that are none", () => {
    const first = begun(fileOf("a.stl", 5));
    first.line.onmessage?.({ data: meshFrame(MESH).slice().buffer });
    expect(first.news.at(-1)?.type).toBe("failed");
    const second = begun(fileOf("a.stl", 5));
    second.line.say(EXAMINED);
    second.line.onmessage?.({ data: new ArrayBuffer(40) });
    expect(second.news.at(-1)?.type).toBe("failed");
  });
});

test("after it is cancelled nothing is told", async () => {
  const { line, news, client } = begun(fileOf("a.stl", 2 * CHUNK));
  client.cancel();
  line.say(OFFER);
  line.onclose?.({ code: 1000, reason: "" });
  await settle();
  expect(news).toEqual([]);
  expect(line.closed).toBe(true);
});
