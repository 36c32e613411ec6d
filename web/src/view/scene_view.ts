/** The scene on the stage: body, ground, hands and names, made for one mesh and moved to each shown moment. */

import { Group } from "three";
import type { RestMesh } from "../model/body";
import type { TouchState } from "../model/hand";
import type { SceneSnapshot, WatchInfo } from "../model/scene";
import type { Mark } from "../model/company";
import type { Scheme, UserColours } from "../model/colours";
import { type Colouring, type Legend, Surface } from "./body/surface";
import { Ground } from "./ground";
import { Hands } from "./hands";
import { Labels } from "./labels";
import type { Marks } from "./marks";
import { ownPose, type Pose, poseOf } from "./pose";
import { openStage, type Stage } from "./stage";

interface Props {
  readonly mesh: RestMesh;
  readonly group: Group;
  readonly surface: Surface;
  readonly ground: Ground;
  readonly hands: Hands;
  readonly radius: number;
  /** Marks; null until somebody has pointed, when their code is loaded. */
  marks: Marks | null;
}

/** Marks of people who point, and the time to compute the marks' age. */
export interface Pointing {
  readonly marks: readonly Mark[];
  /** Present time on the page's clock [s]. */
  readonly now: number;
}

/** Poses of all users; that of the own hand comes from its own loop, which is ahead of the server. */
export function posesOf(view: SceneSnapshot, own: TouchState | null): Pose[] {
  const inRoom = own !== null && own.phase === "joined" && own.user > 0;
  const poses = view.users.filter((user) => !inRoom || user.user !== own.user).map(poseOf);
  if (inRoom) poses.push(ownPose(own, view.users.find((user) => user.user === own.user)));
  return poses;
}

export class SceneView {
  private readonly stage: Stage;
  private readonly labels: Labels;
  private props: Props | null = null;
  private scheme: Scheme = "light";
  private colouring: Colouring = "displacement";
  private shown = "";
  /** Array by which the surface was placed; a different array is of another time, whatever its flag `moved` is. */
  private fetching = false;
  private placed: Float32Array | null = null;
  /** Whether the body has been drawn. */
  drawn = false;

  constructor(stage: Stage, private readonly host: HTMLElement, private readonly colours: UserColours) {
    this.stage = stage;
    stage.placed = (camera) => { this.props?.hands.face(camera); };
    this.labels = new Labels(host, (user) => colours.of(user, this.scheme));
  }

  setScheme(scheme: Scheme): void {
    this.scheme = scheme;
    this.stage.setScheme(scheme);
    this.props?.surface.setScheme(scheme);
    this.props?.ground.setScheme(scheme);
    this.props?.hands.repaint();
    this.labels.repaint();
    this.stage.touch();
  }

  setColouring(colouring: Colouring): void {
    this.colouring = colouring;
    this.props?.surface.setColouring(colouring);
    this.stage.touch();
  }

  get legend(): Legend {
    return this.props?.surface.legend ?? { colouring: this.colouring, low: null, high: null };
  }

  /** Set the body, in place of a former one. */
  setBody(mesh: RestMesh | null, info: Pick<WatchInfo, "body"> | null): void {
    if (mesh === null || info === null || this.props?.mesh === mesh) return;
    this.clear();
    const { center, radius, contact_radius } = info.body;
    const surface = new Surface(mesh, radius, contact_radius);
    const ground = new Ground(mesh, radius);
    const hands = new Hands(radius, contact_radius, (user) => this.colours.of(user, this.scheme));
    surface.setColouring(this.colouring);
    const group = new Group();
    group.add(ground.group, surface.mesh, hands.group);
    this.props = { mesh, group, surface, ground, hands, radius, marks: null };
    this.stage.scene.add(group);
    this.stage.frame(center, radius);
    this.setScheme(this.scheme);
    this.stage.compile();
  }

  /** Show a moment. */
  draw(view: SceneSnapshot | null, own: TouchState | null, dt: number, pointing: Pointing): void {
    if (view !== null) this.point(view, pointing);
    if (view !== null && this.props !== null) {
      const { surface, hands } = this.props;
      if ((view.moved || view.positions !== this.placed) && view.positions.length === this.props.mesh.vertices.length) {
        surface.deform(view.positions);
        this.placed = view.positions;
        this.stage.touch();
      }
      if (surface.learn(view)) this.stage.touch();
      const poses = posesOf(view, own);
      // Hands at rest are not drawn again: a scene where nothing happens costs nothing.
      const key = JSON.stringify(poses.map((p) => [p.user, p.proxy, p.force, p.probe, p.presence].flat().map(short)));
      const drawn = key !== this.shown;
      if (drawn) {
        this.shown = key;
        hands.pose(poses);
        this.stage.touch();
      }
      const anew = this.stage.draw(dt);
      this.drawn ||= anew;
      if (anew || drawn) {
        this.labels.place(poses, (user) => hands.anchor(user), (point) => this.stage.project(point), this.stage.clear);
      }
      return;
    }
    if (this.stage.draw(dt) && this.props !== null) this.drawn = true;
  }

  private point(view: SceneSnapshot, { marks, now }: Pointing): void {
    const { props, stage } = this;
    if (props === null) return;
    if (props.marks === null) {
      if (marks.length > 0 && !this.fetching) void this.fetchMarks();
      return;
    }
    const any = props.marks.any;
    // Grey for people without a hand.
    const colour = (user: number | null): string => (user === null ? WATCHES[this.scheme] : this.colours.of(user, this.scheme));
    props.marks.place(marks, view.positions, now, colour, stage.still, (point) => stage.project(point));
    if (any || props.marks.any) stage.touch();
  }

  /** Load the code for marks, and make them for the body that is there at that time. */
  private async fetchMarks(): Promise<void> {
    this.fetching = true;
    try {
      const code = await import("./marks");
      if (this.props === null) return;
      this.props.marks ??= new code.Marks(this.host, this.props.mesh, this.props.radius);
      this.props.group.add(this.props.marks.group);
    } finally {
      this.fetching = false;
    }
  }

  /** Remove the scene from the page, with its stage. */
  dispose(): void {
    this.clear();
    this.labels.place([], () => null, () => null);
    this.stage.dispose();
  }

  private clear(): void {
    if (this.props === null) return;
    this.stage.scene.remove(this.props.group);
    this.props.surface.dispose();
    this.props.ground.dispose();
    this.props.hands.dispose();
    this.props.marks?.dispose();
    this.props = null;
    this.shown = "";
    this.placed = null;
    this.drawn = false;
  }
}

/** Colour of marks by people without a hand. */
const WATCHES: Readonly<Record<Scheme, string>> = { light: "#3c434b", dark: "#dfe4e9" };

/** A number rounded to a hundredth of a millimetre or of a newton. */
function short(x: number): number {
  return Math.round(1e5 * x);
}

/** Stage and scene in an element of the page; null without WebGL. */
export function openScene(host: HTMLElement, colours: UserColours): { readonly stage: Stage; readonly view: SceneView } | null {
  const stage = openStage(host);
  return stage === null ? null : { stage, view: new SceneView(stage, host, colours) };
}
