/** The tour: effects of delay on several hands at one object, shown on the live system. */

import { fixed } from "../ui/words";
import type { Facts, Step } from "./machine";
import { RESTS, SWINGS } from "./swing";

/** Lag of the room from which on the slow response of the object is visible [s]. */
export const SLOW = 0.07;
const DEPTH = 0.15; // of the guided press, in radii
export const OCEAN = 0.12; // s each way: a packet to the other side of the world

const alone = (facts: Facts): string | null =>
  facts.others > 0 || facts.coming ? null : "No partner could come in here and nobody else has a hand, so there is nobody to feel.";

/** Sentence on the effect of the paper's rule on these very hands; another sentence if there is no effect. */
export function ruleClaim({ rehearsed }: Facts): string {
  if (rehearsed === null) return "";
  const size = `${fixed(rehearsed.size, 2)} N`;
  if (rehearsed.size >= SWINGS && rehearsed.hz > 0) {
    return `Rehearsed with the stiffness, coupling and delay measured here: without the lag your force would swing by ${size}, ${fixed(rehearsed.hz, 1)} times a second.`;
  }
  return `Rehearsed with the stiffness, coupling and delay measured here, your force would not keep swinging (${size} are left): hands that couple so little would do without a lag.`;
}

/** Sentence on the time that the object takes; another sentence if it takes none. */
export function lagClaim({ lag, swing }: Facts): string {
  const seconds = `${fixed(lag, 2)} s`;
  if (lag > SLOW) return `The object takes its time: it answers the others in ${seconds} now.`;
  if (swing === null) return ""; // the force may still rise
  return lag > 0 ? `Here it does not take long: it answers the others in ${seconds}.` : "Here it does not: it answers the others at once.";
}

/** Sentence on the present own force; another sentence if the force is not at rest. */
export function restClaim({ swing }: Facts): string {
  if (swing === null) return "";
  const size = `${fixed(swing.size, 3)} N`;
  return swing.size <= RESTS
    ? `Your force in the last seconds: it moved by ${size}, less than a finger feels.`
    : `Your force moved by ${size} in the last seconds: it has not settled, or somebody moves. A delay alone does not make it swing.`;
}
const noGains = (facts: Facts): string | null =>
  facts.allowFixedGains ? alone(facts) : "This server does not let a page choose its own gain (--allow-fixed-gains), so the rule for one hand is left out.";

