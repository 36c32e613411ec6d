/** The whole page: makes its parts, connects them, and runs the frame. */

import { socketUrl } from "../address";
import { CompanyCorner } from "../company/corner";
import type { TouchState } from "../model/hand";
import { isLive, type SceneStore, type SceneSnapshot } from "../model/scene";
import { Column } from "../ui/cards/column";
import { type Inks, inks } from "../ui/plots/canvas";
import { Theme } from "../ui/theme";
import { Toolbar } from "../ui/toolbar";
import type { Vec3 } from "../model/vec";
import { type Scheme, UserColours } from "../model/colours";
import type { Colouring, Legend } from "../view/body/surface";
import { eye, HOME, type Orbit } from "../view/orbit";
import type { SceneView } from "../view/scene_view";
import type { Stage } from "../view/stage";
import { Announcer } from "./announcer";
import { act, attachKeys, attachPointers } from "./controls";
import { layOut, type Layout, showTime, togglePanel } from "./layout";
import { VisitorName } from "./names";
import { OwnHand } from "./own_hand";
import { type Panel, type PageSettings, type PanelHost, Panels, type Trouble } from "./panels";
import { ReplayPlace } from "./replay/place";
import { SleepDetector } from "./sleep_detector";
import { Tour } from "./tour";

const WRITE_EVERY = 0.1; // s between two rounds of numbers and plots

export class Page implements PanelHost {
  readonly root: HTMLElement;
  readonly url: string;
  readonly store: SceneStore;
  readonly own: OwnHand;
  readonly tour = new Tour(this, () => { this.picture = "not loaded"; });
  // The graphics are the largest part of the page; socket, words and buttons work before they are loaded.
  readonly graphics = import("../view/scene_view");
  readonly replay = new ReplayPlace(this);
  readonly column: Column;
  /** The stage; null until the graphics are loaded, and without WebGL. The rest of the page works without it. */
  stage: Stage | null = null;
  view: SceneSnapshot | null = null;
  readonly company: CompanyCorner;

  private readonly host: HTMLElement;
  private readonly theme: Theme;
  private readonly colours = new UserColours();
  private sceneView: SceneView | null = null;
  private picture: Trouble["picture"] = "well";
  private colouring: Colouring = "displacement";
  private readonly layout: Layout;
  private readonly toolbar: Toolbar;
  private readonly panels: Panels;
  partner: PanelHost["partner"] = () => null;
  private readonly sleep = new SleepDetector();
  private readonly announcer: Announcer;
  readonly visitor = new VisitorName();
  private last = 0;
  private written = 0;
  private did: TouchState["doing"] | undefined;
  private dropped = false; // whether the last pause let a hand go
  private wish: "touch" | "wait" | null = null;
  shown: SceneSnapshot | null = null;
  private seen = false;
  live = false;

  constructor(readonly settings: PageSettings, panels: readonly Panel[]) {
    this.url = socketUrl(settings.address);
    this.store = settings.openStore();
    this.own = new OwnHand(settings.startTouch);
    this.theme = new Theme(() => { this.repaint(); });
    this.company = new CompanyCorner(this);
    this.column = new Column(this);
    this.toolbar = new Toolbar((action) => { act(this, action); }, () => { this.lookBack(true); }, () => { togglePanel(this.root, this.toolbar.panelButton); });
    this.layout = layOut({
      toolbar: this.toolbar, column: this.column,
      pill: this.company.pill, tour: this.tour.card, trace: this.tour.trace, replay: this.replay.root,
    });
    [this.root, this.host] = [this.layout.root, this.layout.host];
    this.announcer = new Announcer(this.layout.live);
    document.body.append(this.root);
    this.panels = new Panels(panels, this, this.layout.put);
    this.column.level.begin(location.search);
    attachKeys(this);
    this.store.subscribe(() => { this.changed(); });
    this.theme.apply();
    this.changed();
    requestAnimationFrame((t) => { this.frame(t / 1000); });
    this.graphics.then(
      ({ openScene }) => { this.openScene(() => openScene(this.host, this.colours)); },
      () => { this.picture = "not loaded"; },
    );
  }

  private openScene(open: () => { readonly stage: Stage; readonly view: SceneView } | null): void {
    const scene = open();
    this.picture = scene === null ? "no webgl" : "well";
    if (scene === null) return;
    [this.stage, this.sceneView] = [scene.stage, scene.view];
    scene.view.setScheme(this.theme.scheme);
    scene.view.setColouring(this.colouring);
    const detach = attachPointers(this, scene.stage, this.host);
    scene.stage.watch(() => {
      // The remains of the lost picture are removed now; they would not belong to the new graphics.
      [this.picture, this.stage, this.sceneView] = ["lost", null, null];
      detach();
      scene.view.dispose();
    }, () => { this.openScene(open); });
    this.changed();
  }

  hide(): void { this.sleep.hide(); this.rest(); }

  /** The tab is visible again: the tour repeats the step that nobody saw. */
  wake(): void { this.tour.again(); }

  /** Let the hand go, because nobody watches it. */
  private rest(): void {
    this.panels.each("rest");
    this.dropped ||= this.own.pressing && !this.tour.running;
    this.own.retreat(true);
  }

