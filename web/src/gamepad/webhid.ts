/** The parts of WebHID that the page uses; the types of the DOM do not have them yet. */

export interface HidReportEvent {
  readonly reportId: number;
  /** The report without its id. */
  readonly data: DataView;
}

export interface HidDevice {
  readonly opened: boolean;
  readonly vendorId: number;
  readonly productId: number;
  readonly productName: string;
  readonly collections: readonly { readonly inputReports?: readonly { readonly reportId?: number }[] }[];
  oninputreport: ((event: HidReportEvent) => void) | null;
  open(): Promise<void>;
  close(): Promise<void>;
  /** @param data The report without its id. */
  sendReport(id: number, data: Uint8Array<ArrayBuffer>): Promise<void>;
}

export interface Hid {
  requestDevice(options: { readonly filters: readonly { readonly vendorId: number; readonly productId: number }[] }): Promise<readonly HidDevice[]>;
  ondisconnect: ((event: { readonly device: HidDevice }) => void) | null;
}

/** WebHID of this browser; null where it has none, and on a page that did not come over a secure connection. */
export function webHid(navigator: object): Hid | null {
  return (navigator as { readonly hid?: Hid }).hid ?? null;
}
