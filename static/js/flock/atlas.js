// Loads an atlas: the animal of every playable frame, packed into a few pictures
// (docs/reference/formats.md, "Atlas").
// @ts-check
import { request } from "../app/api.js";

/**
 * @typedef {{page: number, x: number, y: number, w: number, h: number, cx: number, cy: number}} Sprite its box
 *   and its centroid (cx, cy), pixels of the page
 * @typedef {{scale: number, pages: ImageBitmap[], spriteOf: (sourceFrame: number) => Sprite | null,
 *   close: () => void}} Atlas scale: pixels of a page per pixel of the film
 */

/**
 * @param {string} base address of the folder, ending in a slash
 * @param {{small?: boolean, signal?: AbortSignal}} [options] small: the sheet for small canvases
 * @returns {Promise<Atlas>}
 */
export async function loadAtlas(base, { small = false, signal } = {}) {
  /** @type {Api.AtlasFile} */
  const table = await (await request("GET", `${base}atlas.json`, { signal })).json();
  const sheet = /** @type {Api.AtlasSheet} */ (table.sheets?.at(small ? -1 : 0));
  const spriteOf = lookup(table, sheet);
  const loads = await Promise.allSettled(sheet.pages.map(async ({ file }) => {
    const blob = await (await request("GET", base + encodeURIComponent(file), { signal })).blob();
    // Premultiplied, so that interpolation never mixes in the color of transparent pixels.
    return createImageBitmap(blob, { premultiplyAlpha: "premultiply", colorSpaceConversion: "none" });
  }));
  const pages = loads.flatMap((load) => (load.status === "fulfilled" ? [load.value] : []));
  const close = () => { for (const page of pages) page.close(); };
  const failed = loads.find((load) => load.status === "rejected");
  if (failed || signal?.aborted) {
    close();
    throw failed?.reason ?? signal?.reason;
  }
  return { scale: sheet.scale, pages, spriteOf, close };
}

/** Returns the function that finds sprites; null for a frame that the atlas lacks. @param {Api.AtlasFile} table @param {Api.AtlasSheet} sheet */
export function lookup(table, sheet) {
  if (table.schema !== "flockreel/atlas@1" || !sheet?.pages?.length) throw new Error("The atlas cannot be read.");
  /** @type {Map<number, Sprite>} */
  const sprites = new Map();
  for (const [k, frame] of table.frame.entries()) {
    const [page, x, y, w, h] = /** @type {const} */ (["page", "x", "y", "w", "h"]).map((name) => sheet[name][k]);
    const [width, height] = sheet.pages[page]?.size_px ?? [0, 0];
    if (!(x >= 0 && y >= 0 && w > 0 && h > 0 && x + w <= width && y + h <= height)) throw new Error(`The atlas cannot be read: frame ${frame} is not on its page.`);
    const [cx, cy] = table.center_px[k];
    sprites.set(frame, { page, x, y, w, h, cx: x + cx * sheet.scale, cy: y + cy * sheet.scale });
  }
  return (/** @type {number} */ sourceFrame) => sprites.get(sourceFrame) ?? null;
}
