// The settings of a data set: where the form shows each, and the body of a request.
// @ts-check
import { bodyOf as bodyOfChanges } from "../studio/settings.js";

/** Settings in sight, those of the scene and those of the camera. A setting of the service that is not here keeps its default. */
export const MAIN = ["flocks", "pictures", "every", "count", "picture", "seed", "presets", "formats"];
export const SCENE = ["backgrounds.plate", "backgrounds.color", "haze_per_bl", "shadow", "scale", "size_px"];
export const CAMERA = ["gain", "color_gain", "blur_px", "noise", "jpeg_quality", "split"];

/** @typedef {import("../studio/settings.js").Settings} Settings @typedef {import("../studio/schema.js").Fields} Fields */

/** Returns what a request sends: the settings that differ from the defaults. @param {Settings} settings @param {Fields} fields @returns {Partial<Api.Schemas["DatasetParams"]>} */
export const bodyOf = (settings, fields) => /** @type {any} */ (bodyOfChanges(Object.fromEntries(Object.entries(settings).filter(([name, value]) => JSON.stringify(value) !== JSON.stringify(fields.get(name)?.default)))));
