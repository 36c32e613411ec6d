import { describe, expect, test } from "vitest";
import { addressAt, addressesToShare, framesOf, frameWords, isOwn } from "../../src/share/addresses";

const nobody = (): Promise<string> => Promise.reject(new Error("asked"));

describe("the address that is shared", () => {
  test("is the page's own where it came over a network, without the visitor's own part", async () => {
    expect(await addressesToShare("https://lab.example/r/jelly/?view=engineer#token=secret", nobody)).toEqual(["https://lab.example/r/jelly/"]);
  });

  test("is none that means each machine itself: the server says others", async () => {
    const asked: string[] = [];
    const ask = (url: string): Promise<string> => {
      asked.push(url);
      return Promise.resolve('{"hosts": ["lab.example", "192.168.1.7", "[fd00::5]", "localhost", "127.0.0.1", 7, "a/b", "x@y"]}');
    };
    expect(await addressesToShare("http://localhost:8765/r/jelly/?x#token=secret", ask)).toEqual([
      "http://lab.example:8765/r/jelly/", "http://192.168.1.7:8765/r/jelly/", "http://[fd00::5]:8765/r/jelly/",
    ]);
    expect(asked).toEqual(["http://localhost:8765/r/jelly/v1/hosts"]);
  });

  test.each(['{"hosts": []}', "{}", "null", "[]", '{"hosts": "all"}'])("is none where the server says %s", async (answer) => {
    expect(await addressesToShare("http://127.0.0.1:8765/", () => Promise.resolve(answer))).toEqual([]);
  });

  test("knows this machine by its names", () => {
    expect(["localhost", "LOCALHOST", "127.0.0.1", "127.9.9.9", "[::1]"].map(isOwn)).toEqual([true, true, true, true, true]);
    expect(["192.168.1.7", "localhost.example", "[fd00::1]", "127.example"].map(isOwn)).toEqual([false, false, false, false]);
    expect(addressAt("http://127.0.0.1:1/a#b")).toBe("http://127.0.0.1:1/a");
  });
});

test("who may show the page in a frame is read from its policy", () => {
  expect(framesOf("default-src 'none'; frame-ancestors 'none'")).toEqual([]);
  expect(framesOf("")).toEqual([]);
  expect(framesOf("frame-ancestors https://a.example http://localhost:8000; base-uri 'none'")).toEqual(["https://a.example", "http://localhost:8000"]);
});

test("the words for a frame name the address and nothing else", () => {
  expect(frameWords("https://lab.example/r/liver/")).toContain('src="https://lab.example/r/liver/"');
  expect(frameWords('https://lab.example/?"><script>')).not.toContain('"><script>');
});
