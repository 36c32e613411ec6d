/**
 * Softness by familiar names, from Young's modulus E.
 *
 * Jelly: gelatine of 2 %, continued from 3 % (G = 2.0 kPa) with the square of its share, and E = 3 G (Nguyen et al., Ultrasound
 * Med Biol 40, 2014). Liver: G = 1.8 kPa at rest (Palmeri et al. 2008). Silicone: of the softest castable kind, 70 kPa at full
 * stretch. Rubber: of hardness 30 Shore A, by Gent's relation (1958).
 */

export interface Material {
  readonly name: string;
  /** Young's modulus [Pa]. */
  readonly young: number;
}

export const MATERIALS: readonly Material[] = [
  { name: "jelly", young: 3e3 },
  { name: "liver", young: 6e3 },
  { name: "silicone", young: 7e4 },
  { name: "rubber", young: 1e6 },
];
const LOW = 1e3; // Pa
const HIGH = 3e6; // Pa
/** Last position of the slider; the first is 0. */
export const STEPS = 100;

/** Young's modulus at a position of the slider [Pa], with two digits. */
export function youngAt(position: number): number {
  const share = Math.min(1, Math.max(0, position / STEPS));
  return Number((LOW * (HIGH / LOW) ** share).toPrecision(2));
}

/** The position of the slider that is nearest to a Young's modulus [Pa]. */
export function positionOf(young: number): number {
  return Math.round((STEPS * Math.log(young / LOW)) / Math.log(HIGH / LOW));
}

/** The material with the nearest Young's modulus. */
export function likest(young: number): Material {
  const away = (m: Material): number => Math.abs(Math.log(m.young / young));
  return MATERIALS.reduce((best, m) => (away(m) < away(best) ? m : best));
}

/** Words such as "like liver, 6 kPa"; between two materials the words name both. */
export function softnessWords(young: number): string {
  const kilo = young / 1e3;
  const amount = kilo >= 1000 ? `${Number((kilo / 1000).toPrecision(2))} MPa` : `${Number(kilo.toPrecision(2))} kPa`;
  const { name, young: its } = likest(young);
  const ratio = young / its;
  const how = ratio > 1.25 ? "harder than" : ratio < 0.8 ? "softer than" : "like";
  return `${how} ${name}, ${amount}`;
}
