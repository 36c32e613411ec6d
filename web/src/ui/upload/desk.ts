/** Brings a visitor's object to the server: the dialog, the picture, the connection, and files that are dropped. */

import { socketUrl } from "../../address";
import { UPLOAD_SUBPROTOCOL } from "../../upload/messages";
import { UploadDialog } from "./dialog";
import { UploadClient, type UploadNews } from "../../upload/client";
import type { Preview } from "../../view/preview";

type Shown = Extract<UploadNews, { type: "shown" }>;

export class UploadDesk {
  readonly dialog: UploadDialog;
  private preview: Preview | null = null;
  private client: UploadClient | null = null;
  private newest: UploadNews | null = null;
  private allowed = false;

  /**
   * @param address Address of the server, http: or https:.
   * @param touch Brings the visitor's hand into the room.
   */
  constructor(private readonly address: string, touch: () => void) {
    this.dialog = new UploadDialog({
      chosen: (file) => { this.bring(file); },
      prepare: (wish) => { this.client?.prepare(wish); },
      cancel: () => { this.cancel(); },
      touch,
      held: (layer) => { this.preview?.hold(layer === null ? { by: "paint" } : { by: "layer", layer }); },
      cleared: () => { this.preview?.refresh(); },
      sized: (larger) => this.preview?.compare(larger) ?? "",
    });
    addEventListener("dragover", (event) => { this.over(event); });
    addEventListener("dragleave", () => { this.dialog.root.classList.remove("over"); });
    addEventListener("drop", (event) => { this.dropped(event); });
  }

  /** Set whether the server accepts files. */
  allow(allowed: boolean): void {
    this.allowed = allowed;
  }

  open(): void {
    if (this.allowed) this.dialog.open();
  }

  private over(event: DragEvent): void {
    if (!this.allowed || event.dataTransfer?.types.includes("Files") !== true) return;
    event.preventDefault();
    this.dialog.open();
    this.dialog.root.classList.add("over");
  }

  private dropped(event: DragEvent): void {
    const [file] = event.dataTransfer?.files ?? [];
    if (!this.allowed || file === undefined) return;
    event.preventDefault();
    this.dialog.root.classList.remove("over");
    this.dialog.open();
    this.bring(file);
  }

  private bring(file: File): void {
    this.cancel();
    this.dialog.news({ type: "sending", share: 0 });
    this.client = new UploadClient(file, {
      later: (seconds, action) => { setTimeout(action, 1000 * seconds); },
      socket: () => new WebSocket(socketUrl(this.address), UPLOAD_SUBPROTOCOL),
    }, (news) => { this.hear(news); });
  }

  private hear(news: UploadNews): void {
    this.newest = news;
    if (news.type !== "shown") {
      this.dialog.news(news);
      return;
    }
    // The picture's code is loaded only for visitors who bring something; if that fails, they go on without a picture.
    import("../../view/preview").then(
      ({ Preview }) => { if (this.newest === news) this.show(news, Preview); },
      () => { if (this.newest === news) this.dialog.news(news); },
    );
  }

  private show(news: Shown, Picture: typeof Preview): void {
    this.dialog.news(news);
    // The picture is made only now, because it takes a graphics context.
    this.preview ??= new Picture(this.dialog.host, () => { this.dialog.refresh(this.preview?.painting ?? null); });
    this.preview.show(news.mesh);
    this.dialog.refresh(this.preview.painting);
    this.dialog.news(news);
    this.preview.run(true);
  }

  private cancel(): void {
    this.client?.cancel();
    this.client = this.newest = null;
    this.preview?.run(false);
    this.preview?.clear();
  }
}
