// The settings of a flock, read from the schema of the service.
// @ts-check
import { get } from "../app/api.js";
import { wordsOfService } from "../app/words.js";
import { proseLimits } from "./limits.js";

/**
 * @typedef {{name: string, kind: "number" | "whole" | "boolean" | "choice" | "numbers" | "group" | "other", min: number, max: number,
 *   step: number, choices: string[], default: any, nullable: boolean, help: string, words?: string}} Field words: name of its words, if they are not its own
 * @typedef {Api.JsonSchema} Schema
 * @typedef {Map<string, Field>} Fields by name, with dots between levels
 */

/** Presets of a service that does not list them. */
const PRESETS = ["school", "swarm", "mill", "scatter", "zonal", "papers"];

/** @type {Promise<Record<string, Schema>> | null} */
let known = null;

/** Returns the schemas of the service, which is asked once. */
function load() {
  known ??= get("/openapi.json").then(({ components }) => components.schemas);
  known.catch(() => { known = null; });
  return known;
}

/** Returns the fields of a flock, a virtual fish, a data set, or an analysis. @param {"Flock" | "Fish" | "Dataset" | "Analysis"} [kind] @returns {Promise<Fields>} */
export async function loadFields(kind = "Flock") {
  const [schemas] = await Promise.all([load(), wordsOfService()]);
  return fieldsOf(schemas, `${kind}Params`, kind === "Analysis" ? "AnalysisOverrides" : `${kind}Request`);
}

/** Returns the defaults of the parameters of an analysis by name. @returns {Promise<Api.AnalysisParams>} */
export const analysisDefaults = async () => defaultsOf((await load()).AnalysisParams);

/** @param {Schema | undefined} schema */
const defaultsOf = (schema) => Object.fromEntries(Object.entries(schema?.properties ?? {}).map(([name, property]) => [name, property.default ?? null]));

/** @param {Record<string, Schema>} schemas @param {string} params name of the schema of the settings @param {string} request the one that has the presets @returns {Fields} */
function fieldsOf(schemas, params, request) {
  /** @type {Fields} */
  const fields = new Map();
  const collect = (/** @type {Schema} */ schema, /** @type {string} */ prefix, /** @type {Record<string, unknown> | null} */ defaults) => {
    for (const [key, property] of Object.entries(schema.properties ?? {})) {
      const name = prefix + key;
      const { type, nullable } = plain(property, schemas);
      const own = property.default ?? defaults?.[key] ?? null;
      const isGroup = type.type === "object" && name !== "predator";
      const field = fieldOf(name, { ...type, description: property.description ?? type.description }, own, nullable);
      if (type.items) field.choices = choicesOf(plain(type.items, schemas).type.enum);
      fields.set(name, isGroup ? { ...field, kind: "group" } : field);
      if (isGroup) collect(type, `${name}.`, /** @type {Record<string, unknown> | null} */ (own));
    }
  };
  collect(schemas[params], "", null);
  const preset = schemas[request]?.properties?.preset ?? {};
  const choices = choicesOf(plain(preset, schemas).type.enum ?? PRESETS);
  fields.set("preset", { ...fieldOf("preset", { ...preset, type: "string" }, null, true), kind: "choice", choices });
  return fields;
}

/** Follows references and takes null away. @param {Schema} schema @param {Record<string, Schema>} schemas */
function plain(schema, schemas) {
  let nullable = false;
  let type = schema;
  for (let depth = 0; depth < 8; depth++) {
    const list = type.oneOf ?? type.anyOf;
    if (type.$ref) type = { ...schemas[type.$ref.split("/").at(-1) ?? ""] };
    else if (list?.some((one) => one.type === "null")) {
      nullable = true;
      type = list.find((one) => one.type !== "null") ?? {};
    } else if (type.allOf?.length === 1) [type] = type.allOf;
    else break;
  }
  if (Array.isArray(type.type)) {
    nullable ||= type.type.includes("null");
    type = { ...type, type: type.type.find((one) => one !== "null") };
  }
  return { type, nullable };
}

/** @param {string} name @param {Schema} type @param {unknown} value its default @param {boolean} nullable @returns {Field} */
function fieldOf(name, type, value, nullable) {
  const [min, max] = limitsOf(name, type);
  const isNumber = type.type === "number" || type.type === "integer";
  const kind = type.type === "integer" ? "whole" : isNumber ? "number" : type.type === "boolean" ? "boolean" : type.enum ? "choice" : isList(type) ? "numbers" : "other";
  const step = type.multipleOf ?? (name === "fade_frames" ? 2 : kind === "whole" ? 1 : max <= 1 ? 0.01 : 0.05);
  return { name, kind, min, max, step, choices: choicesOf(type.enum), default: value, nullable, help: tidy(type.description) };
}

/** Whether a value is a list of as many numbers as its schema says. @param {Schema} type */
const isList = ({ items, minItems }) => Boolean(minItems) && (items?.type === "number" || items?.type === "integer");

/** Returns the choices of an enumeration; null is none. @param {(string | null)[]} [all] */
const choicesOf = (all = []) => all.flatMap((one) => one || []);

/** @param {string} name @param {Schema} type */
function limitsOf(name, type) {
  const min = type.minimum ?? type.exclusiveMinimum;
  const max = type.maximum ?? type.exclusiveMaximum;
  if (min !== undefined && max !== undefined) return [min, max];
  if (name === "seed") return [0, Number.MAX_SAFE_INTEGER];
  return proseLimits(name);
}

/** @param {string | undefined} text a description with line ends and marks of code */
const tidy = (text = "") => text.replace(/\s+/g, " ").replaceAll("`", "").trim();
