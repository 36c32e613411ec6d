/** Scales: from numbers to pixels, the numbers at an axis, and the size at which a force is shown. */

export interface Range {
  readonly low: number;
  readonly high: number;
}

/** Largest force that the page renders [N]: it fills a bar and gives arrow and ring their largest size. */
export const FULL_FORCE = 10;

/** Share of `FULL_FORCE`, 0 to 1. All sizes that show a force use it, so that all hands can be compared. */
export function forceShare(force: number): number {
  return Math.min(1, Math.max(0, force) / FULL_FORCE);
}

/** Map from a range of values to a range of pixels; a range of values without width maps to the middle. */
export function linear(from: Range, to: Range): (x: number) => number {
  const width = from.high - from.low;
  if (!(width > 0)) return () => 0.5 * (to.low + to.high);
  const slope = (to.high - to.low) / width;
  return (x) => to.low + slope * (x - from.low);
}

/** 1, 2 or 5 times a power of ten, not below `x`. */
export function niceStep(x: number): number {
  if (!(x > 0) || !Number.isFinite(x)) return 1;
  const power = 10 ** Math.floor(Math.log10(x));
  const share = x / power;
  const nice = share <= 1 + 1e-9 ? 1 : share <= 2 + 1e-9 ? 2 : share <= 5 + 1e-9 ? 5 : 10;
  return nice * power;
}

/** Round numbers inside a range, at most about `count`. */
export function ticks(range: Range, count = 4): number[] {
  const step = niceStep((range.high - range.low) / Math.max(1, count));
  const first = Math.ceil(range.low / step - 1e-9);
  const last = Math.floor(range.high / step + 1e-9);
  const out: number[] = [];
  for (let i = first; i <= last && out.length < 50; i++) out.push(i * step + 0); // no minus zero
  return out;
}

/** Number of digits behind the point that a step needs. */
export function digits(step: number): number {
  return Math.min(6, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}

/**
 * A range that follows data without jitter: it grows at once to a round number and shrinks only when
 * half of it is empty.
 *
 * @param least Least width of the range, however small the data are.
 */
export function follow(before: Range | null, data: Range, least: number): Range {
  const width = Math.max(least, data.high - data.low);
  const step = niceStep(width / 4);
  const fitted: Range = {
    low: Math.floor(data.low / step + 1e-9) * step,
    high: Math.ceil(data.high / step - 1e-9) * step,
  };
  if (fitted.high - fitted.low < least) {
    const middle = 0.5 * (fitted.low + fitted.high);
    return follow(before, { low: middle - 0.5 * least, high: middle + 0.5 * least }, 0.5 * least);
  }
  if (before === null) return fitted;
  const holds = before.low <= data.low && data.high <= before.high;
  const roomy = before.high - before.low > 2 * (fitted.high - fitted.low);
  return holds && !roomy ? before : fitted;
}
