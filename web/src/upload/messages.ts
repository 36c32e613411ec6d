/** Messages of a connection that brings a mesh file (docs/protocol.md, "An upload"). */

import type { Vec3 } from "../model/vec";
import { ProtocolError } from "../protocol/frame";
import { checkKeys, type Fields, integer, isFields, list, number, parseFields, text, vector } from "../protocol/json";

export const UPLOAD_SUBPROTOCOL = "cohaptic.upload.v1";
/** Bytes of the file in one message. */
export const CHUNK = 32 * 1024;
/** Largest length of a rule for the held part, in characters. */
export const MAX_RULE = 16_384;
const MAX_TEXT = 24_576;
const MAX_PLACE = 1e8; // m, of a coordinate in a file

export interface Finding {
  readonly problem: string;
  readonly remedy: string;
}

export interface UploadOffer {
  readonly type: "upload_offer";
  readonly kinds: readonly string[];
  readonly max_bytes: number;
  readonly max_memory: number;
  readonly max_seconds: number;
}

export interface Examined {
  readonly type: "examined";
  readonly findings: readonly Finding[];
  /** Proposed rule for the held part. */
  readonly fix: string;
  /** Proposed scale: metres in one unit of the file; the mesh that follows is in metres at this scale. */
  readonly scale: number;
  readonly triangles: number;
  /** Point of the file at which the surface that is shown has its origin, at `scale` [m]. */
  readonly middle: Vec3;
}

/** The choice that a refusal is about; "file" if it is about no single choice. */
export type About = "held" | "size" | "file";

export type UploadAnswer =
  | UploadOffer
  | Examined
  | { readonly type: "progress"; readonly phase: string; readonly share: number }
  | { readonly type: "refused"; readonly about: About; readonly message: string; readonly tries: number }
  | { readonly type: "prepared"; readonly command: string }
  | { readonly type: "error"; readonly code: number; readonly field: string; readonly message: string };

export type UploadRequest =
  | { readonly type: "begin_upload"; readonly name: string; readonly size: number }
  | { readonly type: "prepare_object"; readonly fix: string; readonly scale: number; readonly young: number | null; readonly poisson: number };

export function encodeUploadRequest(message: UploadRequest): string {
  return JSON.stringify(message);
}

/** Decode a message of the server; throws ProtocolError for any invalid text. */
export function decodeUploadAnswer(data: string): UploadAnswer {
  const fields = parseFields(data, MAX_TEXT);
  const answer = decode(text(fields, "type"), fields);
  checkKeys(answer.type, fields, Object.keys(answer));
  return answer;
}

function decode(type: string, f: Fields): UploadAnswer {
  switch (type) {
    case "upload_offer":
      return {
        type,
        kinds: list(f, "kinds").map(String),
        max_bytes: integer(f, "max_bytes"),
        max_memory: integer(f, "max_memory"),
        max_seconds: number(f, "max_seconds", 0, 1e9),
      };
    case "examined":
      return {
        type,
        findings: list(f, "findings").map(finding),
        fix: text(f, "fix"),
        scale: number(f, "scale", 1e-9, 1e9),
        triangles: integer(f, "triangles"),
        middle: vector(f, "middle", MAX_PLACE),
      };
    case "progress":
      return { type, phase: text(f, "phase"), share: number(f, "share", 0, 1) };
    case "refused":
      return { type, about: about(text(f, "about")), message: text(f, "message"), tries: integer(f, "tries") };
    case "prepared":
      return { type, command: text(f, "command") };
    case "error":
      return { type, code: integer(f, "code"), field: text(f, "field"), message: text(f, "message") };
    default:
      throw new ProtocolError("type of a message", type, "upload_offer, examined, progress, refused, prepared or error");
  }
}

function about(choice: string): About {
  if (choice !== "held" && choice !== "size" && choice !== "file") throw new ProtocolError("about", choice, "held, size or file");
  return choice;
}

function finding(entry: unknown): Finding {
  if (!isFields(entry)) throw new ProtocolError("findings", entry, "objects");
  return { problem: text(entry, "problem"), remedy: text(entry, "remedy") };
}
