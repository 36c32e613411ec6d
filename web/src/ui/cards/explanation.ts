/** Why the force of a user is as it is: what the server made of it, and of the own force each rule; for who opens Engineer. */

import type { TouchHandle } from "../../model/hand";
import type { UserState } from "../../model/scene";
import { el } from "../dom";
import { ForceLedger } from "./force_ledger";
import { TickNotes } from "./tick_ledger";

export class Explanation {
  private readonly notes = new TickNotes();
  private readonly ledger = new ForceLedger();
  readonly root = el("div", {}, this.notes.root, this.ledger.root);

  /** @param handle The visitor's hand, if its force is to be explained; otherwise null. */
  write(user: UserState | undefined, handle: TouchHandle | null): void {
    // The own ledger says what the own loop lacks, with reasons.
    this.notes.write(user === undefined || handle === null ? user : { ...user, rules: null });
    this.ledger.update(handle);
  }
}
