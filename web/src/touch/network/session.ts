/** The touching client's half of the protocol as a state machine without I/O; `cohaptic_client/network/session.py`. */

import type { TouchSettings } from "../../model/hand";
import { ProtocolError } from "../../protocol/frame";
import { PROTOCOL_VERSION } from "../../protocol/layout";
import { decodeServerControl, encodeControl, type ServerControl } from "../../protocol/messages";
import { decodePatch, type Patch } from "../../protocol/patch";
import { LACKING } from "../loop/chain";
import { dampingLimit, type DeviceInfo } from "../loop/device";
import { HAPTIC_PERIOD } from "../loop/schedule";

export type TouchEvent =
  | Extract<ServerControl, { type: "place" | "called" | "welcome" | "named" | "user_joined" | "user_left" | "restraints" | "recorded" | "error" }>
  | { readonly type: "patch"; readonly patch: Patch };

type State = "await_welcome" | "joined" | "closed";

const ALLOWED: Readonly<Record<State, readonly string[]>> = {
  await_welcome: ["place", "called", "welcome", "named", "error"],
  joined: ["patch", "named", "user_joined", "user_left", "restraints", "recorded", "error"],
  closed: [],
};

/** State of one connection to a server, for the client that touches. */
export class TouchSession {
  /** Whether the room is full and the server keeps a place in its queue. */
  queued = false;
  /** Place in the queue and its length; null before the server tells it, and for a client that does not wait. */
  place: readonly [number, number] | null = null;
  private state: State = "await_welcome";

  /** First message of the connection. */
  static greeting(settings: TouchSettings, device: DeviceInfo): string {
    return encodeControl({
      type: "hello",
      protocol: PROTOCOL_VERSION,
      name: settings.name,
      law: settings.law,
      max_stiffness: device.max_stiffness,
      max_force: settings.max_force,
      damping_budget: settings.passivity ? dampingLimit(device, HAPTIC_PERIOD) : 0,
      geometry: settings.geometry,
      friction: settings.friction > 0,
      fixed_gains: null,
      ...(settings.key === undefined ? {} : { key: settings.key }),
      ...(settings.token === undefined ? {} : { token: settings.token }),
      ...(settings.wait === true ? { wait: true } : {}),
      rules: { added: [], lacking: LACKING },
    });
  }

  /** Take one message from the server; a ProtocolError, for a message that broke the protocol, ends the session. */
  receive(data: string | Uint8Array): TouchEvent {
    try {
      const event = decode(data);
      const allowed = ALLOWED[this.state];
      if (!allowed.includes(event.type)) {
        throw new ProtocolError("message", event.type, allowed.join(" or ") || "nothing more");
      }
      if (event.type === "place" || event.type === "called") this.queued = true;
      if (event.type === "place") this.place = [event.place, event.of];
      if (event.type === "welcome") {
        this.state = "joined";
        this.queued = false;
        this.place = null;
      }
      if (event.type === "error") this.state = "closed";
      return event as TouchEvent;
    } catch (error) {
      this.state = "closed";
      throw error;
    }
  }
}

function decode(data: string | Uint8Array): ServerControl | TouchEvent {
  return typeof data === "string" ? decodeServerControl(data) : { type: "patch", patch: decodePatch(data) };
}
