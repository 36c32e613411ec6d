/** The paper's proportional local model, section 3, on the surface as the simulation returned it. */

/** Force of L(z) = K_h on the hand [N], from the depth below x_o [m]; stable alone iff k_h < k_o, eq. (8). */
export function proportionalForce(depth: number, k_h: number): number {
  return depth > 0 ? k_h * depth : 0;
}

/** Stiffness felt at the probe in steady state, K_h K_o / (K_h + K_o) by eq. (11) [N/m]. */
export function proportionalStiffness(k_h: number, c_ii: number): number {
  return k_h / (1 + k_h * c_ii);
}
