/** A DualSense as the page's hand: where the hand is to be, and what the pad lets it feel. Pure but for its link. */

import { along, norm, type Vec3 } from "../model/vec";
import { type Axes, axesOf, type Cursor, cursorAt, moved, placeOf, pullOf, RELEASED, type Room } from "./cursor";
import { CONTACT, felt, NOTHING_FELT } from "./feeling";
import type { PadLink } from "./link";
import { type Held, NOTHING_HELD, OFF } from "./reports";

export const GIVE_UP = 0.25; // s; of silence, after which the pad is gone
const STEP = 0.02; // s that count of a frame; a page that stood still heard nothing
const STALE = 0.1; // s; a word of the hand that is older has stopped
const OUTSIDE = 1.1; // of the body's radius, where the tip starts: just off the body
const DEPTH = 0.6; // of the radius, the way of the whole trigger
const REACH = 2; // of the radius, as far as the sticks move the tip
const FULL = 6; // N that full resistance stands for; nobody has measured it
const SILENT = "The gamepad has gone silent. See to its cable.";

/** The newest word of the hand. */
export interface Felt {
  /** On the hand [N]. */
  readonly force: Vec3;
  /** Of the word, on the page's clock [s]. */
  readonly t: number;
  /** Whether it is in the room, and the server speaks. */
  readonly live: boolean;
  /** Why its force is off; empty for no reason. */
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
  private silent = 0; // s that the pad has said nothing while the page ran
  private waits = true; // for the trigger to be let go of

  /**
   * @param body Round which the tip moves.
   * @param towards_eye From its middle to whoever looks.
   */
  constructor(private readonly link: PadLink, readonly body: Sphere, towards_eye: Vec3) {
    this.axes = axesOf(towards_eye);
    this.room = { depth: DEPTH * body.radius, reach: REACH * body.radius };
    this.cursor = cursorAt(-OUTSIDE * body.radius);
  }

  /** What keeps it from use, in words; empty for nothing. */
  get trouble(): string {
    return this.link.trouble !== "" ? this.link.trouble : this.silent > GIVE_UP ? SILENT : "";
  }

  /** Where the hand waits, off the body [m]. */
  get out(): Vec3 {
    return along(this.body.center, -OUTSIDE * this.body.radius, this.axes.inward);
  }

  /**
   * Move on to `now`, and have the pad do what is felt.
   *
   * @param hand Its newest word; null while it is not in the room.
   * @returns Where the hand is to be [m].
   */
  step(now: number, hand: Felt | null): Vec3 {
    const passed = this.now === null ? 0 : Math.max(0, now - this.now);
    this.now = now;
    this.listen(passed);
    const live = hand !== null && hand.live && hand.fault === "" && now - hand.t < STALE;
    // What is held through a pause, a fault or a silence must not press by itself after it.
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
