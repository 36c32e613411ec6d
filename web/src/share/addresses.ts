/** Addresses of this page by which other machines reach it. */

const OWN = /^(localhost|127(\.\d{1,3}){3}|\[::1\])$/;
const HOST = /^([A-Za-z0-9._-]{1,253}|\[[0-9A-Fa-f:.]{2,45}\])$/;
const MOST = 8; // addresses that are offered

/** Whether a host name stands for the machine itself, such as localhost. */
export function isOwn(hostname: string): boolean {
  return OWN.test(hostname.toLowerCase());
}

/** The page's address, without the parts that belong to one visitor, under its own host or another one. */
export function addressAt(page: string, host?: string): string {
  const url = new URL(page);
  url.hash = url.search = "";
  if (host !== undefined) url.hostname = host;
  return url.href;
}

/**
 * Addresses to give to other people, the best first; none where only this machine reaches the server.
 *
 * @param page Address of this page.
 * @param ask Returns the text at an address, where the server lists the names under which others reach it.
 */
export async function addressesToShare(page: string, ask: (url: string) => Promise<string>): Promise<readonly string[]> {
  // A visitor who came over a network has an address that works.
  if (!isOwn(new URL(page).hostname)) return [addressAt(page)];
  const answer: unknown = JSON.parse(await ask(new URL("v1/hosts", addressAt(page)).href));
  const hosts = typeof answer === "object" && answer !== null && "hosts" in answer ? answer.hosts : [];
  if (!Array.isArray(hosts)) return [];
  return hosts
    .filter((host): host is string => typeof host === "string" && HOST.test(host) && !isOwn(host))
    .slice(0, MOST)
    .map((host) => addressAt(page, host));
}

/** Origins that may show the page in a frame, from its Content-Security-Policy; empty for none. */
export function framesOf(policy: string): readonly string[] {
  const rule = policy.split(";").map((part) => part.trim().split(/\s+/)).find(([name]) => name === "frame-ancestors");
  return (rule ?? []).slice(1).filter((origin) => /^https?:\/\//.test(origin));
}

/** HTML by which another page shows the page at an address in a frame, with the permissions that the page uses. */
export function frameWords(address: string): string {
  const safe = address.replaceAll("&", "&amp;").replaceAll('"', "&quot;");
  return `<iframe src="${safe}" title="cohaptic" width="960" height="640" allow="fullscreen; gamepad; clipboard-write"></iframe>`;
}
