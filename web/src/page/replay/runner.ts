/** Runs the replay: shows the received scene at the time on the bar's timeline, with the outlines that make delay visible. */

import type { TouchState } from "../../model/hand";
import type { Moment, RecordedSession, Recording } from "../../model/recording";
import { isLive, type SceneSnapshot, type SceneStore } from "../../model/scene";
import { type Ghost, ghostsNow, ghostsThen } from "../../replay/ghosts";
import type { OwnTrack } from "../../replay/own_track";
import { Player, type Shown } from "../../replay/player";
import { Samples, windowRound } from "../../replay/samples";
import { advance, begin, moment, pace, play, type Scrubber, seek, step } from "../../replay/scrubber";
import type { Lens } from "../../ui/cards/column";
import { sample, SPAN } from "../../ui/cards/user_card";
import { show } from "../../ui/dom";
import { TraceBuffer } from "../../ui/plots/trace_buffer";
import styles from "../../styles/replay.css?inline";
import { ReplayBar } from "../../ui/replay/bar";
import { type ReplayAction, replayActionOf } from "../../ui/replay/keys";
import { ago, clockTime, delayWords } from "../../ui/replay/words";
import { adopt } from "../../ui/styles";
import { Outlines } from "../../view/ghosts";
import { poseOf, tipOfOwn } from "../../view/pose";
import type { Stage } from "../../view/stage";

const CAPACITY = 512; // samples in a window of 6 s, 60 a second at most
const FAR = 1; // s for an arrow key with Shift
const SAID = 2; // s for which the words of a moment stay
const LEAST = 2; // frames; a single frame is no past to look back at

/** The parts of the page that the replay needs. */
export interface Around {
  readonly store: SceneStore;
  readonly stage: Stage | null;
  /** Let the visitor's hand go: a press would act on the present object, which is not shown. */
  letGo(): void;
  /** Called when another body may be shown. */
  changed(): void;
  colour(user: number): string;
}

/** A recording that is being shown. */
interface Looked {
  readonly player: Player;
  readonly samples: Samples;
  readonly track: OwnTrack;
  /** Time of the newest message in the recording, on the page's clock [s]; it is old if the server is silent. */
  readonly taken: number;
  readonly own: number;
  readonly traces: Map<number, TraceBuffer>;
}

export class ReplayRunner {
  private readonly bar: ReplayBar;
  private readonly session: RecordedSession | null;
  private readonly outlines = new Outlines();
  private looked: Looked | null = null;
  private s: Scrubber | null = null;
  private shown: Shown | null = null;
  private late = false;
  private ghosts: readonly Ghost[] = [];
  private empty = false;
  private when = "";
  private own = 0;

  constructor(private readonly around: Around, private readonly track: OwnTrack, host: HTMLElement) {
    adopt(styles);
    this.session = around.store.file ?? null;
    this.bar = new ReplayBar({
      seek: (share) => { this.at((s) => seek(s, s.from + share * (s.to - s.from))); },
      playing: () => { this.look(true); },
      step: (by) => { this.step(by); },
      pace: (speed) => { this.at((s) => pace(s, speed)); },
      delay: () => { this.delay(); },
      live: () => { this.live(); },
      close: () => { this.close(); },
      jump: (by) => { this.jump(by); },
    }, this.session);
    this.bar.root.hidden = true;
    host.append(this.bar.root);
  }

  get active(): boolean {
    return this.looked !== null;
  }

  get recording(): Recording | null {
    return this.looked?.player.recording ?? null;
  }

  get height(): number {
    return this.bar.height;
  }

  get lens(): Lens | null {
    const { shown } = this;
    if (this.looked === null || shown === null) return null;
    return { known: shown.known, when: this.when, charted: (user) => this.charted(user) };
  }

  toggle(): void {
    if (this.bar.root.hidden) this.look();
    else this.close();
  }

