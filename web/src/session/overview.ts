/** What the server of a recorded session says of it before the first scene. */

import type { Moment } from "../model/recording";
import { ProtocolError } from "../protocol/frame";
import { type Fields, integer, isFields, list, number, parseFields, text } from "../protocol/json";
import { decodeServerControl, type Watching } from "../protocol/messages";

const MOST_TEXT = 8 << 20; // characters: thousands of moments with their words
const MOST_TIME = 1e10; // s
const KINDS: readonly Moment["kind"][] = ["joined", "left", "mark", "event", "damage"];

export interface Overview {
  readonly name: string;
  readonly first: number;
  readonly last: number;
  readonly watching: Watching;
  /** Why scenes without a surface show no deformation, in a sentence; empty if they do. */
  readonly unshown: string;
  /** Names by number of the user. */
  readonly names: ReadonlyMap<number, string>;
  readonly moments: readonly Moment[];
  /** Number of moments that were left out. */
  readonly further: number;
  readonly complete: boolean;
}

/** Decode the overview; any invalid text throws ProtocolError. */
export function decodeOverview(said: string): Overview {
  const fields = parseFields(said, MOST_TEXT);
  const watching = decodeServerControl(text(fields, "watching"));
  if (watching.type !== "watching") throw new ProtocolError("watching", watching.type, "watching");
  const first = number(fields, "first", -MOST_TIME, MOST_TIME);
  return {
    name: text(fields, "name"), first, last: number(fields, "last", first, MOST_TIME), watching, unshown: text(fields, "unshown"),
    names: new Map(objects(fields, "users").map((user) => [integer(user, "user"), text(user, "name")])),
    moments: objects(fields, "moments").map(moment).sort((a, b) => a.t - b.t),
    further: integer(fields, "further"), complete: fields["complete"] === true,
  };
}

function moment(fields: Fields): Moment {
  const kind = KINDS.find((one) => one === fields["kind"]);
  if (kind === undefined) throw new ProtocolError("kind of a moment", fields["kind"], KINDS.join(", "));
  return { t: number(fields, "t", -MOST_TIME, MOST_TIME), kind, user: fields["user"] === null ? null : integer(fields, "user"), text: text(fields, "text") };
}

function objects(fields: Fields, key: string): readonly Fields[] {
  return list(fields, key).map((one) => {
    if (!isFields(one)) throw new ProtocolError(key, one, "an object");
    return one;
  });
}
