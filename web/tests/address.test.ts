import { expect, test } from "vitest";
import { greenUrl, socketUrl } from "../src/address";

test("a page finds its server under its own path", () => {
  expect(socketUrl("https://lab.example/touch/index.html?a#b")).toBe("wss://lab.example/touch/");
  expect(socketUrl("ws://127.0.0.1:8765")).toBe("ws://127.0.0.1:8765/");
  expect(greenUrl("wss://lab.example/touch/", "ab", [7, 2])).toBe("https://lab.example/touch/v1/models/ab/green/7,2");
});