export const STEPS: readonly Step[] = [
  {
    id: "welcome",
    title: "One object, many hands",
    text: "A server somewhere owns this object. Every hand on it runs its own haptic loop, a thousand times a second, wherever "
      + "its owner is. What one presses, the others feel. Let us see what distance does to that.",
    actions: [{ kind: "look", at: "stage" }, { kind: "colour", by: "displacement" }],
  },
  {
    id: "press",
    title: "Press",
    text: "The page has lent you a hand that holds still, and presses for you. Blue went in, amber bulges out; the arrow is the force on your "
      + "hand. Take over at any time: hold the pointer on the object.",
    actions: [{ kind: "touch" }, { kind: "partner" }, { kind: "hold", grip: "firm" }, { kind: "law", law: "predictive" }, { kind: "press", depth: DEPTH }, { kind: "look", at: "hand" }],
    until: (facts) => facts.touching && facts.force > 0.3,
    waiting: "your hand feels a force",
  },
  {
    id: "feel",
    title: "Feel the others",
    text: "Part of that force is somebody else\u2019s. Where they press, the object bulges against your hand or gives way under it. "
      + "If nobody was here, your page has brought a simulated partner, who holds still.",
    claim: (facts) => `Of your ${fixed(facts.force, 2)} N, ${fixed(facts.fromOthers, 2)} N come from others.`,
    actions: [{ kind: "press", depth: DEPTH }, { kind: "look", at: "hand" }],
    until: (facts) => Math.abs(facts.fromOthers) > 0.03,
    waiting: "somebody else presses",
    without: alone,
  },
  {
    id: "sheet",
    title: "What your hand holds",
    text: "The server answers sixty times a second, your hand needs a thousand. So it presses on a small sheet of surface "
      + "that stands in for the object until the next answer comes. Everything that can go wrong goes wrong between two sheets.",
    actions: [{ kind: "look", at: "stage" }],
  },
  {
    id: "ocean",
    title: "Now put an ocean between",
    text: "Your page now holds each message of yours for 120 ms, and each answer; a partner that the tour has brought is as far away. Watch the delay of your loop rise, and the "
      + "force: it does not care. Your sheet is the surface free of your own force, so nothing that you do comes back late.",
    claim: restClaim,
    actions: [{ kind: "press", depth: DEPTH }, { kind: "delay", delay: OCEAN }, { kind: "look", at: "plots" }],
    until: (facts) => facts.loopDelay > 1.8 * OCEAN,
    waiting: "the server has measured the longer loop",
  },
  {
    id: "paper",
    title: "The rule for one hand",
    text: "Here is the classic way: press on the surface as it came back, with a gain just below the stiffness of the object, "
      + "K_h < K_o. For one hand that is stable at any delay. For several on one object it is not always: where it is not, the object "
      + "takes its time.",
    claim: lagClaim,
    actions: [{ kind: "law", law: "paper" }, { kind: "press", depth: DEPTH }, { kind: "measure", by: "alone" }, { kind: "look", at: "room" }],
    until: (facts) => facts.paper && facts.lag > SLOW,
    waiting: "the object takes its time",
    without: noGains,
  },
  {
    id: "coupled",
    title: "Why it has to",
    text: "The rule looks at your contact alone. The figure now counts everybody\u2019s hands: you press, they are pushed, they push "
      + "back, and it all arrives late. The more they are coupled, the less gain is stable. Where the rule gives too much, a lag in the "
      + "object keeps the forces from swinging, and everybody has to wait for it. The dashed line rehearses your hands without it.",
    actions: [{ kind: "measure", by: "coupled" }, { kind: "rehearse" }, { kind: "look", at: "area" }],
    until: (facts) => facts.rehearsed !== null,
    waiting: "your hands were measured",
    claim: ruleClaim,
    without: noGains,
  },
  {
    id: "soft",
    title: "Safe, and soft",
    text: "The classic way can be made safe by its gain alone: the server takes everybody\u2019s coupling into account and gives you a "
      + "smaller one. But the object feels softer than it is, and most of what the others do is lost.",
    actions: [{ kind: "law", law: "proportional" }, { kind: "press", depth: DEPTH }, { kind: "look", at: "plots" }],
    until: (facts) => facts.law === "proportional" && !facts.paper && facts.force > 0.3,
    waiting: "the classic law runs",
  },
  {
    id: "ours",
    title: "Neither soft nor slow",
    text: "The predictive law again: your hand has the object\u2019s own stiffness, at once and at any delay. Once everybody holds still, "
      + "the force is what hands on one object feel who are in the same room. Only where hands are coupled strongly does what the "
      + "others do arrive a little later.",
    actions: [{ kind: "law", law: "predictive" }, { kind: "press", depth: DEPTH }, { kind: "look", at: "hand" }],
    until: (facts) => facts.law === "predictive" && facts.force > 0.3 && facts.swing !== null,
    waiting: "your force has had time to settle",
    claim: restClaim,
  },
  {
    id: "yours",
    title: "It is yours now",
    text: "The delay is as it was. Press, slide, change the law, colour the object by its stiffness, "
      + "or send somebody the address of this page and feel them.",
    actions: [{ kind: "lift" }, { kind: "hold", grip: "natural" }, { kind: "delay", delay: 0 }, { kind: "measure", by: "coupled" }, { kind: "look", at: "stage" }],
  },
];
