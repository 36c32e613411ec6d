/** Words on the campaign's rooms that resemble this one, with the table in which they are looked up. */

import campaign from "../../control/campaign_rooms.json";
import { type Foreign, type Neighbours, neighbours, reach, roomFacts, type RoomFacts, type Rule, sameRoom } from "../../control/neighbours";

export { roomFacts, sameRoom };

const WHOLE = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

/** Number of hands in the largest room. */
export const MOST_HANDS = campaign.outcomes.predictive.length;

const RULES: Readonly<Record<Rule, string>> = {
  predictive: "under the predictive law",
  pi: "under the integral law",
  proportional: "under the proportional law",
  alone: "under the paper\u2019s rule for one hand",
};

const FOREIGN: Readonly<Record<Foreign, string>> = {
  "too many": `its rooms have at most ${MOST_HANDS} hands`,
  "mixed laws": "in each of its rooms everybody has the same law",
  "own gains": "in its rooms nobody chooses gains",
  friction: "its fingers have no friction",
  "soft device": "its devices render the object\u2019s stiffness",
};

/** Words on the simulated rooms and the command that ran them. */
export const ENSEMBLE = [
  `${WHOLE.format(campaign.rooms)} random rooms, each run for ${campaign.seconds} s under each law.`,
  "One to eight hands of 0.05 to 0.5 kg, 1 to 10 N s/m and 100 to 1,000 N/m press 5 to 30 mm deep and hold, on linear objects of 50 to 800 N/m: half balloons, half soft slabs.",
  "20 to 100 ticks a second; links of 0 to 250 ms one way with up to 60 ms of jitter, in each room a random share of that; no loss, no friction.",
  "Devices damp up to 8 N s/m; under the predictive law every room was run with none too.",
  "Stable: no force still swings by more than 5 % of the largest in the last 2 s, or the swing dies out.",
  "None of them is this room: hands, object and places differ.",
].join(" ");

export const COMMAND = campaign.command;

const two = (hundredths: number): string => (hundredths / 100).toFixed(2);
const runs = (count: number, hands: number): string => `${WHOLE.format(count)} runs with ${hands === 1 ? "one hand" : `${hands} hands`}`;

/** Words on the outcomes of the rooms that resemble this one. */
export function neighbourWords(facts: RoomFacts | Foreign): string {
  if (typeof facts === "string") return `No neighbours: ${FOREIGN[facts]}.`;
  return wordsOf(facts, neighbours(campaign.outcomes, facts));
}

/** Words on the outcomes of the rooms that were found. */
export function wordsOf(facts: RoomFacts, found: Neighbours): string {
  const { delay, coupling, lag } = facts;
  const here = `loop ${delay} ms \u00b1 ${reach("delay", delay)}, coupling ${two(coupling)} \u00b1 ${two(reach("coupling", coupling))}, lag ${lag} ms \u00b1 ${reach("lag", lag)}`;
  const all = `${runs(found.rooms, facts.hands)} ${RULES[facts.rule]}`;
  if (found.like === 0) {
    const { nearest } = found;
    const next = nearest === null ? "" : ` The nearest has a loop of ${nearest.delay} ms, coupling ${two(nearest.coupling)} and a lag of ${nearest.lag} ms.`;
    return `No neighbours: none of the campaign\u2019s ${all} is like this room (${here}).${next}`;
  }
  return `${WHOLE.format(found.like)} of the campaign\u2019s ${all} ${found.like === 1 ? "is" : "are"} like this room (${here}). ${verdict(found)}`;
}

function verdict({ like, stable, swing, error }: Neighbours): string {
  if (stable < like) {
    const worst = ` The worst: a force that swings by ${WHOLE.format(swing)} % of the largest.`;
    return (stable === 0 ? (like === 1 ? "It was unstable." : `All ${WHOLE.format(like)} were unstable.`) : `${WHOLE.format(stable)} of ${WHOLE.format(like)} were stable.`) + worst;
  }
  const off = error === 0 ? "no steady force was off by 0.1 %" : `a steady force was ${(error / 10).toFixed(1)} % off`;
  return `${like === 1 ? "It was stable" : `All ${WHOLE.format(like)} were stable`}; the worst: ${off}.`;
}
