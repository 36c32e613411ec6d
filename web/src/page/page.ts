/** The whole page: makes its parts, connects them, and runs the frame. */

import { socketUrl } from "../address";
import { CompanyCorner } from "../company/corner";
import type { TouchHandle, TouchState } from "../model/hand";
import { isLive, type SceneStore, type SceneSnapshot } from "../model/scene";
import { Dock } from "../ui/dock";
import { LazyDialog } from "../ui/lazy_dialog";
import { Ghost } from "../ui/ghost";
import { GamepadPlace } from "../ui/gamepad/place";
import { LegendBox } from "../ui/legend";
import { notice, type NoticeFacts } from "../ui/notice";
import { NoticeBar } from "../ui/notice_bar";
import { Column } from "../ui/cards/column";
import { type Inks, inks } from "../ui/plots/canvas";
import type { Rumble } from "../ui/rumble";
import { Theme } from "../ui/theme";
import { Toolbar } from "../ui/toolbar";
import type { Vec3 } from "../model/vec";
import type { Visit } from "../share/windows";
import { UserColours } from "../model/colours";
import type { Colouring } from "../view/body/surface";
import { HOME, type Orbit } from "../view/orbit";
import type { SceneView } from "../view/scene_view";
import type { Stage } from "../view/stage";
import { Announcer } from "./announcer";
import type { Beside } from "./beside";
import { attachKeys, attachPointers, padHost } from "./controls";
import { covered, layOut, showTime, toggleFullScreen, togglePanel } from "./layout";
import { VisitorName } from "./names";
import { noticeFacts } from "./notice_facts";
import { OwnHand, type StartTouch } from "./own_hand";
import { ReplayPlace } from "./replay/place";
import { SleepDetector } from "./sleep_detector";
import { Tour } from "./tour";
import { UploadPlace } from "./upload_place";

const WRITE_EVERY = 0.1; // s between two rounds of numbers and plots

export interface PageSettings extends Visit {
  readonly openStore: () => SceneStore;
  readonly startTouch: StartTouch;
  /** Prepare what the first touch needs, when there is something to touch. */
  readonly prepareTouch: () => void;
  /** Whether the address had a token in the part that servers log. */
  readonly misplaced: boolean;
  /** The secret of this page's hand. */
  readonly key: string;
}

export class Page {
  readonly root: HTMLElement;
  readonly url: string;
  readonly store: SceneStore;
  readonly own: OwnHand;
  readonly tour = new Tour(this, () => { this.picture = "not loaded"; });
  readonly dock: Dock;
  private readonly share = new LazyDialog(async () => new (await import("../ui/share/dialog")).ShareDialog(this.settings, () => this.visitor.name));
  readonly help = new LazyDialog(async () => new (await import("../ui/help")).Help());
  private readonly ghost = new Ghost();
  readonly upload: UploadPlace;
  private readonly padHost = padHost(this);
  private readonly gamepad = new GamepadPlace(this.padHost);
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
  private picture: NoticeFacts["picture"] = "well";
  private colouring: Colouring = "displacement";
  private readonly toolbar: Toolbar;
  private readonly legend: LegendBox;
  private readonly bar = new NoticeBar(() => { location.reload(); }, () => { this.touch(true, true); });
  private rumble: Rumble | null = null;
  private beside: Beside | null = null;
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
  private pressed = false;
  private live = false;

