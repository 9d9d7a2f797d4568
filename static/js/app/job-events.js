// The event stream of all jobs. It runs in the page, or in a worker shared by all tabs of a browser.
// @ts-check

/**
 * @typedef {Api.Job | {id: string}} Heard a job; with only its id if it was deleted
 * @typedef {{job?: Heard, live: boolean}} Message not `live` while disconnected
 */

/**
 * Opens the stream, and opens it again when it breaks.
 * @param {(message: Message) => void} tell receives events
 * @returns {() => void} closes the stream
 */
export function openEvents(tell) {
  const events = new EventSource("/v1/events");
  let again = 0;
  let close = () => { clearTimeout(again); events.close(); };
  events.addEventListener("open", () => tell({ live: true }));
  for (const name of ["job", "gone"]) {
    events.addEventListener(name, (event) => tell({ live: true, job: JSON.parse(event.data) }));
  }
  events.addEventListener("error", () => {
    tell({ live: false });
    // EventSource reconnects by itself, except after an error response.
    if (events.readyState === EventSource.CLOSED) again = setTimeout(() => { close = openEvents(tell); }, 5000);
  });
  return () => close();
}
