/** Colours as values: maps for the surface, one colour for each user. */

/** Red, green, blue, 0 to 1, in sRGB. */
export type Rgb = readonly [number, number, number];

/** Steps of a map, at even distances. */
export type ColourMap = readonly Rgb[];

export type Scheme = "light" | "dark";

/**
 * Colours of users, distinct from each other and from the blue and amber of the displacement, so that no hand looks like a
 * part of the field. The first eight are easy to tell apart; a ninth user needs the others. A room has sixteen places by default.
 */
export const USERS: Record<Scheme, readonly string[]> = {
  light: [
    "#0a7f52", "#b0278a", "#6b3fc0", "#b8263a", "#3d5900", "#00727a", "#6e3552", "#454b52",
    "#b469f0", "#d26987", "#003c00", "#4b0087", "#876978", "#5a0f00", "#699687", "#c42fe0",
  ],
  dark: [
    "#3fcf8e", "#f07cd0", "#b79cff", "#ff8088", "#a6d468", "#4fd0d8", "#d8a4bc", "#c3cbd3",
    "#009600", "#965ad2", "#e13c0f", "#d23c96", "#87ffd2", "#00a5a5", "#f0f000", "#96a500",
  ],
};
const EASY = 8;

/** Colours of the users: no two users who are here have the same colour while there are enough. */
export class UserColours {
  private readonly indices = new Map<number, number>();

  /** Set the users who are here; the colours of all others are free again. */
  present(users: readonly number[]): void {
    for (const user of this.indices.keys()) if (!users.includes(user)) this.indices.delete(user);
    for (const user of users) this.indexOf(user);
  }

  of(user: number, scheme: Scheme): string {
    return USERS[scheme][this.indexOf(user) % USERS[scheme].length] ?? "#888888";
  }

  /** Index of a user's colour: by its number, so that pages agree as far as they can; if that is taken, the lowest free one. */
  private indexOf(user: number): number {
    const known = this.indices.get(user);
    if (known !== undefined) return known;
    const taken = new Set(this.indices.values());
    let index = (((user - 1) % EASY) + EASY) % EASY;
    if (taken.has(index)) {
      index = 0;
      while (taken.has(index)) index++;
    }
    this.indices.set(user, index);
    return index;
  }
}

/** "#rrggbb" as three shares. */
export function parseHex(hex: string): Rgb {
  const n = Number.parseInt(hex.slice(1), 16);
  return [((n >> 16) & 255) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255];
}

/** Colours of the displacement: inward blue, at rest like porcelain, outward amber. */
export const DISPLACEMENT: Record<Scheme, ColourMap> = {
  light: spread(["#0d2f6e", "#1f62b0", "#78abd6", "#cdd3d4", "#ecb772", "#d97f22", "#94450a"]),
  dark: spread(["#7cc4ff", "#3d86cf", "#3f6285", "#70777d", "#9a7a50", "#d98f3e", "#ffc37a"]),
};

/** Colours from soft to stiff: cividis, which people with colour blindness read equally well. */
export const STIFFNESS: ColourMap = spread([
  "#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838",
]);

/** Colour of a surface of which nothing is known. */
export const PLAIN: Record<Scheme, Rgb> = { light: parseHex("#cdd3d4"), dark: parseHex("#70777d") };

/**
 * Colour of a value on a map.
 *
 * @param t 0 for the first colour, 1 for the last; values beyond get the colour of the nearer end.
 */
export function colourAt(map: ColourMap, t: number): Rgb {
  const x = Math.min(1, Math.max(0, Number.isFinite(t) ? t : 0)) * (map.length - 1);
  const i = Math.min(map.length - 2, Math.floor(x));
  const a = map[i] ?? [0, 0, 0];
  const b = map[i + 1] ?? a;
  const s = x - i;
  return [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])];
}

/** Convert an sRGB component to linear light, in which shading is computed. */
export function toLinear(c: number): number {
  return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
}

/** Perceived brightness of a colour, 0 to 1 (relative luminance of WCAG). */
export function luminance(c: Rgb): number {
  return 0.2126 * toLinear(c[0]) + 0.7152 * toLinear(c[1]) + 0.0722 * toLinear(c[2]);
}

/**
 * A map as a table of linear light, three numbers a step, for surfaces of thousands of vertices.
 *
 * @param steps Number of colours in the table.
 */
export function table(map: ColourMap, steps = 256): Float32Array {
  const out = new Float32Array(3 * steps);
  for (let i = 0; i < steps; i++) {
    const c = colourAt(map, i / (steps - 1));
    out.set(c.map(toLinear), 3 * i);
  }
  return out;
}

function spread(hex: readonly string[]): ColourMap {
  return hex.map(parseHex);
}
