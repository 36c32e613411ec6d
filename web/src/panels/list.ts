/** The panels of the page, one a line. Of two in one place the earlier one comes first. */

import type { Panel } from "../page/panels";
import { beside } from "./beside";
import { dialog } from "./dialog";
import { dock } from "./dock";
import { gamepad } from "./gamepad";
import { ghost } from "./ghost";
import { legend } from "./legend";
import { notice } from "./notice";
import { upload } from "./upload";

export const PANELS: readonly Panel[] = [
  ghost, // the gesture, for who has never pressed
  beside, // offers to who is alone
  notice, // the most urgent trouble, with a remedy
  dock, // controls and force of the visitor's hand
  legend, // colours of the surface, and the switch between them
  dialog("help", async () => new (await import("../ui/help")).Help()),
  upload, // an object of the visitor's own
  gamepad, // the visitor's hand by a gamepad, and the force as rumble
  dialog("share", async ({ settings, visitor }) => new (await import("../ui/share/dialog")).ShareDialog(settings, () => visitor.name)),
];
