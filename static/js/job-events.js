// The one stream of a browser's jobs: here in the page, or in a worker that all its tabs share.
// @ts-check

/**
 * Opens the stream and opens it again when it breaks.
 * @param {(message: {job?: any, live: boolean}) => void} tell what was heard; `live` is false while nothing can be
 * @returns {() => void} closes it
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
    // A browser comes back by itself unless the answer was a refusal.
    if (events.readyState === EventSource.CLOSED) again = setTimeout(() => { close = openEvents(tell); }, 5000);
  });
  return () => close();
}
