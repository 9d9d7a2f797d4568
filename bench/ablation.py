#!/usr/bin/env python3
"""Measures what each rule of the measurement contributes, by switching off one rule at a time on a few films.

    ablation.py GENERATOR [--footage FOLDER] [--films FOLDER] [--jobs N]

One program is built from a copy of the sources in which every rule of ablation.toml has a switch. It reports which
switches a film reads, and a rule is tried on these films only. The films are the first seconds of films of cases.py
and of labeled recordings. Scores are kept in target/ablation for as long as the program is unchanged, so an
interrupted run goes on where it was. Writes bench/results/ablation.json and its section of docs/measurements.md.
"""
import argparse, concurrent.futures, hashlib, json, math, os, pathlib, re, shutil, statistics, subprocess, tomllib, zipfile

import cv2
import numpy as np

from accuracy import analyzed, overlaps, quantile, score_case, score_labels
import cases
from flocks import halo
from table import table

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
PLACE = ROOT / "target" / "ablation"
SOURCES = PLACE / "sources"
SWITCH = """
/// Whether the rule of that name is switched off.
#[doc(hidden)]
pub fn rule_off(name: &str) -> bool {
    static OFF: std::sync::OnceLock<String> = std::sync::OnceLock::new();
    let off = OFF.get_or_init(|| std::env::var("FLOCKREEL_RULE_OFF").unwrap_or_default());
    if off == "none" {
        eprintln!("reads the switch {name}");
    }
    off == name
}
"""
# Films and the seconds of them that are analyzed.
CASES = {"title_card-3002": 6, "camera_bump-3002": 10, "lights_dim-3002": 10, "infrared-3002": 10, "mains_banding-3002": 5,
         "resting_animal-3002": 10, "hand_at_start-3002": 6, "tether-3002": 5, "surface_mirror-3002": 10, "large_animal-3022": 5,
         "silver-3": 6, "station-2": 8, "cast_shadow-1": 8, "plants-2": 8, "shoal-1": 6, "pecking-1": 8, "ripple-3": 8}
CLIPS = {"mouse_round_arena": 12, "mouse_homecage_bedding": 10, "zebrafish_juvenile_single": 8}
# The film whose camera and animal are known to the program, so that it measures directions in space.
CALIBRATED = "silver-3"
# Smallest change of a film's score that counts, points of 100 or degrees. A refusal always counts. Free choice.
CLEARLY = 1.0


def off(name):
    """Returns the expression that reads the switch of a rule. It caches the result for use in inner loops."""
    return ("({ static OFF: std::sync::OnceLock<bool> = std::sync::OnceLock::new(); "
            f'*OFF.get_or_init(|| crate::rule_off("{name}")) }})')


