import { describe, expect, test } from "vitest";
import { ProtocolError } from "../../src/protocol/frame";
import { type ClientControl, decodeServerControl, encodeControl } from "../../src/protocol/messages";
import { vectors } from "../vectors";

const written = vectors("control") as { name: string; text: string }[];
const fromClient = new Set(["hello", "hello with a token", "set_name", "set_law", "come", "bye", "watch", "watch with a token", "set_view", "set_latency", "moderate", "moderate a name", "watch with company", "present", "present without a hand", "follow", "follow nobody", "aim", "point", "mark"]);
const SENT: ClientControl[] = [
  {
    type: "hello",
    protocol: 6,
    name: "left",
    law: "predictive",
    max_stiffness: 1000,
    max_force: 10,
    damping_budget: 0,
    geometry: "plane",
    friction: false,
    fixed_gains: null,
  },
  {
    type: "hello", protocol: 6, name: "left", law: "predictive", max_stiffness: 1000, max_force: 10, damping_budget: 0,
    geometry: "plane", friction: false, fixed_gains: null, key: "0123456789abcdef", token: "eyJh.eyJz.c2ln",
  },
  { type: "watch", protocol: 6, encoding: "frames", rate: 30, mesh: "exact", token: "eyJh.eyJz.c2ln" },
  { type: "set_law", law: "pi", fixed_gains: null },
  { type: "set_name", name: "far left" },
  { type: "come" },
  { type: "bye" },
  { type: "watch", protocol: 6, encoding: "frames", rate: 30, mesh: "quantised" },
  { type: "set_view", encoding: "forces", rate: 60 },
  { type: "set_latency", user: 2, delay: 0.125, jitter: 0.03125, network: "wifi" },
  { type: "present", name: "left", user: 1, key: "0123456789abcdef", open: true },
  { type: "follow", user: 2 },
  { type: "aim", azimuth: -1.375, elevation: 0.25, distance: 5.5 },
  { type: "point", point: [0.0625, 0, -0.125] },
];

describe("golden vectors", () => {
  test.each(SENT)("we send $type", (message) => {
    const name = "token" in message ? `${message.type} with a token` : message.type;
    const text = written.find((vector) => vector.name === name)?.text ?? "";
    expect(JSON.parse(encodeControl(message))).toEqual(JSON.parse(text));
  });

  test.each(written.filter(({ name }) => !fromClient.has(name)))("we understand $name", ({ text }) => {
    const { body, ...said } = JSON.parse(text) as { body?: Record<string, unknown> };
    const known = { ...body };
    delete known.origin; // the page has no use for coordinates of a file
    expect(decodeServerControl(text)).toEqual(body === undefined ? said : { ...said, body: known });
  });
});

const joined = { type: "user_joined", user: 2, name: "right" };
const said = written.find(({ name }) => name === "welcome")?.text ?? "";
const meant = JSON.parse(said) as { body: object };
const welcome = (change: object): string => JSON.stringify({ ...meant, ...change });
const body = (change: object): string => welcome({ body: { ...meant.body, ...change } });

test.each([
  ["no JSON", "{", "JSON"],
  ["a view from nowhere", '{"type":"aimed","user":1,"azimuth":1e9,"elevation":0,"distance":4}', "azimuth is 1000000000; expected a number from -7 to 7"],
  ["a view from inside", '{"type":"aimed","user":1,"azimuth":0,"elevation":0,"distance":0}', "distance is 0"],
  ["a place far off", '{"type":"pointed","user":null,"name":"x","point":[0,0,1e9]}', "three numbers"],
  ["a follower that is none", '{"type":"company","watching":1,"open":[],"following":null,"followers":[3],"may_point":true}', "followers.0 is 3"],
  ["no object", "[1]", "a JSON object"],
  ["no type", "{}", "type is undefined; expected text"],
  ["an unknown type", '{"type":"hi"}', 'type of a control message is "hi"; expected welcome'],
  ["another type of a field", JSON.stringify({ ...joined, user: "2" }), 'user is "2"; expected a whole number'],
  ["a field too many", JSON.stringify({ ...joined, age: 3 }), 'field of user_joined is "age"'],
  ["too much", JSON.stringify({ ...joined, name: "x".repeat(70_000) }), "<= 65536 characters"],
  ["another version", said.replace('"protocol":6', '"protocol":2'), "protocol version is 2; expected 6"],
  ["a period that is none", welcome({ simulation_period: 0.004 }), "simulation_period is 0.004; expected a number from 0.005 to 0.1"],
  ["a period without end", welcome({ simulation_period: 0.2 }), "simulation_period is 0.2"],
  ["a session that is no token", welcome({ session: "a b" }), "session is \"not shown\"; expected a token"],
  ["a body far away", body({ center: [0, 0, 10.5] }), "center is "],
  ["a body without size", body({ radius: 0 }), "radius is 0; expected a number above 0, at most 10"],
  ["a finger without size", body({ contact_radius: 0 }), "contact_radius is 0"],
  ["a name that is a book", body({ name: "x".repeat(1025) }), "expected at most 1024 characters"],
])("%s is refused", (_, text, message) => {
  expect(() => decodeServerControl(text)).toThrow(ProtocolError);
  expect(() => decodeServerControl(text)).toThrow(message);
});

test("an error shows a stranger's text in one line, and shortened", () => {
  expect(new ProtocolError("name", "a\n\u202eb", "x").message).toBe('name is "a\\n?b"; expected x');
  expect(new ProtocolError("name", "y".repeat(200), "x").message.length).toBeLessThan(90);
});
