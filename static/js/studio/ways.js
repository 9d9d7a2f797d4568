// The same flock by other means: the lines for curl, for the command line and for Python, each complete enough to run.
// @ts-check
import { at, bodyOf, textOf } from "./settings.js";

/**
 * @typedef {{id: string, footage_id?: string, params?: Api.AnalysisParams}} Library
 * @typedef {{link: string, origin: string, needsToken?: boolean, defaults?: Api.AnalysisParams}} Place
 *   `needsToken`: the service asks for a token; `defaults` of the parameters of an analysis
 */

/** Formats that keep transparency. */
export const CLEAR = ["webm", "mov", "png"];
/** Settings that are flags of their own on the command line. */
const NOT_SET = ["preset", "render.formats", "render.overlay", "render.ground_truth"];

/** Quotes an argument of a shell where it needs quotes. @param {string} text */
const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

/** @param {[string, unknown]} parameter */
const setting = ([name, value]) => `--set ${quoted(`${name}=${textOf(value)}`)}`;

/** Returns the ways to make a flock. @param {Library} library @param {import("./settings.js").Settings} settings @param {Place} place */
export function waysOf(library, settings, place) {
  const body = JSON.stringify({ library_id: library.id, ...bodyOf(settings) });
  const { link, origin, needsToken = false } = place;
  const token = needsToken ? ` \\\n  -H "Authorization: Bearer $FLOCKREEL_TOKEN"` : "";
  return {
    link,
    curl: `curl ${origin}/v1/flocks -H 'Content-Type: application/json'${token} \\\n  -d ${quoted(body)}`,
    command: [...libraryCommands(library, place), flockCommand(settings)].join("\n"),
    python: pythonOf(body, place),
  };
}

/** Returns the commands that write the library; without its film, it must be there. @param {Library} library @param {Place} place */
function libraryCommands({ footage_id, params = {} }, { origin, needsToken, defaults = {} }) {
  if (!footage_id) return [];
  const changed = Object.entries(params).filter(([name, value]) => JSON.stringify(value) !== JSON.stringify(at(defaults, name) ?? null));
  const token = needsToken ? ` -H "Authorization: Bearer $FLOCKREEL_TOKEN"` : "";
  return [`curl${token} -o film ${origin}/v1/footage/${footage_id}/file`, ["flockreel analyze film -o library", ...changed.map(setting)].join(" \\\n  ")];
}

/** @param {import("./settings.js").Settings} settings */
function flockCommand(settings) {
  const formats = Array.isArray(settings["render.formats"]) ? settings["render.formats"] : [];
  const flags = Object.entries(settings).filter(([name]) => !NOT_SET.includes(name)).map(setting);
  const command = ["flockreel flock library", `-o flock.${endingOf(settings, formats)}`, "--plan flock.json", settings.preset && `--preset ${settings.preset}`, ...flags,
    formats.includes("poster") && "--poster poster.png", settings["render.overlay"] && "--overlay boids.mp4", settings["render.ground_truth"] && "--ground-truth truth"];
  return command.filter(Boolean).join(" \\\n  ");
}

/** Returns the ending of the file: one that keeps transparency if it is asked for. @param {import("./settings.js").Settings} settings @param {string[]} formats */
function endingOf(settings, formats) {
  if (settings["render.background"] !== "transparent") return "mp4";
  const clear = formats.find((one) => CLEAR.includes(one)) ?? "webm";
  return clear === "png" ? "zip" : clear;
}

/** Returns a program that waits for the flock and saves its film and plan. @param {string} body @param {Place} place */
function pythonOf(body, { origin, needsToken }) {
  return `import json, ${needsToken ? "os, " : ""}time, urllib.request

service = "${origin}"
headers = {"Content-Type": "application/json"${needsToken ? `, "Authorization": "Bearer " + os.environ["FLOCKREEL_TOKEN"]` : ""}}
body = json.loads(r'''${body.replaceAll("'''", "''\\u0027")}''')

def call(path, body=None):
    data = body and json.dumps(body).encode()
    return urllib.request.urlopen(urllib.request.Request(service + path, data, headers)).read()

made = json.loads(call("/v1/flocks", body))
while True:
    job = json.loads(call("/v1/jobs/" + made["job_id"]))
    if job["state"] in ("done", "failed", "cancelled"):
        break
    time.sleep(1)
if job["state"] != "done":
    raise SystemExit(job["error"] or job["state"])
for name in ("video.mp4", "flock.json"):
    with open(name, "wb") as file:
        file.write(call("/v1/flocks/" + made["flock_id"] + "/" + name))`;
}
