/** What an administrator may do to a room, or to somebody in it. */

export type UserOrder = "mute" | "unmute" | "kick" | "ban";
export type RoomOrder = "freeze" | "unfreeze" | "reset";
/** About one who was put out, by name. */
export type NameOrder = "unban";
export type Order = UserOrder | RoomOrder | NameOrder;

/** What an administrator keeps from the object now. */
export interface Restraints {
  /** Whether the object takes nobody's force. */
  readonly frozen: boolean;
  /** Numbers of the users whose force it does not take. */
  readonly muted: readonly number[];
}

export const NO_RESTRAINTS: Restraints = { frozen: false, muted: [] };
