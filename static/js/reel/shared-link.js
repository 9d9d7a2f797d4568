// The address of a shared reel: the flock, and the signatures of the files that its page reads.
// @ts-check

/** Files of the page, and those that it also offers, by the word that stands before their signature. */
export const SHARED = ["video.mp4", "flock.plan"];
export const OFFERED = { webm: "video.webm", mov: "video.mov" };

/**
 * Returns the path of the page. @param {string} id of the flock @param {{name: string, url: string}[]} links signed: those
 *   of the page, and at most one that it offers
 */
export function pathOf(id, links) {
  const parts = links.map(({ name, url }) => {
    const query = new URLSearchParams(url.slice(url.indexOf("?")));
    const word = Object.entries(OFFERED).find(([, file]) => file === name)?.[0];
    return [word, query.get("expires"), query.get("signature")].filter(Boolean).join(".");
  });
  return `/s/${[id, ...parts].join("~")}`;
}

/**
 * Reads the last part of the path. @param {string} text
 * @returns {{files: string[], offered: string | null, expires_s: number} | null} addresses of the files, and the time in
 *   seconds since 1970 at which the first stops to work; null if the text is no such link
 */
export function readLink(text) {
  const found = /^([0-9a-f-]{36})~(\d{1,12})\.([0-9a-f]+)~(\d{1,12})\.([0-9a-f]+)(?:~(webm|mov)\.(\d{1,12})\.([0-9a-f]+))?$/.exec(text);
  if (!found) return null;
  const [, id, ...rest] = found;
  const address = (/** @type {string} */ name, /** @type {string} */ expires, /** @type {string} */ signature) => `/v1/flocks/${id}/${name}?expires=${expires}&signature=${signature}`;
  const files = SHARED.map((name, k) => address(name, rest[2 * k], rest[2 * k + 1]));
  const [word, expires, signature] = rest.slice(4);
  return { files, offered: word ? address(/** @type {Record<string, string>} */ (OFFERED)[word], expires, signature) : null, expires_s: Math.min(...[rest[0], rest[2], expires ?? rest[0]].map(Number)) };
}