  /** Press the object; the first press also joins the room. */
  press(origin: Vec3, direction: Vec3): boolean {
    if (this.replay.active) return false; // a press would act on the present object, which is not shown
    if (this.own.handle === null) {
      if (this.store.info?.can_touch !== true || this.own.placeAt(origin, direction) === null) return false;
      this.touch(true);
    }
    return this.own.press(origin, direction, performance.now() / 1000);
  }

  /** @param wait Whether to wait for a place if the room is full. */
  touch(on: boolean, wait = false): void {
    // Before the body is known there is nothing to touch, so the wish is kept.
    this.wish = !on || this.store.info !== null ? null : wait ? "wait" : "touch";
    if (on) this.own.start(this.url, this.visitor.name, this.towardsEye(), wait);
    else this.own.stop();
    this.write();
  }

  /** @param bar Show or hide the replay's bar, instead of switching between past and present. It ends the tour. */
  lookBack(bar: boolean): void {
    if (this.tour.running) this.toggleTour();
    if (bar) this.replay.toggle();
    else this.replay.look();
  }

  toggleTour(): void {
    this.replay.close();
    this.tour.toggle(performance.now() / 1000);
  }

  toggleTheme(): void { this.theme.switch(); }

  toggle(panel: string): void { this.panels.toggle(panel); }

  get scheme(): Scheme { return this.theme.scheme; }

  get drawn(): boolean { return this.sceneView?.drawn === true; }

  get legend(): Legend | null { return this.sceneView?.legend ?? null; }

  /** The present scene; null while a past time is shown or the server is silent. */
  get present(): SceneSnapshot | null { return this.live && !this.replay.active ? this.shown : null; }

  /** Let the hand go before a past time is shown. */
  letGo(): void {
    this.panels.each("rest");
    this.own.retreat();
  }

  look(orbit: Orbit): void {
    this.stage?.goTo(orbit);
    this.company.moved();
  }

  speak(words: string): void { this.announcer.say(words); }

  towardsEye(): Vec3 { return this.stage?.towardsEye() ?? eye({ ...HOME, distance: 1 }, [0, 0, 0], 1); }

  colour(user: number): string { return this.colours.of(user, this.theme.scheme); }

  inks(): Inks { return inks(this.column.root); }

  setColouring(by: Colouring): void {
    this.colouring = by;
    this.sceneView?.setColouring(by);
  }

  trouble(now: number): Trouble {
    return { picture: this.picture, misplaced: this.settings.misplaced, seen: this.seen, slept: this.sleep.told(now), letGo: this.dropped };
  }

  changed(): void {
    const shown = this.replay.recording ?? this.store;
    this.sceneView?.setBody(shown.mesh, shown.info);
    this.own.setBody(this.store.mesh, this.store.info);
    if (this.wish !== null && this.store.info !== null) this.touch(true, this.wish === "wait");
    if (this.store.mesh !== null) this.settings.prepareTouch();
    this.announcer.news(this.store.events);
    this.write();
  }

  private repaint(): void {
    this.sceneView?.setScheme(this.theme.scheme);
    this.column.repaint();
  }

  private frame(now: number): void {
    requestAnimationFrame((t) => { this.frame(t / 1000); });
    const dt = now - this.last;
    this.last = now;
    if (this.sleep.frame(now) > 0) { this.rest(); this.wake(); }
    this.view = this.store.at(now);
    this.seen ||= this.view !== null;
    const live = isLive(this.store.status);
    if (this.view !== null && live) this.column.record(this.view);
    this.panels.each("paint", now);
    this.own.step(this.view, now, dt);
    if (live !== this.live) this.write(now);
    this.company.frame();
    const own = this.own.state;
    this.shown = this.replay.frame(this.view, own, now, dt);
    this.sceneView?.draw(this.shown, this.replay.active ? null : own, dt, { marks: this.replay.active ? [] : this.store.company.marks, now });
    this.tour.frame();
    if (this.drawn || this.picture !== "well") this.host.ariaBusy = "false";
    // A change between touching and not touching is written at once.
    if (now - this.written >= WRITE_EVERY || own?.doing !== this.did) this.write(now);
  }

  /** Write words, numbers and plots; not with every picture, since nobody reads them sixty times a second. */
  private write(now = performance.now() / 1000): void {
    this.written = now;
    this.colours.present([...this.store.roster, ...(this.shown?.users ?? [])].map(({ user }) => user));
    this.live = isLive(this.store.status);
    const { lens } = this.replay;
    showTime(this.root, lens?.known ?? null, this.live || !this.seen);
    const own = this.own.state;
    this.did = own?.doing;
    if (own !== null) this.visitor.take(own);
    this.own.tidy();
    this.replay.update(now);
    this.stage?.uncover(...this.layout.covered(this.replay.height));
    this.tour.update(now);
    this.toolbar.update(this.store, this.replay.words);
    this.company.update(now);
    this.column.update();
    if (this.sleep.told(now) === 0) this.dropped = false;
    this.panels.each("update", now);
  }
}
