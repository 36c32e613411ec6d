/** The watcher's half of the protocol as a state machine without I/O. */

import type { RestMesh } from "../model/body";
import type { Encoding } from "../model/scene";
import { kindOf, ProtocolError } from "../protocol/frame";
import { Kind, PROTOCOL_VERSION } from "../protocol/layout";
import { decodeServerControl, encodeControl, type ServerControl, type Watching } from "../protocol/messages";
import { decodeRestMesh } from "../protocol/rest_mesh";
import { decodeScene, type Scene } from "../protocol/scene";
import { type Traversal, traversalOf } from "../protocol/traversal";

export type WatchEvent =
  | Watching
  | Extract<ServerControl, { type: "user_joined" | "user_left" | "restraints" | "recorded" | "moderated" | "put_out" | "latency" | "company" | "aimed" | "pointed" | "declined" | "error" }>
  | { readonly type: "rest_mesh"; readonly mesh: RestMesh }
  | { readonly type: "scene"; readonly scene: Scene };

type State = "await_watching" | "await_mesh" | "watching" | "closed";

const EVENTS = ["latency", "user_joined", "user_left", "restraints", "recorded", "moderated", "put_out", "company", "aimed", "pointed", "declined", "error"];
const ALLOWED: Readonly<Record<State, readonly string[]>> = {
  await_watching: ["watching", "error"],
  await_mesh: ["rest_mesh", ...EVENTS],
  watching: ["scene", ...EVENTS],
  closed: [],
};

const FOR_HANDS = ["welcome", "place", "called", "named"];

/** State of one connection to a server, for the page that watches. */
export class WatchSession {
  private state: State = "await_watching";
  private mesh: RestMesh = { vertices: new Float32Array(), faces: new Uint32Array() };
  private found: Traversal | null = null;
  private tick = 0;

  /** Whether the server has accepted this page but the resting mesh has not come yet. */
  get awaitsMesh(): boolean {
    return this.state === "await_mesh";
  }

  /** First message of the connection. */
  static greeting(encoding: Encoding, rate: number, token?: string): string {
    const more = token === undefined ? {} : { token };
    return encodeControl({ type: "watch", protocol: PROTOCOL_VERSION, encoding, rate, mesh: "quantised", company: true, ...more });
  }

  /** Take one message from the server; a ProtocolError, for a message that broke the protocol, ends the session. */
  receive(data: string | Uint8Array): WatchEvent {
    try {
      const event = this.decode(data);
      this.advance(event);
      return event;
    } catch (error) {
      this.state = "closed";
      throw error;
    }
  }

  private decode(data: string | Uint8Array): WatchEvent {
    if (typeof data === "string") {
      const message = decodeServerControl(data);
      if (FOR_HANDS.includes(message.type)) throw new ProtocolError("message", message.type, "watching, after a watch");
      this.check(message.type);
      return message as WatchEvent;
    }
    if (kindOf(data) === Kind.rest_mesh) {
      this.check("rest_mesh");
      return { type: "rest_mesh", mesh: decodeRestMesh(data) };
    }
    this.check("scene");
    return { type: "scene", scene: decodeScene(data, () => this.traversal()) };
  }

  /** Traversal of the resting mesh, computed with the first surface: on a fine mesh that takes as long as a few pictures. */
  private traversal(): Traversal {
    this.found ??= traversalOf(this.mesh.vertices.length / 3, this.mesh.faces);
    return this.found;
  }

  private check(type: string): void {
    const allowed = ALLOWED[this.state];
    if (!allowed.includes(type)) throw new ProtocolError("message", type, allowed.join(" or ") || "nothing more");
  }

  private advance(event: WatchEvent): void {
    if (event.type === "watching") this.state = "await_mesh";
    if (event.type === "error") this.state = "closed";
    if (event.type === "rest_mesh") {
      this.state = "watching";
      this.mesh = event.mesh;
    }
    if (event.type === "scene") {
      if (event.scene.tick <= this.tick) {
        throw new ProtocolError("tick of a scene", event.scene.tick, `more than the one before, ${this.tick}`);
      }
      this.tick = event.scene.tick;
    }
  }
}