def lay_out(rules):
    """Writes the sources with their switches. Unchanged files keep their time, removed ones are deleted."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    texts = {name: (ROOT / name).read_bytes() for name in filter(None, listed.split("\0")) if (ROOT / name).is_file()}
    for rule in rules:
        text = texts[rule["file"]].decode()
        assert text.count(rule["old"]) == 1, f"{rule['name']}: stands {text.count(rule['old'])} times in {rule['file']}"
        new = re.sub(r"\bOFF\[([a-z-]+)\]", lambda match: off(match[1]), rule["new"])
        new = re.sub(r"\bOFF\b(?! [:.])(?!\.get)", off(rule["name"]), new) if "names" not in rule else new
        texts[rule["file"]] = text.replace(rule["old"], new).encode()
    texts["crates/flockreel-core/src/lib.rs"] += SWITCH.encode()
    for path in SOURCES.rglob("*.rs") if SOURCES.is_dir() else []:
        name = path.relative_to(SOURCES)
        if str(name) not in texts and name.parts[0] != "target":
            path.unlink()
    for name, text in texts.items():
        path = SOURCES / name
        if not path.is_file() or path.read_bytes() != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
    shutil.copytree(ROOT / "target" / "vendor", SOURCES / "target" / "vendor", dirs_exist_ok=True)


def build():
    """Builds the program in the profile of tests, which optimizes the algorithms, without its slow checks."""
    words = ["cargo", "build", "--locked", "--bin", "flockreel"]
    for check in ("overflow-checks", "debug-assertions"):
        words += ["--config", f"profile.dev.package.flockreel-core.{check}=false"]
    subprocess.run(words, cwd=SOURCES, env={**os.environ, "CARGO_TARGET_DIR": str(PLACE / "target")}, check=True)
    return PLACE / "target" / "debug" / "flockreel"


def mattes_halo(library):
    """Returns the share of alpha that is far outside the contour of the mattes."""
    with zipfile.ZipFile(library / "mattes.zip") as archive:
        pictures = (cv2.imdecode(np.frombuffer(archive.read(name), np.uint8), cv2.IMREAD_UNCHANGED) for name in archive.namelist())
        alphas = [rgba[..., 3] for rgba in pictures if rgba is not None and rgba.ndim == 3 and rgba.shape[2] == 4]
        return halo([alpha for alpha in alphas if alpha.any()])


def direction_deg(poses, truth):
    """Returns the median angle between the measured and the true direction in space, degrees; 0 without either."""
    angles = [math.degrees(math.acos(max(-1, min(1, sum(a * b for a, b in zip(pose["forward"], row["forward"]))))))
              for pose, row in zip(poses["frames"], truth["frames"]) if pose.get("forward") and any(row.get("forward", ()))]
    return quantile(angles, .5) or 0.0


def measure(program, film, rule):
    """Returns scores in points of 100 (frames right, heads right, halo, ...) or degrees, or the code of a refusal.

    `reads` are the rules whose switches were read, if `rule` is "none".
    """
    name, path, flags, known, masks, seconds = film
    with analyzed(program, path, "--to", seconds, *flags, environment={**os.environ, "FLOCKREEL_RULE_OFF": rule}) as run:
        points = {"reads": sorted({line.split()[-1] for line in run.said.splitlines() if line.startswith("reads the switch ")})}
        if run.refused:
            return {**points, "refused": run.refused}
        poses = run.poses
        points["halo"] = -100 * (mattes_halo(run.library) or 0)
        if "clip" in known:
            known = {**known, "frames": [row for row in known["frames"] if row["frame"] < seconds * poses["fps"]]}
            score = score_labels(poses, known)
            right = (score["found"] - score["far"]) / score["n"]
            heads = 1 - len(score["heads_wrong"]) / max(score["heads_told"], 1)
            points["view"] = 100.0 * score["view_right"]
        else:
            known = {**known, "frames": known["frames"][:round(seconds * poses["fps"])]}
            score, _, _ = score_case(poses, known)
            right = score["found"] * score["right"] - score["invented"] / score["n"]
            heads = 1 - score["flips"] / max(score["n_aside"], 1)
            points |= {"sure": -100 * score["sure_and_far"] / score["n"], "leaps": -100 * score["leaps"] / max(score["n_steps"], 1),
                       "view": 100.0 * (poses["view"] == "side"), "direction": -direction_deg(poses, known)}
            if masks.exists():
                shown = np.load(masks)
                shown = {k: mask for k, mask in zip(shown["frames"].tolist(), shown["masks"]) if k < len(known["frames"])}
                points["overlap"] = 100 * statistics.median(overlaps(run.mattes(), shown).values())
        return {**points, "right": 100 * right, "heads": 100 * heads, "animals": -100.0 * ("several_animals" in run.said)}


def change(with_rule, without):
    """Returns what a film loses without a rule, in points or degrees; negative if it gains."""
    if "refused" in with_rule or "refused" in without:
        return 100.0 * (("refused" in without) - ("refused" in with_rule))
    return max((with_rule[key] - without[key] for key in with_rule if key != "reads"), key=abs)


def verdict(losses):
    worse = [name for name, loss in losses.items() if loss > CLEARLY]
    better = [name for name, loss in losses.items() if loss < -CLEARLY]
    if better:
        return "doubtful"
    return {0: "nothing", 1: "one film"}.get(len(worse), "useful")


def rules_of_table():
    return tomllib.loads((HERE / "ablation.toml").read_text())["rule"]


def page(results):
    """Returns the section of docs/measurements.md."""
    rows = []
    for rule in rules_of_table():
        for name in rule.get("names", [rule["name"]]):
            losses = results["rules"].get(name)
            if losses is not None:
                named = ", ".join(f"{film} {loss:.0f}" for film, loss in losses.items() if abs(loss) > CLEARLY)
                rows.append((f"`{name}`", rule["says"], verdict(losses), named))
    return ["## Contribution of each rule", "",
            "Each rule of `bench/ablation.toml` is switched off, one at a time. The last column has the points of 100 that a film "
            "loses without it, if more than one; negative points are gains. Points count frames within 0.1 body lengths, frames that are sure and far "
            "off, false steps, heads at the right end, the view, the overlap and the halo of mattes; degrees of the direction in "
            "space count like points. A refusal is 100. The verdict is `useful` from two films on, and `doubtful` if a film gains.", "",
            "Repeat: `make ablation GENERATOR=goldfish.py FOOTAGE=folder`", "", *table(["rule", "meaning", "verdict", "films"], rows)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("generator", type=pathlib.Path)
    parser.add_argument("--footage", type=pathlib.Path)
    parser.add_argument("--films", type=pathlib.Path, default=ROOT / "target" / "accuracy")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    import measurements  # not at the top, because it imports this file
    rules = rules_of_table()
    lay_out(rules)
    program = build()
    films = films_of(args)
    kept = PLACE / hashlib.sha256(program.read_bytes()).hexdigest()[:16]
    kept.mkdir(parents=True, exist_ok=True)

    def measured(film, rule):
        file = kept / f"{rule}-{film[0]}-{film[-1]}.json"
        if not file.exists():
            file.write_text(json.dumps(measure(program, film, rule)))
        return json.loads(file.read_text())

    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        base = dict(zip((film[0] for film in films), pool.map(lambda film: measured(film, "none"), films)))
        results = {"all": base, "rules": {}}
        for name in (name for rule in rules for name in rule.get("names", [rule["name"]])):
            reading = [film for film in films if name in base[film[0]]["reads"]]
            scores = pool.map(lambda film: measured(film, name), reading)
            losses = {film[0]: change(base[film[0]], score) for film, score in zip(reading, scores)}
            results["rules"][name] = losses
            print(f"{name:24}{verdict(losses):10}", *(f"{f} {v:.0f}" for f, v in losses.items() if abs(v) > CLEARLY), flush=True)
    measurements.save("ablation", results)


def films_of(args):
    """Returns (name, path, flags of analyze, truth or labels, path of the masks, seconds) for each film."""
    films = []
    for name, path, truth_path, flags, _ in cases.films(args.generator, args.films, CASES):
        truth, masks = json.loads(truth_path.read_text()), args.films / f"{name}.masks.npz"
        if name == CALIBRATED:
            camera, animal = PLACE / f"{name}.camera.json", truth["animal"]
            camera.write_text(json.dumps({key: truth["camera"][key] for key in ("z_min_m", "pane_px_per_m")}))
            flags = [*flags, "--camera", camera, "--animal-length", animal["length_m"], "--animal-height", animal["height_m"]]
        films.append((name, path, flags, truth, masks, CASES[name]))
    for clip, seconds in CLIPS.items() if args.footage else []:
        labels = json.loads((HERE / "labels" / f"{clip}.json").read_text())
        films.append((clip, args.footage / labels["clip"], [], labels, None, seconds))
    return films


if __name__ == "__main__":
    main()
