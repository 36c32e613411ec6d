/** Orders that an administrator may give about a room, or about somebody in it. */

export type UserOrder = "mute" | "unmute" | "kick" | "ban";
export type RoomOrder = "freeze" | "unfreeze" | "reset" | "record" | "end_recording";
/** Orders about a user who was put out, by name. */
export type NameOrder = "unban";
export type Order = UserOrder | RoomOrder | NameOrder;

/** Forces that an administrator keeps from the object now. */
export interface Restraints {
  /** Whether the object ignores all forces. */
  readonly frozen: boolean;
  /** Numbers of the users whose force the object ignores. */
  readonly muted: readonly number[];
}

export const NO_RESTRAINTS: Restraints = { frozen: false, muted: [] };
