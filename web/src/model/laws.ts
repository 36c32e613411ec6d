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
