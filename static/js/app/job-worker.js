// A worker shared by all tabs. Browsers allow six connections per host, and each event stream takes one.
// @ts-check
import { openEvents } from "./job-events.js";

/** Ports of the listening tabs. @type {Set<MessagePort>} */
const tabs = new Set();
/** @type {(() => void) | null} */
let close = null;
let live = false;

/** @type {any} */ (self).onconnect = (/** @type {MessageEvent} */ { ports: [port] }) => {
  port.onmessage = ({ data }) => {
    if (data.listening) tabs.add(port); else tabs.delete(port);
    if (tabs.size && !close) close = openEvents(tellAll);
    if (!tabs.size && close) { close(); close = null; live = false; }
    port.postMessage({ live });
  };
};

/** @param {import("./job-events.js").Message} message */
function tellAll(message) {
  live = message.live;
  for (const tab of tabs) tab.postMessage(message);
}
