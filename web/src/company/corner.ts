/** The place of the company's parts on the page; their code is loaded once a server reports company. */

import type { Vec3 } from "../model/vec";
import { el } from "../ui/dom";
import { lazily } from "../ui/lazy";
import type { CompanyPlace } from "./place";
import type { Surroundings } from "./surroundings";

export class CompanyCorner {
  /** Places for the parts over the stage and in the column. */
  readonly pill = el("div", { class: "pill-place" });
  readonly bar = el("div", { class: "company-place" });
  private place: CompanyPlace | null = null;
  /** The newest wish of the visitor while the code is being loaded. */
  private wish: ((place: CompanyPlace) => void) | null = null;

  private readonly load = lazily(() => import("./place"), ({ CompanyPlace }) => {
    this.place = new CompanyPlace(this.page, location.search);
    this.pill.append(this.place.told.root, this.place.pill.root);
    this.bar.append(this.place.bar.root);
    this.wish?.(this.place);
    this.wish = null;
  });

  constructor(private readonly page: Surroundings) {}

  /** Whether the next press points and does nothing else. */
  get armed(): boolean {
    return this.place?.armed ?? false;
  }

  /** User whose view this page follows; null for nobody. */
  get following(): number | null {
    return this.place?.following ?? null;
  }

  /** Follow a user's view, or stop if this page follows it already. */
  toggle(user: number): void {
    this.ask((place) => { place.follow(place.following === user ? null : user); });
  }

  followNext(): void {
    this.ask((place) => { place.followNext(); });
  }

  /** The visitor has moved the view. */
  moved(): void {
    this.place?.moved();
  }

  /** Show everybody the place that a ray meets; false where the ray meets none, or this visitor may not point. */
  point(origin: Vec3, direction: Vec3): boolean {
    return this.place?.point(origin, direction, performance.now() / 1000) ?? false;
  }

  /** To be called for every picture. */
  frame(): void {
    this.place?.frame();
  }

  /** To be called some times a second. */
  update(now: number): void {
    if (this.place !== null) this.place.update(now);
    else if (this.page.store.company.state !== null) this.load();
  }

  private ask(wish: (place: CompanyPlace) => void): void {
    if (this.place !== null) wish(this.place);
    else this.wish = wish;
  }
}
