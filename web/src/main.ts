/** Entry point: opens the page on the server that delivered it. */

import { Page } from "./page/page";
import { prepareTouch, startTouch } from "./touch/handle";
import { openWatch } from "./watch/connection";

const address = location.href;
new Page({ address, openStore: () => openWatch(address, "forces"), startTouch, prepareTouch });
