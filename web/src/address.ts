/** Addresses of the server that a page belongs to. */

/** Websocket URL of the server at an http or ws address, with the page's path: the server may be behind a proxy. */
export function socketUrl(address: string): string {
  const url = folder(address);
  url.protocol = url.protocol.replace("http", "ws");
  return url.href;
}

/** URL of the Green's functions of some vertices of a model. */
export function greenUrl(address: string, model: string, vertices: readonly number[]): string {
  const url = folder(address);
  url.protocol = url.protocol.replace("ws", "http");
  return new URL(`v1/models/${model}/green/${vertices.join(",")}`, url).href;
}

/** The address up to its last slash, without query and fragment. */
function folder(address: string): URL {
  const url = new URL(".", address);
  url.search = "";
  url.hash = "";
  return url;
}
