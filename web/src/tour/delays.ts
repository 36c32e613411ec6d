/** The delay that the tour wants on its hands, and which of them the server was asked for. */

export class Delays {
  private readonly asked = new Map<number, number>();

  /** @param wanted Each way [s]. */
  constructor(public wanted = 0) {}

  /**
   * What to ask for now, for hands that came later than the wish as well.
   *
   * @param hands Their numbers in the room; 0 for one that is not there yet.
   */
  due(hands: readonly number[]): readonly { readonly user: number; readonly delay: number }[] {
    const late = hands.filter((user) => user > 0 && (this.asked.get(user) ?? 0) !== this.wanted);
    for (const user of late) this.asked.set(user, this.wanted);
    return late.map((user) => ({ user, delay: this.wanted }));
  }
}
