/** Asks the visitor for a gamepad and opens it; every failure is described in words. */

import { BLUETOOTH, PRODUCTS, VENDOR } from "./reports";
import type { Hid, HidDevice } from "./webhid";

/** Reason why there is no gamepad, in one or two sentences for the visitor. */
export class NoPad extends Error {
  override readonly name = "NoPad";
}

/** Ask for a gamepad and open it; throws NoPad. Browsers allow this only in answer to a press of the visitor. */
export async function choosePad(hid: Hid): Promise<HidDevice> {
  const filters = PRODUCTS.map((productId) => ({ vendorId: VENDOR, productId }));
  const chosen = await hid.requestDevice({ filters }).catch(() => {
    throw new NoPad("The browser does not let this page ask for a gamepad: a setting of yours or of your organisation forbids it.");
  });
  const [device] = chosen;
  if (device === undefined) throw new NoPad("No gamepad was chosen. Is it a DualSense, connected by cable?");
  if (device.vendorId !== VENDOR || !PRODUCTS.some((product) => product === device.productId)) {
    throw new NoPad(`${device.productName || "That"} is no DualSense.`);
  }
  if (isWireless(device)) throw new NoPad("This DualSense is connected by Bluetooth. Connect it by cable.");
  if (!device.opened) {
    await device.open().catch(() => {
      throw new NoPad("The gamepad cannot be opened. Another program or page may use it; on Linux the right to /dev/hidraw* may be missing.");
    });
  }
  return device;
}

/** Whether the device's description has a report that is sent over Bluetooth only. */
function isWireless({ collections }: HidDevice): boolean {
  return collections.some(({ inputReports }) => inputReports?.some(({ reportId }) => reportId === BLUETOOTH) === true);
}
