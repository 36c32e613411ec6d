/**
 * All that happens to a force in one period of the haptic loop, in order.
 *
 * `client/cohaptic_client/loop/chain.py` in TypeScript, with the same names; what each rule does and why stands there, and
 * in `model/rules.ts`, by which the page knows which of them it lacks. What they did in a period is in its ledger.
 */

import { RULE_NAMES, type RuleName } from "../../model/rules";
import type { Period } from "./period";
import { moveDepth, moveCompliance, moveGain, reserve, turnForce } from "./rules/contact";
import { addFriction, damp, runLaw } from "./rules/force";
import { giveToBody, keepAccount } from "./rules/given";
import { clampForce, fadeForce, findFault, limitRate } from "./rules/guard";
import { showSurface } from "./rules/surface";

export const CHAIN: readonly (readonly [name: RuleName, apply: (period: Period) => void])[] = [
  ["surface", showSurface],
  ["reserve", reserve],
  ["gain", moveGain],
  ["compliance", moveCompliance],
  ["turn", turnForce],
  ["depth", moveDepth],
  ["law", runLaw],
  ["damping", damp],
  ["friction", addFriction],
  ["fault", findFault],
  ["limit", clampForce],
  ["fade", fadeForce],
  ["rate", limitRate],
  ["account", keepAccount],
  ["body", giveToBody],
];

/** Rules of the Python client's chain that the page lacks, in their order. */
export const LACKING: readonly RuleName[] = RULE_NAMES.filter((name) => !CHAIN.some(([own]) => own === name));
