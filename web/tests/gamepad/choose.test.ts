import { expect, test } from "vitest";
import { choosePad } from "../../src/gamepad/choose";
import type { Hid, HidDevice } from "../../src/gamepad/webhid";
import { StandIn } from "./stand_in";

function hidOf(...devices: readonly HidDevice[]): Hid {
  return { requestDevice: () => Promise.resolve(devices), ondisconnect: null };
}

test("the chosen pad is opened", async () => {
  const pad = new StandIn();
  expect(await choosePad(hidOf(pad))).toBe(pad);
});

test.each<[string, () => Hid]>([
  ["setting of yours", () => ({ requestDevice: () => Promise.reject(new Error("SecurityError")), ondisconnect: null })],
  ["No gamepad was chosen", () => hidOf()],
  ["Mouse is no DualSense", () => hidOf(Object.assign(new StandIn(), { productId: 7, productName: "Mouse" }))],
  ["connected by Bluetooth", () => hidOf(Object.assign(new StandIn(), { collections: [{ inputReports: [{ reportId: 1 }, { reportId: 0x31 }] }] }))],
  ["cannot be opened", () => hidOf(Object.assign(new StandIn(), { opened: false, open: () => Promise.reject(new Error("NotAllowedError")) }))],
])("%s: it says what is wrong", async (words, hid) => {
  await expect(choosePad(hid())).rejects.toThrow(words);
});
