// The address of a shared reel: the flock, and the signatures of the files that its page reads. Everything is packed in
// base64url, so that the address is short enough for a chat: 111 characters with a transparent film.
// @ts-check

/** Files of the page, and those that it also offers, by the word that stands before their signature. */
export const SHARED = ["video.mp4", "flock.plan"];
export const OFFERED = { webm: "video.webm", mov: "video.mov" };

/** A packed file: 4 bytes of expiry (seconds since 1970) and 16 bytes of signature. */
const PACKED = "[\\w-]{27}";
const LINK = RegExp(`^([\\w-]{22})~(${PACKED})~(${PACKED})((?:~(?:webm|mov)\\.${PACKED})*)$`);

/** @param {number[] | Uint8Array} bytes */
const packed = (bytes) => btoa(String.fromCharCode(...bytes)).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
/** @param {string} text */
const unpacked = (text) => Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (one) => one.charCodeAt(0));
/** @param {string} text hexadecimal */
const bytesOf = (text) => (text.match(/../g) ?? []).map((pair) => parseInt(pair, 16));
/** @param {Uint8Array} bytes */
const hex = (bytes) => Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");

/**
 * Returns the path of the page.
 * @param {string} id of the flock @param {{name: string, url: string}[]} links signed: those of the page, and those that it offers
 */
export function pathOf(id, links) {
  const parts = links.map(({ name, url }) => {
    const query = new URLSearchParams(url.slice(url.indexOf("?")));
    const word = Object.entries(OFFERED).find(([, file]) => file === name)?.[0];
    const file = packed(bytesOf(Number(query.get("expires")).toString(16).padStart(8, "0") + query.get("signature")));
    return word ? `${word}.${file}` : file;
  });
  return `/s/${[packed(bytesOf(id.replaceAll("-", ""))), ...parts].join("~")}`;
}

/**
 * Reads the last part of the path. @param {string} text
 * @returns {{files: string[], offered: Record<string, string>, expires_s: number} | null} addresses of the files, of
 *   those that are offered by their words, and the time in seconds since 1970 at which the first stops to work; null if
 *   the text is no such link
 */
export function readLink(text) {
  const found = LINK.exec(text);
  if (!found) return null;
  const [, flock, video, plan, more] = found;
  const id = hex(unpacked(flock)).replace(/^(.{8})(.{4})(.{4})(.{4})(.{12})$/, "$1-$2-$3-$4-$5");
  let expires_s = Infinity;
  const address = (/** @type {string} */ name, /** @type {string} */ file) => {
    const [expires, signature] = [unpacked(file).subarray(0, 4), unpacked(file).subarray(4)].map(hex);
    expires_s = Math.min(expires_s, parseInt(expires, 16));
    return `/v1/flocks/${id}/${name}?expires=${parseInt(expires, 16)}&signature=${signature}`;
  };
  const files = SHARED.map((name, k) => address(name, [video, plan][k]));
  const offered = Object.fromEntries(more.split("~").slice(1).map((part) => {
    const [word, file] = part.split(".");
    return [word, address(/** @type {Record<string, string>} */ (OFFERED)[word], file)];
  }));
  return { files, offered, expires_s };
}
