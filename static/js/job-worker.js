// Shared by all tabs: six connections are all that a browser gives a host, and a stream takes one for good.
// @ts-check
import { openEvents } from "./job-events.js";

/** How many jobs each tab follows. @type {Map<MessagePort, number>} */
const tabs = new Map();
let close = null;
let live = false;

self.onconnect = ({ ports: [port] }) => {
  tabs.set(port, 0);
  port.onmessage = ({ data }) => {
    tabs.set(port, data.following);
    const following = [...tabs.values()].some((count) => count > 0);
    if (following && !close) close = openEvents(tellAll);
    if (!following && close) { close(); close = null; live = false; }
    port.postMessage({ live });
  };
};

function tellAll(message) {
  live = message.live;
  for (const tab of tabs.keys()) tab.postMessage(message);
}
