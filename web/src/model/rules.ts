// Made by `make life` from the chain of the Python client and the words of its ledger.

/** Rules of the loop in their order, with what each does and why. */
export const RULES = {
  reach: "a tip that is nowhere, or jumps faster than a hand, is a broken sensor: the hand is let go",
  surface: "the shown surface moves from patch to patch all the time: one that comes in one step would step the force",
  models: "models of the others' hands answer at once, since late answers make energy; what the others want is held back",
  reserve: "parts of the budget are reserved first for what later rules change by themselves: a fade of the force, a change of law, the damping of a slow hand",
  gain: "the gain follows the object's stiffness slowly: a finger that slides from soft to stiff must not be kicked",
  compliance: "the compliance in all directions, which friction needs, follows the object's slowly; half of what is left of the budget is kept for friction",
  turn: "a surface that turns may turn the force with half of what is left: a turn is a change",
  depth: "the surface moves the force with the rest of the budget: 0.02 N in a millisecond is no jolt",
  law: "the law turns depth into force",
  damping: "energy that the network has made is taken out, no more than the device renders",
  friction: "friction is at most mu times the normal force",
  finite: "a law or a rule that gives a force that no spring can give has failed: the hand is let go",
  fault: "after a pause of the loop, with a hand that is too fast or a device that fails, the force is taken away on a smooth ramp",
  limit: "the force is at most the limit of the device or of its user",
  fade: "a hand is engaged out of the object only, over a second; while the server is silent its force fades, and it returns as slowly",
  rate: "the force changes no faster than a hand that taps makes it, and without the hand no faster than the budget",
  account: "the energy that the network makes is counted, to be damped out",
  body: "the body gets the law's force in the share that the hand was given, and the models move on by it",
  trust: "the energy that the contact returns beyond that of the hand is counted, and where it is too much, models lose their share: a liar could drive a hand by them",
} as const;
export type RuleName = keyof typeof RULES;
export const RULE_NAMES = ["reach", "surface", "models", "reserve", "gain", "compliance", "turn", "depth", "law", "damping", "friction", "finite", "fault", "limit", "fade", "rate", "account", "body", "trust"] as const;

/** Entries of a ledger in the order of the rules, with what they are; they are the whole force. */
export const ENTRIES = {
  surface: "the law's spring on the surface of the newest patches",
  models: "models of the other hands, which answer at once",
  gain: "the gain follows the object's stiffness slowly",
  depth: "the surface moves faster than the budget lets it move the force",
  law: "the law beyond its spring: integral, own dent, or the law before it",
  damping: "damping of energy that the network has made",
  friction: "friction",
  limit: "the largest force of this hand",
  fade: "a fade",
  rate: "the force changes no faster than its limit",
} as const;
export type EntryName = keyof typeof ENTRIES;

/** What the server's tick makes of the force that it has heard of, with what each entry is. */
export const TICK = {
  by_presence: "this user comes, leaves, is silent, has jumped or is out of reach",
  by_limit: "the largest force of contact and object",
  by_anticipation: "answers of the other hands that are still on their way",
  by_lag: "the room's lag",
  by_rate: "others' forces may not change so fast",
} as const;