  /** @param play_ In a replay: play or pause it, instead of ending it. */
  look(play_ = false): void {
    if (this.looked === null) this.begin();
    else if (play_) this.at((s) => play(s, !s.playing));
    else this.live();
  }

  delay(): void {
    this.late = !this.late;
    show(this.bar.root, true);
    this.update();
  }

  live(): void {
    if (this.session !== null) return; // there is nothing live
    [this.looked, this.s, this.shown] = [null, null, null];
    this.around.changed();
    this.update();
  }

  close(): void {
    if (this.session !== null) return;
    this.late = false;
    show(this.bar.root, false);
    this.live();
  }

  key(event: KeyboardEvent): boolean {
    if (this.looked === null) return false;
    const action = replayActionOf(event, event.target instanceof HTMLElement ? event.target : null, this.session !== null);
    if (action === null) return false;
    this.act(action);
    return true;
  }

  frame(view: SceneSnapshot | null, own: TouchState | null, now: number, dt: number): SceneSnapshot | null {
    this.own = own?.user ?? this.own;
    if (this.looked !== null && this.s !== null) {
      if (this.session === null || this.follow(this.session, this.looked, this.s)) this.s = advance(this.s, dt);
      // Until its scenes have come, the picture stays that of before.
      if (this.session?.has(this.s.t) !== false) this.shown = this.looked.player.at(this.s.t);
    }
    const shown = this.shown ?? view;
    this.ghosts = this.late && shown !== null ? this.ghostsOf(shown, own, now) : [];
    const radius = this.recording?.info.body.radius ?? this.around.store.info?.body.radius ?? 0;
    const outlines = this.ghosts.map(({ user, arrived, itself, normal }) =>
      this.looked === null ? { user, at: arrived, from: itself, normal } : { user, at: itself, from: arrived, normal });
    this.outlines.draw(this.around.stage, outlines, radius, (user) => this.around.colour(user));
    return shown;
  }

  update(now = performance.now() / 1000): void {
    const { s } = this;
    // One number for all places where it is written.
    this.when = s === null ? "" : this.session === null ? ago(this.ageAt(now)) : `${clockTime(s.t - s.from)} of ${clockTime(s.to - s.from)}`;
    const names = (user: number): string => (user === this.own && this.own > 0 ? "you" : (this.nameOf(user) || `user ${user}`));
    this.bar.set({
      replaying: this.looked !== null,
      live: isLive(this.around.store.status),
      playing: s?.playing === true,
      share: s === null ? 1 : s.to > s.from ? (s.t - s.from) / (s.to - s.from) : 1,
      when: s === null && this.empty ? "nothing has come yet" : this.when,
      moment: s === null ? "" : this.said(s),
      trouble: this.trouble(),
      delay: this.late,
      delayWords: this.late ? delayWords(this.looked !== null, this.ghosts.map(({ user, late, apart }) => ({ name: names(user), late, apart }))) : "",
    });
  }

  /** Words on what the picture lacks; empty for nothing. */
  private trouble(): string {
    const { session, s, shown } = this;
    if (session !== null && s !== null && !session.has(s.t)) return session.trouble || "the scenes are on their way";
    if (shown === null) return "";
    if (!shown.known) return session === null ? "nothing was heard" : "nothing is recorded here";
    return shown.complete ? "" : "the surface is on its way";
  }

  /** Words of the moment that was reached last, while it is near. */
  private said(s: Scrubber): string {
    const near = this.session?.moments.findLast(({ t }) => t <= s.t);
    return near !== undefined && s.t - near.t < SAID * s.speed ? near.text : "";
  }

  /** Age of the shown time [s]. */
  private ageAt(now: number): number {
    if (this.s === null || this.looked === null) return 0;
    return this.s.to - this.s.t + now - this.looked.taken;
  }

