// The address of a shared reel: the flock, and the signatures of the files that its page reads.
// @ts-check

/** Files of the page. */
export const SHARED = ["video.mp4", "flock.plan"];

/**
 * Returns the path of the page. @param {string} id of the flock @param {{url: string}[]} links signed, one of each file
 */
export function pathOf(id, links) {
  const signatures = links.map(({ url }) => {
    const query = new URLSearchParams(url.slice(url.indexOf("?")));
    return `${query.get("expires")}.${query.get("signature")}`;
  });
  return `/s/${[id, ...signatures].join("~")}`;
}

/**
 * Reads the last part of the path. @param {string} text
 * @returns {{files: string[], expires_s: number} | null} addresses of the files, and the time in seconds since
 *   1970 at which the first stops to work; null if the text is no such link
 */
export function readLink(text) {
  const found = /^([0-9a-f-]{36})~(\d{1,12})\.([0-9a-f]+)~(\d{1,12})\.([0-9a-f]+)$/.exec(text);
  if (!found) return null;
  const [, id, ...rest] = found;
  const files = SHARED.map((name, k) => `/v1/flocks/${id}/${name}?expires=${rest[2 * k]}&signature=${rest[2 * k + 1]}`);
  return { files, expires_s: Math.min(Number(rest[0]), Number(rest[2])) };
}
