/**
 * The predictive local model, science 3.3, with the integral that restores what its cap takes.
 *
 * The server sends the surface free of this client's own force; the client solves its own contact at the haptic rate.
 * Nothing of its own force comes back late, so alone it is exact at any delay.
 */

/** The integral is given up as the hand leaves: the force stays below this many times d / C_ii. */
export const RELEASE_SLOPE = 2;

/**
 * One period: force f = K (x_h - x_free) + integral.
 *
 * @param integral Force of the integral after the last period [N].
 * @param depth_free Of the probe below the surface free of its own force [m].
 * @param k_h Gain K_i [N/m]; exact at 1 / C_ii.
 * @param integral_gain I [N/(m s)]; 0 for none.
 * @param c_ii Compliance of the contact [m/N].
 * @param dt Time since the last period [s].
 * @returns Integral, and force on the hand along the outward normal [N].
 */
export function predictiveStep(
  integral: number,
  depth_free: number,
  k_h: number,
  integral_gain: number,
  c_ii: number,
  dt: number,
): [integral: number, force: number] {
  if (depth_free <= 0) return [0, 0];
  // x_h - x_o = depth - C_ii (K depth + integral); the integral's own part taken implicitly.
  const error = depth_free * (1 - c_ii * k_h);
  const gain = integral_gain * dt;
  const grown = (integral + gain * error) / (1 + gain * c_ii);
  const most = Math.max(0, (RELEASE_SLOPE / c_ii - k_h) * depth_free);
  const kept = Math.min(Math.max(grown, 0), most);
  return [kept, k_h * depth_free + kept];
}
