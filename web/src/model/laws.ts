/** The local control laws and surfaces that a hand can use. */

/** Laws in the order of their numbers in the protocol, which begin at 1. */
export const LAWS = ["proportional", "pi", "predictive"] as const;
export type LawName = (typeof LAWS)[number];
/** A law, or the rule of the paper for one hand, which is `proportional` with a gain of the page's own choice. */
export type LawChoice = LawName | "paper";
export const DEFAULT_LAW = "predictive" satisfies LawName;

const PROPERTIES: Readonly<Record<LawName, readonly [answersOwnDent: boolean, integrates: boolean]>> = {
  proportional: [true, false],
  pi: [true, true],
  predictive: [false, false],
};

/** Whether a law acts on the surface with the dent of its own force, which comes back a round trip late. */
export function answersOwnDent(law: LawName): boolean {
  return PROPERTIES[law][0];
}

/** Whether a law has an integral, which goes on while the hand rests. */
export function integrates(law: LawName): boolean {
  return PROPERTIES[law][1];
}

export type GeometryName = "plane" | "sphere" | "mesh";

/** Gains that a client asks for instead of the server's choice: experiments only. */
export interface FixedGains {
  /** K_h [N/m]. */
  readonly k_h: number;
  /** I [N/(m s)]. */
  readonly integral_gain: number;
}

/** K_h of the paper's rule as a share of K_o, inside K_h < K_o, eq. (8). */
export const PAPER = 0.98;
