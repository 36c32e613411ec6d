/** Feedback of the force without a force device: a gamepad's rumble, a phone's vibration. */

import { norm, type Vec3 } from "../model/vec";

const FULL = 6; // N at which the motors are at their strongest
const EVERY = 80; // ms between two commands; each runs a little longer

/** Strengths of a gamepad's two motors, 0 to 1: the heavy one for the force, the light one for its change. */
export function rumble(force: number, change: number): { strong: number; weak: number } {
  const strong = Math.min(1, Math.max(0, force / FULL));
  const weak = Math.min(1, Math.max(0, Math.abs(change) / 30));
  // A motor below a tenth only hums.
  return { strong: strong < 0.03 ? 0 : strong, weak: weak < 0.08 ? 0 : weak };
}

/** Times on and off within `EVERY`, because a phone's motor has only one strength [ms]. */
export function vibration(force: number): number[] {
  const share = Math.min(1, Math.max(0, force / FULL));
  const on = Math.round(share * EVERY);
  return on < 6 ? [] : [on, EVERY - on];
}

export class Rumble {
  private last = 0;
  private force = 0;
  private buzzing = false;

  /**
   * @param force Force on the hand [N]; zero without a hand.
   * @param now Time [ms].
   */
  feel(force: Vec3, now: number): void {
    if (now - this.last < EVERY) return;
    const f = norm(force);
    const change = (1000 * (f - this.force)) / Math.max(1, now - this.last);
    this.last = now;
    this.force = f;
    this.shake(f, change);
    const pattern = vibration(f);
    // Browsers refuse vibration before the first tap, and warn: there is one before every touch.
    if (navigator.userActivation.hasBeenActive && "vibrate" in navigator && matchMedia("(pointer: coarse)").matches) {
      if (pattern.length > 0) navigator.vibrate(pattern);
      else if (this.buzzing) navigator.vibrate(0);
      this.buzzing = pattern.length > 0;
    }
  }

  private shake(force: number, change: number): void {
    const { strong, weak } = rumble(force, change);
    if (strong === 0 && weak === 0) return;
    for (const pad of navigator.getGamepads()) {
      const effect = { duration: 1.5 * EVERY, strongMagnitude: strong, weakMagnitude: weak };
      // Not every gamepad has motors, and types promise one that old browsers lack.
      const actuator = pad?.vibrationActuator as GamepadHapticActuator | null | undefined;
      actuator?.playEffect("dual-rumble", effect).catch(() => undefined);
    }
  }
}
