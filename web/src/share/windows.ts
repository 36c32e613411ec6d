/** Ways to let more people in: another window of this room, and a command that makes a server reachable from other machines. */

import { addressAt } from "./addresses";

const PORT = "8765"; // default port of a server
const ROOM = /\/r\/[^/]+\/$/; // path of one of several rooms, which a file describes
const LONGEST = 32; // characters of a name

/** Data of this visitor from which addresses for others are made. */
export interface Visit {
  /** Address of this page and its server, http: or https:. */
  readonly address: string;
  /** Whether this visitor came by an invitation; others then need one, too. */
  readonly invited: () => boolean;
  /** Token of the link; undefined if there was none. */
  readonly invitation: () => string | undefined;
}

let windows = 1; // number of this visitor's windows

/** Open one more window of this room, beside this one if the screen allows: a covered page lets its hand go. */
export function openWindow({ address, invitation }: Visit, name: string): void {
  windows += 1;
  const { availWidth, availHeight } = screen;
  // Without an opener the new window shares nothing with this tab, like that of a second visitor.
  open(windowAddress(address, name, windows, invitation()), "_blank", `noopener,popup,width=${Math.round(availWidth / 2)},height=${availHeight}`);
}

/**
 * Address of a second visitor's window on this machine.
 *
 * @param page Address of this page.
 * @param name Name of this visitor.
 * @param count Number of the window; the first is the visitor's own.
 * @param invitation Token of the invitation, with which the other window begins a session of its own.
 */
export function windowAddress(page: string, name: string, count: number, invitation: string | undefined): string {
  const url = new URL(addressAt(page));
  const end = ` ${count}`;
  url.searchParams.set("name", `${Array.from(name).slice(0, LONGEST - end.length).join("")}${end}`);
  if (invitation !== undefined) url.hash = new URLSearchParams({ token: invitation }).toString();
  return url.href;
}

/**
 * Command to type in place of the one that started a server which only its own machine reaches.
 *
 * @param page Address of this page.
 * @param invited Whether visitors need an invitation, whose token must not be sent unencrypted.
 * @returns The command; empty where only a proxy can encrypt, as before several rooms.
 */
export function serveCommand(page: string, invited: boolean): string {
  const { port, protocol, pathname } = new URL(page);
  if (ROOM.test(pathname)) {
    return invited ? "" : "COHAPTIC_SERVER_HOST=0.0.0.0 COHAPTIC_SERVER_ACCESS__OPEN=true COHAPTIC_SERVER_ACCESS__INSECURE=true cohaptic serve --config rooms.toml";
  }
  const who = invited ? "--keys keys.json" : "--open";
  const how = invited || protocol === "https:" ? "--tls-cert cert.pem --tls-key key.pem" : "--insecure";
  return `cohaptic serve --host 0.0.0.0${port === PORT ? "" : ` --port ${port || (protocol === "https:" ? "443" : "80")}`} ${who} ${how}`;
}
