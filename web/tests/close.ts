/** Numbers that two languages find must agree but for the last digits. */

import { expect } from "vitest";

/**
 * Every number, list and field of `expected` is in `actual`; fields that `expected` lacks are not looked at.
 *
 * @param rel Share of the value; the mathematical libraries of two languages may choose the last digits.
 * @param abs For values that should be zero.
 */
export function expectClose(actual: unknown, expected: unknown, where: string, rel = 1e-9, abs = 1e-12): void {
  if (typeof expected === "number") {
    const off = Math.abs(Number(actual) - expected);
    const most = Math.max(abs, rel * Math.abs(expected));
    if (!(off <= most)) expect.fail(`${where} is ${String(actual)}; expected ${expected} to ${most}`);
  } else if (Array.isArray(expected)) {
    expect((actual as unknown[]).length, where).toBe(expected.length);
    expected.forEach((value, i) => {
      expectClose((actual as unknown[])[i], value, `${where}.${i}`, rel, abs);
    });
  } else if (typeof expected === "object" && expected !== null) {
    for (const [key, value] of Object.entries(expected)) {
      expectClose((actual as Record<string, unknown>)[key], value, `${where}.${key}`, rel, abs);
    }
  } else {
    expect(actual, where).toBe(expected);
  }
}
