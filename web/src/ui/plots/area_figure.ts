/** Fig. 8 as a drawing and in words. */

import type { UserState } from "../../model/scene";
import { periods, verdict, type Yardstick } from "./area_plot";

export { drawArea } from "./area_plot";

/** The figure in words. */
export function areaWords(users: readonly UserState[], simulationPeriod: number, lag: number, yardstick: Yardstick): string {
  const named = (place: string): string[] =>
    users.filter((user) => verdict(user, simulationPeriod, yardstick) === place).map((user) => user.name || `user ${user.user}`);
  const outside = named("outside");
  const own = named("own");
  const longest = Math.max(0, ...users.map((user) => periods(user.loop_delay, simulationPeriod)));
  const parts = [
    longest > 0
      ? `Outer line: no delay. Filled: the longest loop here, ${longest} ${longest === 1 ? "period" : "periods"} late.`
      : "The triangle of eq. (15), without delay.",
  ];
  if (outside.length > 0) {
    const so = lag > 0 ? "and kept from swinging by the room\u2019s lag" : "so bound to swing";
    parts.push(`Outside, ${so}: ${outside.join(", ")}.`);
  }
  if (own.length > 0) parts.push("A ring is the predictive law: no delay asks it for a smaller gain.");
  return parts.join(" ");
}
