import { expect, test } from "vitest";
import { serveCommand, windowAddress } from "../../src/share/windows";

test("another window has a name and a session of its own, and nothing else of this one", () => {
  expect(windowAddress("http://localhost:8765/r/jelly/?view=engineer#x", "ann", 2, undefined)).toBe("http://localhost:8765/r/jelly/?name=ann+2");
  expect(windowAddress("http://localhost:8765/", "ann", 3, "a.b-c")).toBe("http://localhost:8765/?name=ann+3#token=a.b-c");
  const long = new URL(windowAddress("http://localhost:8765/", "\u{1f9a6}".repeat(32), 2, undefined)).searchParams.get("name") ?? "";
  expect(Array.from(long).length).toBe(32);
  expect(long.endsWith(" 2")).toBe(true);
});

test.each([
  ["http://localhost:8765/", false, "cohaptic serve --host 0.0.0.0 --open --insecure"],
  ["http://127.0.0.1:9000/", false, "cohaptic serve --host 0.0.0.0 --port 9000 --open --insecure"],
  ["http://localhost/", false, "cohaptic serve --host 0.0.0.0 --port 80 --open --insecure"],
  ["https://localhost:8765/", false, "cohaptic serve --host 0.0.0.0 --open --tls-cert cert.pem --tls-key key.pem"],
  // A token is not to be sent unencrypted.
  ["http://localhost:8765/", true, "cohaptic serve --host 0.0.0.0 --keys keys.json --tls-cert cert.pem --tls-key key.pem"],
  ["http://localhost:8765/r/jelly/", true, ""],
  ["http://localhost:8765/r/jelly/", false,
    "COHAPTIC_SERVER_HOST=0.0.0.0 COHAPTIC_SERVER_ACCESS__OPEN=true COHAPTIC_SERVER_ACCESS__INSECURE=true cohaptic serve --config rooms.toml"],
])("the command that lets other machines in, from %s (invited: %s)", (page, invited, command) => {
  expect(serveCommand(page, invited)).toBe(command);
});
