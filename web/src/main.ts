/** Where the page begins: which server, what to watch, and with what to touch. */

import { Page } from "./page/page";
import { startTouch } from "./touch/handle";
import { openWatch } from "./watch/connection";

const address = location.href;
new Page({ address, openStore: () => openWatch(address, "forces"), startTouch });
