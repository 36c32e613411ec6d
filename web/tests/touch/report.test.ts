import { expect, test } from "vitest";
import { ZERO } from "../../src/model/vec";
import { LACKING } from "../../src/touch/loop/chain";
import { loopSettings, START } from "../../src/touch/loop/state";
import { step } from "../../src/touch/loop/step";
import { UNTIMED } from "../../src/touch/network/timing";
import { type Known, reportOf } from "../../src/touch/report";

const [loop, newest] = step(START, { position: ZERO, velocity: ZERO }, 0, loopSettings(0.016, 10, 1, 2000));
const known: Known = {
  connection: { phase: "joined", reason: "", code: 0 },
  settings: {
    url: "", name: "ann", law: "predictive", geometry: "sphere", max_force: 10, friction: 0, passivity: true,
    hand: { mass: 0.15, damping: 8, stiffness: 400 }, target: ZERO,
  },
  welcome: null, place: null, name_refused: "", loop, newest, explains: false, cursor: ZERO, timing: UNTIMED, leaving: false,
  late: { tick_late: 0, loop_stall: 0 }, trace: new Float64Array(), now: 0,
};

test("a force is explained while somebody asks, and not before the first period", () => {
  expect(reportOf(known).explained).toBeNull();
  expect(reportOf({ ...known, newest: null, explains: true }).explained?.ledger).toBeNull();
  const { explained } = reportOf({ ...known, explains: true });
  expect(explained?.lacking).toEqual(LACKING);
  expect(Object.values(explained?.ledger ?? { surface: 1 })).toEqual(Array.from({ length: 10 }, () => 0));
});
