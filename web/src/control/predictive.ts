/**
 * The predictive local model, science 3.3 and 3.8.
 *
 * The server sends the surface free of this client's own force; the client solves its own contact at the haptic rate.
 * Nothing of its own force comes back late, so alone it is exact at any delay. Its gain is the object's own stiffness,
 * 1 / C_ii, or the device's limit where that is less; there is no integral that makes up for that limit, since
 * such an integral generates energy (3.8).
 */

/** Force on the hand along the outward normal, f = K (x_h - x_free) [N], from the depth below x_free [m]. */
export function predictiveForce(depth_free: number, k_h: number): number {
  return depth_free > 0 ? k_h * depth_free : 0;
}