  constructor(readonly settings: PageSettings) {
    const { address, openStore, startTouch } = settings;
    this.url = socketUrl(address);
    // The graphics are the largest part of the page; socket, words and buttons work before they are loaded.
    const graphics = import("../view/scene_view");
    this.store = openStore();
    this.own = new OwnHand(startTouch);
    this.company = new CompanyCorner(this);
    this.upload = new UploadPlace(address, () => { this.touch(true); });
    this.theme = new Theme(() => { this.repaint(); });
    this.column = new Column(this);
    this.legend = new LegendBox((by) => { this.setColouring(by); });
    this.dock = new Dock(this.visitor.name, {
      touch: (on) => { this.touch(on); }, law: (law) => { this.setLaw(law); }, friction: (mu) => { this.own.setFriction(mu); },
      name: (name) => { this.own.rename(this.visitor.choose(name)); },
    });
    this.toolbar = new Toolbar({
      gamepad: this.gamepad.button,
      tour: () => { this.toggleTour(); },
      replay: () => { this.lookBack(true); },
      reset: () => { this.look(HOME); },
      full: toggleFullScreen, theme: () => { this.theme.switch(); },
      panel: () => { togglePanel(this.root, this.toolbar.panelButton); },
      help: () => { this.help.toggle(); }, upload: () => { this.upload.open(); },
    });
    const layout = layOut({
      toolbar: this.toolbar.root, column: this.column.root, dock: this.dock.root, legend: this.legend.root,
      notice: this.bar.root, pill: this.company.pill, tour: this.tour.card, trace: this.tour.trace, ghost: this.ghost.root, replay: this.replay.root, help: this.help.root, upload: this.upload.root, share: this.share.root, gamepad: this.gamepad.root,
    });
    [this.root, this.host] = [layout.root, layout.host];
    this.announcer = new Announcer(layout.live);
    document.body.append(this.root);
    this.column.level.begin(location.search);
    attachKeys(this);
    this.store.subscribe(() => { this.changed(); });
    this.theme.apply();
    this.changed();
    requestAnimationFrame((t) => { this.frame(t / 1000); });
    void graphics.then(() => import("../ui/rumble")).then(({ Rumble }) => { this.rumble = new Rumble(); }, () => undefined);
    void graphics.then(() => import("./beside")).then(({ Beside }) => { this.beside = new Beside(this, settings, startTouch, this.url, () => this.padHost.towardsEye(), this.column.beside); }, () => undefined);
    graphics.then(
      ({ openScene }) => { this.openScene(() => openScene(layout.host, this.colours)); },
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
    this.gamepad.pause();
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
    const pressed = this.own.press(origin, direction, performance.now() / 1000);
    this.pressed ||= pressed;
    return pressed;
  }

  /** @param wait Whether to wait for a place if the room is full. */
  touch(on: boolean, wait = false): void {
    // Before the body is known there is nothing to touch, so the wish is kept.
    this.wish = !on || this.store.info !== null ? null : wait ? "wait" : "touch";
    if (on) this.own.start(this.url, this.visitor.name, this.padHost.towardsEye(), wait);
    else this.own.stop();
    if (!on) this.rumble?.still();
    this.write(performance.now() / 1000);
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

  private setLaw(law: OwnHand["law"]): void {
    this.own.setLaw(law);
    this.dock.setLaw(law);
  }

  /** The present scene; null while a past time is shown or the server is silent. */
  get present(): SceneSnapshot | null { return this.live && !this.replay.active ? this.shown : null; }
  /** Let the hand go before a past time is shown. */
  letGo(): void { this.gamepad.pause(); this.own.retreat(); }
  look(orbit: Orbit): void { this.stage?.goTo(orbit); this.company.moved(); }
  /** The hand of a partner whom the visitor has brought; null for none. */
  partner(): TouchHandle | null { return this.beside?.hand ?? null; }
  invite(): void { this.share.toggle(); }
  speak(words: string): void { this.announcer.say(words); }
  colour(user: number): string { return this.colours.of(user, this.theme.scheme); }
  inks(): Inks { return inks(this.column.root); }

  setColouring(by: Colouring): void {
    this.colouring = by;
    this.sceneView?.setColouring(by);
  }

  changed(): void {
    const shown = this.replay.recording ?? this.store;
    this.sceneView?.setBody(shown.mesh, shown.info);
    this.own.setBody(this.store.mesh, this.store.info);
    if (this.wish !== null && this.store.info !== null) this.touch(true, this.wish === "wait");
    if (this.store.mesh !== null) this.settings.prepareTouch();
    this.upload.allow(this.store.info?.allow_upload === true);
    this.dock.allowTouch(this.store.info?.can_touch !== false);
    this.dock.allowPaper(this.store.info?.allow_fixed_gains === true);
    this.announcer.news(this.store.events);
    this.write(performance.now() / 1000);
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
    this.gamepad.frame(now);
    this.own.step(this.view, now, dt);
    if (live !== this.live) this.write(now);
    this.company.frame();
    const own = this.own.state;
    this.shown = this.replay.frame(this.view, own, now, dt);
    this.sceneView?.draw(this.shown, this.replay.active ? null : own, dt, { marks: this.replay.active ? [] : this.store.company.marks, now });
    for (const others of [this.tour, this.beside]) others?.frame();
    if (own !== null && !this.gamepad.used) this.rumble?.feel(own.force, 1000 * now);
    if (this.sceneView?.drawn === true || this.picture !== "well") this.host.ariaBusy = "false";
    // A change between touching and not touching is written at once.
    if (now - this.written >= WRITE_EVERY || own?.doing !== this.did) this.write(now);
  }

  /** Write words, numbers and plots; not with every picture, since nobody reads them sixty times a second. */
  private write(now: number): void {
    this.written = now;
    this.colours.present([...this.store.roster, ...(this.shown?.users ?? [])].map(({ user }) => user));
    this.live = isLive(this.store.status);
    const { lens } = this.replay;
    showTime(this.root, lens?.known ?? null, this.live || !this.seen);
    const own = this.own.state;
    this.did = own?.doing;
    if (own !== null && this.visitor.take(own)) this.dock.setName(own.name);
    this.own.tidy();
    this.replay.update(now);
    this.stage?.uncover(...covered(this.host.offsetHeight, this.toolbar.root, this.dock.root, this.replay.height, this.tour.trace));
    this.root.style.setProperty("--foot", `${this.dock.root.offsetHeight}px`);
    this.root.style.setProperty("--dock", `${this.dock.height}px`); // elements over the stage stay clear of the dock
    this.tour.update(now);
    this.toolbar.update(this.store, this.replay.words);
    this.company.update(now);
    this.column.update();
    this.beside?.update();
    if (this.sceneView !== null) this.legend.update(this.sceneView.legend, this.theme.scheme);
    this.dock.set(this.own.handle !== null, this.own.hint(lens !== null));
    if (own !== null) this.dock.update(own, this.live, this.colour(own.user), this.inks());
    // A visitor whose press met a full room has not learned the gesture yet.
    if (this.pressed && this.own.pressing && own?.doing === "touching") this.ghost.learned();
    this.ghost.show(!this.own.pressing && !this.company.armed && this.sceneView?.drawn === true && this.live && !this.tour.running && lens === null && this.store.info?.can_touch === true);
    const slept = this.sleep.told(now);
    if (slept === 0) this.dropped = false;
    this.bar.set(notice(noticeFacts(this.store, this.own.ended ?? own, { picture: this.picture, misplaced: this.settings.misplaced, clockStep: this.own.handle?.link.clock_step ?? 0, seen: this.seen, slept, letGo: this.dropped, now })));
  }
}
