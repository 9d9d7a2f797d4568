// Lenses: how a point before a camera falls on a picture. A lens holds two quadruples for the vertex shader: the
// zoom and shift of x and y, then the front pane, the refractive index behind it, and the nearest and farthest depth.
// @ts-check

/** @typedef {{across: number[], depths: number[]}} Lens */

/** Vertical field of view of the free camera, radians. */
const FREE_RAD = 0.6;

/** Returns the lens of the free camera. @param {number} aspect width / height @param {number} reach the depth of the fish, metres @returns {Lens} */
export function freeLens(aspect, reach) {
  const zoom = 1 / Math.tan(FREE_RAD / 2);
  return { across: [zoom / aspect, zoom, 0, 0], depths: [0, 1, reach / 50, reach * 50] };
}

/** Returns the depth at which the free camera sees a ball whole. @param {number} radius @param {number} aspect */
export const depthFor = (radius, aspect) => radius / Math.sin(FREE_RAD / 2) / Math.min(1, aspect);

/**
 * Returns the lens of the camera that filmed the animal, or null if it is unknown.
 * @param {Api.Schemas["CameraParams"] | null | undefined} camera the measured one, of the parameters of the analysis @param {number | null} yfov of the file, radians
 * @param {number[]} size of the film, pixels @param {number} reach the farthest depth that matters, metres @returns {Lens | null}
 */
export function filmLens(camera, yfov, [width, height], reach) {
  const focal_px = camera ? camera.pane_px_per_m * camera.z_min_m : yfov ? height / 2 / Math.tan(yfov / 2) : null;
  if (!focal_px) return null;
  const [x, y] = camera?.center_px ?? [width / 2, height / 2];
  const [pane_m, index] = camera ? [camera.z_min_m, camera.medium_index ?? 1] : [0, 1];
  return { across: [(2 * focal_px) / width, (2 * focal_px) / height, (2 * x) / width - 1, 1 - (2 * y) / height], depths: [pane_m, index, reach / 200, reach * 20] };
}

/** Returns where a lens shows a point before the camera, from 0 to 1 across and down. @param {Lens} lens @param {number[]} point y up, the camera looks along -z */
export function seenAt({ across: [zoomX, zoomY, shiftX, shiftY], depths: [pane, index] }, [x, y, z]) {
  const depth = pane + (-z - pane) / index;
  return [(1 + (zoomX * x) / depth + shiftX) / 2, (1 - (zoomY * y) / depth - shiftY) / 2];
}
