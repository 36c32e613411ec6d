/** What lets more people in: another window of this room, and the command by which other machines reach a server. */

import { addressAt } from "./addresses";

const PORT = "8765"; // of a server that is told no other
const ROOM = /\/r\/[^/]+\/$/; // of several rooms, which a file describes
const LONGEST = 32; // characters of a name

/** This visitor, as far as others come in by what this page gives them. */
export interface Visit {
  /** Of this page, and its server: http: or https:. */
  readonly address: string;
  /** Whether this visitor came by an invitation: so must others. */
  readonly invited: () => boolean;
  /** Token of the link; without one where there was none. */
  readonly invitation: () => string | undefined;
}

let windows = 1; // of this visitor

/** Open one more window of this room, beside this one where there is room: a page that is covered lets its hand go. */
export function openWindow({ address, invitation }: Visit, name: string): void {
  windows += 1;
  const { availWidth, availHeight } = screen;
  // Without an opener it begins with nothing of this tab, as a second visitor does.
  open(windowAddress(address, name, windows, invitation()), "_blank", `noopener,popup,width=${Math.round(availWidth / 2)},height=${availHeight}`);
}

/**
 * Address of a second visitor's window on this machine.
 *
 * @param page Address of this page.
 * @param name Of the visitor here.
 * @param count Which window this is; the first is the visitor's own.
 * @param invitation Its token: another window begins a session of its own.
 */
export function windowAddress(page: string, name: string, count: number, invitation: string | undefined): string {
  const url = new URL(addressAt(page));
  const end = ` ${count}`;
  url.searchParams.set("name", `${Array.from(name).slice(0, LONGEST - end.length).join("")}${end}`);
  if (invitation !== undefined) url.hash = new URLSearchParams({ token: invitation }).toString();
  return url.href;
}

/**
 * What to type in place of the command that started a server which only its own machine reaches.
 *
 * @param page Address of this page.
 * @param invited Whether who comes needs an invitation: a token is not to be sent unencrypted.
 * @returns Empty where only a proxy encrypts, before several rooms.
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
