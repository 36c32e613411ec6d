/** The local control laws and surfaces that a hand can use. */

export type LawName = "proportional" | "pi" | "predictive";

export type GeometryName = "plane" | "sphere" | "mesh";

/** Gains that a client asks for instead of the server's choice: experiments only. */
export interface FixedGains {
  /** K_h [N/m]. */
  readonly k_h: number;
  /** I [N/(m s)]. */
  readonly integral_gain: number;
}

/** Share of K_o that the paper's rule is run with, inside K_h < K_o, eq. (8). */
export const PAPER = 0.98;
