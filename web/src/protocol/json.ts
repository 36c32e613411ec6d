/** Checks of one JSON message, field by field: each returns the value with its type or throws ProtocolError. */

import type { Vec3 } from "../model/vec";
import { ProtocolError } from "./frame";

export type Fields = Readonly<Record<string, unknown>>;

export function isFields(value: unknown): value is Fields {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** The JSON object in a text of at most `limit` characters. */
export function parseFields(text: string, limit: number): Fields {
  if (text.length > limit) {
    throw new ProtocolError("control message length", text.length, `<= ${limit} characters`);
  }
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch {
    throw new ProtocolError("control message", text, "JSON");
  }
  if (!isFields(value)) throw new ProtocolError("control message", text, "a JSON object");
  return value;
}

/** Refuse unknown fields, so that a misspelt one is not ignored silently. */
export function checkKeys(field: string, fields: Fields, known: readonly string[]): void {
  for (const key of Object.keys(fields)) {
    if (!known.includes(key)) throw new ProtocolError(`field of ${field}`, key, known.join(", "));
  }
}

export function text(fields: Fields, key: string): string {
  const value = fields[key];
  if (typeof value !== "string") throw new ProtocolError(key, value, "text");
  return value;
}

export function number(fields: Fields, key: string, low: number, high: number): number {
  const value = fields[key];
  if (typeof value !== "number" || !(value >= low && value <= high)) {
    throw new ProtocolError(key, value, `a number from ${low} to ${high}`);
  }
  return value;
}

export function positive(fields: Fields, key: string, high: number): number {
  const value = fields[key];
  if (typeof value !== "number" || !(value > 0 && value <= high)) {
    throw new ProtocolError(key, value, `a number above 0, at most ${high}`);
  }
  return value;
}

export function integer(fields: Fields, key: string): number {
  const value = fields[key];
  if (!Number.isSafeInteger(value)) throw new ProtocolError(key, value, "a whole number");
  return value as number;
}

export function flag(fields: Fields, key: string): boolean {
  const value = fields[key];
  if (typeof value !== "boolean") throw new ProtocolError(key, value, "true or false");
  return value;
}

export function list(fields: Fields, key: string): readonly unknown[] {
  const value = fields[key];
  if (!Array.isArray(value)) throw new ProtocolError(key, value, "a list");
  return value;
}

export function object(fields: Fields, key: string): Fields {
  const value = fields[key];
  if (!isFields(value)) throw new ProtocolError(key, value, "an object");
  return value;
}

/** Read three numbers, each between -`most` and `most`. */
export function vector(fields: Fields, key: string, most: number): Vec3 {
  const [x, y, z, ...more] = list(fields, key);
  const ok = [x, y, z].every((v) => typeof v === "number" && Math.abs(v) <= most);
  if (!ok || more.length > 0) throw new ProtocolError(key, fields[key], `three numbers from -${most} to ${most}`);
  return [x as number, y as number, z as number];
}