  private begin(): void {
    show(this.bar.root, true);
    const { session } = this;
    const recording = session?.round(session.start, 1) ?? this.around.store.recorded();
    this.empty = recording === null || (session === null && recording.times.length < LEAST);
    if (recording !== null && !this.empty) {
      this.around.letGo(); // before the gamepad rests
      const player = new Player(recording);
      this.looked = { player, samples: new Samples(player, sample), track: this.track.copy(), taken: performance.now() / 1000 - this.around.store.status.silent, own: this.own, traces: new Map() };
      this.s = session === null ? begin(recording.times) : { ...begin(Float64Array.of(session.first, session.last)), t: session.start };
      this.bar.setPace(1);
      this.shown = player.at(this.s.t);
      this.around.changed();
    }
    this.update();
  }

  /** Change the replay's state; begins a replay if there is none. */
  private at(change: (s: Scrubber) => Scrubber): void {
    if (this.s === null) this.begin();
    if (this.s !== null) this.s = change(this.s);
    this.update();
  }

  /**
   * Go where a part of the page wants to, and hold the part of the session that is needed there.
   *
   * @returns Whether its scenes are there, so that time goes on.
   */
  private follow(session: RecordedSession, looked: Looked, s: Scrubber): boolean {
    if (session.wanted !== null) this.s = seek(s, session.wanted);
    session.wanted = null;
    const { t, speed } = this.s ?? s;
    const part = session.round(t, speed);
    if (part !== looked.player.recording) {
      const player = new Player(part, looked.player);
      this.looked = { ...looked, player, samples: new Samples(player, sample) };
    }
    return session.has(t);
  }

  /** Go to the next moment of the session, or to the one before. */
  private jump(by: 1 | -1): void {
    const to: Moment | null = this.s === null ? null : moment(this.s, this.session?.moments ?? [], by);
    if (to !== null) this.at((s) => seek(s, to.t));
  }

  private step(by: 1 | -1): void {
    this.at((s) => step(s, this.looked?.player.times ?? new Float64Array(), by));
  }

  private act(action: ReplayAction): void {
    const far = (by: number): void => { this.at((s) => seek(play(s, false), s.t + by)); };
    const acts: Record<ReplayAction, () => void> = {
      play: () => { this.at((s) => play(s, !s.playing)); },
      back: () => { this.step(-1); },
      on: () => { this.step(1); },
      "far back": () => { far(-FAR); },
      "far on": () => { far(FAR); },
      first: () => { far(-Infinity); },
      last: () => { far(Infinity); },
      live: () => { this.live(); },
      next: () => { this.jump(1); },
      previous: () => { this.jump(-1); },
      none: () => undefined,
    };
    acts[action]();
  }

  private ghostsOf(shown: SceneSnapshot, own: TouchState | null, now: number): readonly Ghost[] {
    const { looked } = this;
    if (looked === null) return own === null ? [] : ghostsNow(shown, own, tipOfOwn(own), now, (user) => poseOf(user).proxy);
    const hand = (user: number, t: number): ReturnType<Player["hand"]> => looked.player.hand(user, t);
    return ghostsThen(shown.users, shown.t_server, hand, looked.own, (t) => looked.track.at(t), (user) => poseOf(user).proxy);
  }

  private nameOf(user: number): string {
    return this.looked?.player.recording.names.get(user) ?? this.around.store.roster.find((one) => one.user === user)?.name ?? "";
  }

  private charted(user: number): ReturnType<Lens["charted"]> {
    const { looked, s } = this;
    let data = looked?.traces.get(user);
    if (data === undefined) {
      data = new TraceBuffer(4, CAPACITY);
      looked?.traces.set(user, data);
    }
    if (looked === null || s === null) return { data, end: 0, span: SPAN, shown: null };
    const window = windowRound(s.t, s.from, s.to, SPAN);
    const trace = data;
    trace.clear();
    looked.samples.each(window, (of, t, values) => {
      if (of === user) trace.push(t, values);
    });
    return { data, end: window.end, span: SPAN, shown: s.t };
  }
}
