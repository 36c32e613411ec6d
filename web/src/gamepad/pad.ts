/** A DualSense as the page's hand: the hand's target, and the effects that the pad gives. Pure apart from its link. */

import { along, norm, type Vec3 } from "../model/vec";
import { type Axes, axesOf, type Cursor, cursorAt, moved, placeOf, pullOf, RELEASED, type Room } from "./cursor";
import { CONTACT, felt, NOTHING_FELT } from "./feeling";
import type { PadLink } from "./link";
import { type Held, NOTHING_HELD, OFF } from "./reports";

export const GIVE_UP = 0.25; // s; after a longer silence the pad counts as gone
const STEP = 0.02; // s; a longer frame counts as this: a page that stood still could not hear the pad
const STALE = 0.1; // s; a report of the hand that is older counts as none
const OUTSIDE = 1.1; // times the body's radius: distance at which the tip starts, just off the body
const DEPTH = 0.6; // times the radius: way of the tip over the whole trigger
const REACH = 2; // times the radius: distance to which the sticks move the tip
const FULL = 6; // N that full resistance represents; nobody has measured it
const SILENT = "The gamepad has gone silent. See to its cable.";

/** The newest report of the hand, as far as the pad needs it. */
export interface Felt {
  /** Force on the hand [N]. */
  readonly force: Vec3;
  /** Time of the report, on the page's clock [s]. */
  readonly t: number;
  /** Whether the hand is in the room and the server is not silent. */
  readonly live: boolean;
  /** Reason why the hand's force is off; empty for none. */
  readonly fault: string;
}

export interface Sphere {
  readonly center: Vec3;
  readonly radius: number;
}

export class Pad {
  private readonly axes: Axes;
  private readonly room: Room;
  private cursor: Cursor;
  private held: Held = NOTHING_HELD;
  private feeling = NOTHING_FELT;
  private now: number | null = null;
  private silent = 0; // s of silence of the pad while the page ran
  private waits = true; // until the trigger is released

  /**
   * @param body Body around which the tip moves.
   * @param towards_eye Direction from the body's middle to the viewer.
   */
  constructor(private readonly link: PadLink, readonly body: Sphere, towards_eye: Vec3) {
    this.axes = axesOf(towards_eye);
    this.room = { depth: DEPTH * body.radius, reach: REACH * body.radius };
    this.cursor = cursorAt(-OUTSIDE * body.radius);
  }

  /** Reason why the pad cannot be used, in words; empty for none. */
  get trouble(): string {
    return this.link.trouble !== "" ? this.link.trouble : this.silent > GIVE_UP ? SILENT : "";
  }

  /** Position where the hand waits, off the body [m]. */
  get out(): Vec3 {
    return along(this.body.center, -OUTSIDE * this.body.radius, this.axes.inward);
  }

  /**
   * Move the tip on to time `now` [s], and have the pad give the effects for the hand's force.
   *
   * @param hand Newest report of the hand; null while it is not in the room.
   * @returns Target position of the hand [m].
   */
  step(now: number, hand: Felt | null): Vec3 {
    const passed = this.now === null ? 0 : Math.max(0, now - this.now);
    this.now = now;
    this.listen(passed);
    const live = hand !== null && hand.live && hand.fault === "" && now - hand.t < STALE;
    // A trigger that is held through a pause, a fault or a silence must not press by itself afterwards.
    if (!live || passed > GIVE_UP || this.trouble !== "") this.waits = true;
    else if (this.held.pull <= RELEASED) this.waits = false;
    const force = hand?.force ?? ([0, 0, 0] as const);
    const contact = norm(force) > CONTACT;
    this.cursor = moved(this.cursor, this.waits ? NOTHING_HELD : this.held, Math.min(passed, STEP), this.room, contact);
    if (live && this.trouble === "") {
      this.feeling = felt(this.feeling, force, pullOf(this.cursor, this.room), this.axes.inward, FULL, now);
      this.link.give(this.feeling.effects);
    } else {
      this.feeling = NOTHING_FELT;
      this.link.give(OFF);
    }
    const [x, y, z] = placeOf(this.cursor, this.axes);
    const { center } = this.body;
    return [center[0] + x, center[1] + y, center[2] + z];
  }

  /** The page goes to the background, where nobody watches the hand. */
  pause(): void {
    this.waits = true;
    this.feeling = NOTHING_FELT;
    this.link.still();
  }

  private listen(passed: number): void {
    const told = this.link.poll();
    if (told === null) {
      this.silent += Math.min(passed, STEP);
      return;
    }
    this.held = told;
    this.silent = 0;
  }
}
