/** Sentences about who else is here. */

import type { Company, Follower, Mark } from "../model/company";

/** Words on how many people watch without a hand; empty for nobody. */
export function watchingWords(company: Company | null): string {
  return company === null || company.watching === 0 ? "" : `${company.watching} watching`;
}

const called = ({ user, name }: Follower): string => (user === null ? `${name} (watching)` : name);

/** Words on who follows the view of this page; empty for nobody. */
export function followerWords(followers: readonly Follower[]): string {
  const [one, two, ...more] = followers.map(called);
  if (one === undefined) return "";
  if (two === undefined) return `${one} sees what you see.`;
  if (more.length === 0) return `${one} and ${two} see what you see.`;
  return `${one} and ${more.length + 1} others see what you see.`;
}

export function pointedWords(mark: Mark, own: boolean): string {
  return own ? "You point at the object." : `${called(mark)} points at the object.`;
}
