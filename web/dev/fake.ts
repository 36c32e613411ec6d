import type { SceneStore, SceneView, TouchHandle, TouchState, UserState, Vec3 } from "../src/types";
import { split, place } from "../src/view/refine";
import { Page } from "../src/page/page";
import "../src/styles.css";

function ico(sub: number, r: number) {
  const t = (1 + Math.sqrt(5)) / 2;
  let v: number[] = [-1,t,0,1,t,0,-1,-t,0,1,-t,0,0,-1,t,0,1,t,0,-1,-t,0,1,-t,t,0,-1,t,0,1,-t,0,-1,-t,0,1];
  let f = Uint32Array.from([0,11,5,0,5,1,0,1,7,0,7,10,0,10,11,1,5,9,5,11,4,11,10,2,10,7,6,7,1,8,3,9,4,3,4,2,3,2,6,3,6,8,3,8,9,4,9,5,2,4,11,6,2,10,8,6,7,9,8,1]);
  let p = Float32Array.from(v);
  const norm = () => { for (let i=0;i<p.length;i+=3){ const l=Math.hypot(p[i]!,p[i+1]!,p[i+2]!); p[i]!*=r/l; p[i+1]!*=r/l; p[i+2]!*=r/l; } };
  norm();
  for (let s=0;s<sub;s++){ const h=split(p.length/3,f); const o=new Float32Array(3*(h.coarse+h.edges.length/2)); place(h,p,new Float32Array(p.length),o); p=o; f=h.faces; norm(); }
  return { vertices: p, faces: f };
}
const mesh = ico(3, 0.1);
const n = mesh.vertices.length / 3;
const positions = new Float32Array(mesh.vertices);
const own = { target: [0,0,0] as Vec3, on: false, force: 0, dir: [0,-1,0] as Vec3, depth: 0 };
const q = new URLSearchParams(location.search);
function user(id: number, name: string, d: Vec3, depth: number, law: UserState["law"]): UserState {
  const c = 1/251;
  const f = Math.max(0, depth) * 170;
  const foot: Vec3 = [0.1*d[0],0.1*d[1],0.1*d[2]];
  const probe: Vec3 = [foot[0]-depth*d[0], foot[1]-depth*d[1], foot[2]-depth*d[2]];
  const xf = 0.1 - depth + c*f;
  return { user:id, name, probe, foot, x_free:[xf*d[0],xf*d[1],xf*d[2]], normal:d, force:[f*d[0],f*d[1],f*d[2]], c_ii:c, k_o_coupled:141, k_h: law==="predictive"?251:127, integral_gain: law==="pi"?2600:0, loop_delay:0.182+0.01*Math.sin(id), curvature:8, law, geometry:"sphere", fresh:true, friction:false, presence:1, latency:{delay:0.08,jitter:0} };
}
const listeners = new Set<() => void>();
const store = {
  status: { phase: q.get("phase") ?? "watching", code: Number(q.get("code") ?? 0), reason: q.get("reason") ?? "", retry_at: 1e9, frames: 0, bytes: 0, frames_per_second: 30, bytes_per_second: 5400, playout_delay: 0.066, encoding: "forces", blocks: 4, blocks_wanted: 0 },
  info: { body: { name: "balloon", center: [0,0,0], radius: 0.1, contact_radius: 0.02 }, simulation_period: 1/60, model: "x", allow_latency: !q.has("strict"), allow_fixed_gains: !q.has("strict") },
  mesh, events: [], get roster() { return [{user:1,name:"left"},{user:2,name:"right"}]; },
  at(now: number): SceneView {
    const users = [user(1,"left",[-1,0,0],0.012+0.008*Math.sin(2*now),"predictive"), user(2,"right",[1,0,0],0.01+0.002*Math.sin(2*now+.3),"proportional")];
    if (own.on) users.push({...user(3,"calm otter",own.dir,own.depth,"predictive"), law: q.get("law") as never ?? "predictive"});
    positions.set(mesh.vertices);
    for (const u of users) for (let i=0;i<3*n;i+=3) {
      const d = Math.hypot(mesh.vertices[i]!-u.foot[0],mesh.vertices[i+1]!-u.foot[1],mesh.vertices[i+2]!-u.foot[2]);
      const a = u.force[0]*u.normal[0]+u.force[1]*u.normal[1]+u.force[2]*u.normal[2];
      const w = (a/170)*(1.15*Math.exp(-d*d/0.0022)-0.15) * Math.min(1,Math.max(0,(mesh.vertices[i+2]!+0.09)/0.03));
      for (let k=0;k<3;k++) positions[i+k]! -= w*u.normal[k]!;
    }
    return { t_server: now, positions, moved: true, users };
  },
  history: () => null, setView() {}, setLatency(u: number, l: unknown) { console.log("latency", u, JSON.stringify(l)); },
  subscribe(l: () => void) { listeners.add(l); return () => listeners.delete(l); }, close() {},
} as unknown as SceneStore;
function startTouch(s: { name: string; target: Vec3 }): TouchHandle {
  own.on = true; const subs = new Set<() => void>(); let law = "predictive";
  const h = { get state(): TouchState {
      const t = own.target; const l = Math.hypot(...t); own.dir = [t[0]/l,t[1]/l,t[2]/l]; own.depth = Math.max(0,(0.1-l)*0.7); const f = own.depth*170;
      const p = l < 0.1 ? 0.1-own.depth : l;
      const d = own.dir;
      return { phase:"joined", code:0, reason:"", doing: own.depth>0?"touching":"free", user:3, name:s.name, t:0, target:t, probe:[p*d[0],p*d[1],p*d[2]], proxy:[(p+.002)*d[0],(p+.002)*d[1],(p+.002)*d[2]], normal:d, force:[f*d[0],f*d[1],f*d[2]], felt_from_others:0.4*f, depth:own.depth, indentation:own.depth*0.9, u_others:0.001, law:law, law_wanted:law, k_o:251,k_o_coupled:141,k_h:170,integral_gain:0,damping:0,owed:0,scale:1,fault:"",round_trip:.18,jitter:0,clock_offset:0,simulation_period:1/60,loop_hz:1000,missed:0,trace:new Float64Array() } as unknown as TouchState; },
    point(t: Vec3) { own.target = t; }, setLaw(l: string) { law = l; }, setHand() {}, subscribe(l: () => void) { subs.add(l); return () => subs.delete(l); }, close() { own.on = false; return Promise.resolve(); } };
  own.target = s.target;
  return h as unknown as TouchHandle;
}
(window as unknown as { page: Page }).page = new Page({ url: "ws://x", store, startTouch: startTouch as never });
