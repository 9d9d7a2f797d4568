#!/usr/bin/env python3
"""Measures the accuracy of poses, on generated films, films with faults (cases.py) and labeled recordings.

    accuracy.py FLOCKREEL GENERATOR [--footage FOLDER] [--against FLOCKREEL] [--films FOLDER]

GENERATOR is a script called as `GENERATOR STEM --seed N [--frames N] [--hard] [--colour C] [--size WxH]
[--length M] [--height M] [--crf N]`. It writes STEM.mp4, STEM.background.png, and STEM.truth.json with
`camera`, `animal` and, for each of `frames`, `centroid_px`, `box_px`, `forward` and `position_m`.

Films are kept in the folder, by default target/accuracy. Writes bench/results/accuracy.json and its section of
docs/measurements.md. --against compares errors and processor time with another program on the generated films;
it prints the ratios and stores nothing of them.
"""
import argparse, concurrent.futures, json, math, os, pathlib, resource, statistics, subprocess, sys, tempfile

from table import starred, table

HERE = pathlib.Path(__file__).resolve().parent
SEEDS = (1, 2, 3)
# A centroid error up to RIGHT is right, above FAR is far off; in body lengths.
RIGHT, FAR = .1, .25


def wrap(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def quantile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * (len(values) - 1) + .5))] if values else None


def analyze(program, film, *flags):
    """Returns the poses, or the code of the refusal, and the processor time in seconds."""
    with tempfile.TemporaryDirectory() as folder:
        library = pathlib.Path(folder) / "library"
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([str(w) for w in (program, "analyze", film, "-o", library, *flags)], capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if line.endswith(")")]
            return lines[-1].rsplit("(", 1)[1].rstrip(")") if lines else "failed", cpu_s
        return json.loads((library / "poses.json").read_text()), cpu_s


def score_case(poses, truth):
    """Returns scores against a known truth, in body lengths, and two lists of (confidence, is right)."""
    rows = truth["frames"]
    length_px = quantile([max(row["box_px"][2:]) for row in rows if row.get("centroid_px")], .9)
    found = flips = n_aside = invented = n_there = 0
    off, sure, heads, turns = [], [], [], []
    # A container may repeat the last frame, so the lists may differ in length.
    for pose, row in zip(poses["frames"], rows):
        if not row["centroid_px"] or row["centroid_px"][0] is None:
            invented += pose["detected"]
            continue
        n_there += 1
        if not pose["detected"]:
            continue
        found += 1
        # The generator has pixel centers at integers, flockreel at half-integers.
        gap = math.dist(pose["centroid_px"], [v + .5 for v in row["centroid_px"]]) / length_px
        off.append(gap)
        sure.append((pose["confidence"], gap <= RIGHT))
        forward = row["forward"]
        if math.hypot(forward[0], forward[1]) > .5 and pose["heading_rad"] is not None:
            turn = abs(wrap(pose["heading_rad"] - math.atan2(forward[1], forward[0])))
            n_aside += 1
            flips += turn > math.pi / 2
            turns.append(turn)
            heads.append((pose["head_confidence"], turn <= math.pi / 2))
    return {
        "found": found / max(n_there, 1), "invented": invented, "off_p50": quantile(off, .5), "off_p95": quantile(off, .95),
        "right": sum(gap <= RIGHT for gap in off) / max(len(off), 1), "far": sum(gap > FAR for gap in off),
        "sure_and_far": sum(gap > FAR and c > .9 for gap, (c, _) in zip(off, sure)), "n": n_there, "flips": flips, "n_aside": n_aside,
        "heading_deg_p50": math.degrees(quantile(turns, .5)) if turns else None,
    }, sure, heads


def calibration(films):
    """Compares confidence with the share of right frames, in ten bins from .5 to 1.

    Every film has the same weight. Returns the bins, the expected calibration error, and the largest error of
    bins with at least 200 frames.
    """
    bins = [[0.0, 0.0, 0.0, 0] for _ in range(10)]
    films = [pairs for pairs in films if pairs]
    for pairs in films:
        for confidence, is_right in pairs:
            row = bins[min(9, max(0, int((confidence - .5) * 20)))]
            weight = 1 / len(pairs) / len(films)
            row[0] += weight
            row[1] += weight * confidence
            row[2] += weight * is_right
            row[3] += 1
    rows = [{"share": w, "confidence": c / w, "right": r / w, "frames": n} for w, c, r, n in bins if w]
    return {"bins": rows, "ece": sum(row["share"] * abs(row["confidence"] - row["right"]) for row in rows),
            "worst_bin": max(abs(row["confidence"] - row["right"]) for row in rows if row["frames"] >= 200)}


def score_labels(poses, labels):
    length_px = max(math.dist(row["nose_px"], row["tail_base_px"]) for row in labels["frames"]
                    if row.get("nose_px") and row.get("tail_base_px"))
    seen = [row for row in labels["frames"] if row["visible"] and not row["ambiguous"]]
    pose_of = lambda row: poses["frames"][row["frame"]]
    found = [row for row in seen if pose_of(row)["detected"]]
    off = [math.dist(pose_of(row)["centroid_px"], row["centroid_px"]) / length_px for row in found if row["centroid_px"]]
    heads = [row for row in found if row["head_visible"] and row["nose_px"] and row["tail_base_px"]]
    told = [row for row in heads if pose_of(row)["head_confidence"] and pose_of(row)["head_confidence"] > .5]
    way = lambda row: math.atan2(row["nose_px"][1] - row["tail_base_px"][1], row["nose_px"][0] - row["tail_base_px"][0])
    wrong = [row["frame"] for row in told if abs(wrap(pose_of(row)["heading_rad"] - way(row))) > math.pi / 2]
    axes = [abs(wrap(pose_of(row)["heading_rad"] - row["body_axis_rad"])) for row in told if row.get("body_axis_rad") is not None]
    return {"view": poses["view"], "view_right": poses["view"] == labels["view"], "n": len(seen), "found": len(found),
            "heads": len(heads), "heads_told": len(told), "heads_wrong": wrong, "centroids": len(off),
            "off_max": max(off, default=0), "far": sum(gap > FAR for gap in off),
            "axis_deg_p50": math.degrees(statistics.median(axes)) if axes else None}


def generated(program, generator, folder):
    """Scores films of 1200 frames with known camera and animal, as in the papers, by score.py."""
    scores = {}
    for kind, flags in (("plain", []), ("hard", ["--hard"])):
        for seed in SEEDS:
            stem = folder / f"generated-{kind}-{seed}"
            truth = stem.with_suffix(".truth.json")
            if not truth.exists():
                subprocess.run([str(w) for w in (sys.executable, generator, stem, "--seed", seed, *flags)], check=True)
            known = json.loads(truth.read_text())
            camera = stem.with_suffix(".camera.json")
            camera.write_text(json.dumps({k: known["camera"][k] for k in ("z_min_m", "pane_px_per_m")}))
            poses, cpu_s = analyze(program, stem.with_suffix(".mp4"), "--camera", camera, "--animal-length",
                                   known["animal"]["length_m"], "--animal-height", known["animal"]["height_m"])
            with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
                json.dump(poses, file)
                file.flush()
                words = [sys.executable, HERE / "score.py", file.name, truth]
                score = json.loads(subprocess.run([str(w) for w in words], check=True, capture_output=True, text=True).stdout)
            scores.setdefault(kind, []).append({**score, "cpu_s": cpu_s})
    return scores


def case(program, film):
    name, path, truth, flags = film
    poses, _ = analyze(program, path, *flags)
    if isinstance(poses, str):
        return name, {"refused": poses}, [], []
    return name, *score_case(poses, json.loads(truth.read_text()))


def measure(args):
    import cases
    folder = args.films
    films = cases.films(args.generator, folder)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        scored = list(pool.map(lambda film: case(args.program, film), films))
    results = {
        "cases": {name: score for name, score, _, _ in scored},
        "confidence": calibration([sure for _, _, sure, _ in scored]),
        "head_confidence": calibration([heads for _, _, _, heads in scored]),
        "generated": generated(args.program, args.generator, folder),
    }
    if args.footage:
        results["labels"] = {}
        for path in sorted((HERE / "labels").glob("*.json")):
            labels = json.loads(path.read_text())
            poses, _ = analyze(args.program, args.footage / labels["clip"])
            results["labels"][path.stem] = {"refused": poses} if isinstance(poses, str) else score_labels(poses, labels)
    return results


def bars(results):
    """Returns (measure, figure, limit, whether it holds)."""
    cases = results["cases"].values()
    measured = [score for score in cases if "refused" not in score]
    n = sum(score["n"] for score in measured)
    far = sum(score["sure_and_far"] for score in measured) / n
    rows = [("films: frames with `confidence` above 0.9 and an error over 0.25 BL", f"{far:.3%}", "< 0.3%", far < .003)]
    for name in ("confidence", "head_confidence"):
        ece, worst = results[name]["ece"], results[name]["worst_bin"]
        rows.append((f"films: mean calibration error of `{name}`", f"{ece:.4f}", "< 0.03", ece < .03))
        rows.append((f"films: largest calibration error of `{name}` in a bin of at least 200 frames", f"{worst:.3f}", "<= 0.1", worst <= .1))
    clips = {name: clip for name, clip in results.get("labels", {}).items() if "refused" not in clip}
    if clips:
        least = min(clip["found"] / clip["n"] for clip in clips.values())
        rows.append(("recordings: share of frames in which the animal is found, lowest of all clips", f"{least:.1%}", "> 95%", least > .95))
        told = min(clip["heads_told"] / max(clip["heads"], 1) for clip in clips.values())
        rows.append(("recordings: share of visible heads with `head_confidence` above 0.5, lowest of all clips", f"{told:.1%}", "> 85%", told > .85))
        wrong = sum(len(clip["heads_wrong"]) for clip in clips.values()) / sum(clip["heads_told"] for clip in clips.values())
        rows.append(("recordings: share of these heads at the wrong end, all clips together", f"{wrong:.1%}", "< 1%", wrong < .01))
        off = sum(clip["far"] for clip in clips.values()) / sum(clip["centroids"] for clip in clips.values())
        rows.append(("recordings: share of centroids with an error over 0.25 BL", f"{off:.1%}", "< 1%", off < .01))
        views = sum(not clip["view_right"] for clip in clips.values())
        rows.append(("recordings: clips with the wrong view", str(views), "0", views == 0))
        axis = clips["mouse_round_arena"]["axis_deg_p50"]
        rows.append(("clip mouse_round_arena: difference from the labeled heading, median", f"{axis:.1f}\u00b0", "< 1.5\u00b0", axis < 1.5))
    return rows


def comparison(ours, theirs):
    """Returns the rows of `bars` for two programs, from their scores on generated films."""
    rows = []
    for kind in ours:
        for key in ("centroid_px_p95", "heading_deg_p50", "forward_deg_p50"):
            now, then = ([score[key] for score in scores[kind]] for scores in (ours, theirs))
            ratio = statistics.median(now) / statistics.median(then)
            spread = (max(then) - min(then)) / statistics.median(then)
            rows.append((f"generated, {kind}: {key} over the other program's", f"{ratio:.2f}", f"<= {1 + max(.05, spread):.2f}",
                         ratio <= 1 + max(.05, spread)))
    cpu = [sum(score["cpu_s"] for score in scores["plain"]) for scores in (ours, theirs)]
    rows.append(("processor time over the other program's", f"{cpu[0] / cpu[1]:.2f}", "<= 1.3", cpu[0] <= 1.3 * cpu[1]))
    return rows


def page(results):
    """Returns the section of docs/measurements.md."""
    return ["## Accuracy of poses", "",
            "Poses are compared with the truth of generated films, and with labels of real recordings. Lengths without a unit are body lengths (BL). "
            "The error is the distance of the measured centroid from the true one. The calibration error of a confidence is the difference "
            "between the confidence and the share of frames in which the measurement is right.", "",
            "Repeat: `make accuracy GENERATOR=goldfish.py FOOTAGE=folder`", "",
            *table(["measure", "measured", "bar"], [(what, starred(figure, met), bar) for what, figure, bar, met in bars(results)]),
            *case_tables(results), *(label_table(results["labels"]) if "labels" in results else []), *generated_table(results["generated"])]


def case_tables(results):
    rows = [(name, f"refused: `{s['refused']}`") if "refused" in s else
            (name, f"{s['found']:.1%}", f"{s['off_p50']:.3f}", f"{s['off_p95']:.3f}", f"{s['right']:.1%}", s["far"], s["invented"],
             f"{s['flips']} of {s['n_aside']}") for name, s in results["cases"].items()]
    yield from ("", "### Films with faults", "")
    yield ("`bench/cases.py` makes films of a synthetic fish with typical faults, each in three strengths and with three seeds. The number "
           "in a name is the seed. Four films without a fault are stored in other file formats: `pictures` (a zip of PNGs), `raw` (bare H.264), "
           "`sound` (WMV) and `old` (MPEG-1). The films from `plain-1` on have no fault added. *Over 0.25* and *false detections* (in frames "
           "without the animal) are numbers of frames. Wrong heads are counted where "
           "the animal points less than 60 degrees out of the picture plane.")
    yield ""
    yield from table(["film", "found", "error, median", "error, p95", "within 0.1", "over 0.25", "false detections", "wrong heads"], rows)
    yield from ("", "### Calibration", "")
    yield ("Each row has the frames of the films above with similar confidence. The columns *mean* and *right* should be equal. `confidence` is right if "
           "the error is at most 0.1 BL, `head_confidence` if the head is at the right end. Each film has the same weight.")
    for name in ("confidence", "head_confidence"):
        yield ""
        yield from table([f"mean `{name}`", "right", "weighted share", "frames"], [
            (f"{row['confidence']:.3f}", f"{row['right']:.3f}", f"{row['share']:.1%}", row["frames"]) for row in results[name]["bins"]])


def label_table(labels):
    rows = [(name, f"refused: `{c['refused']}`") if "refused" in c else
            (name, c["view"] + ("" if c["view_right"] else " (wrong)"), f"{c['found']} of {c['n']}", f"{c['heads_told']} of {c['heads']}",
             len(c["heads_wrong"]), f"{c['off_max']:.2f}", c["far"]) for name, c in labels.items()]
    return ["", "### Recordings", "", "Forty frames of each clip are labeled by eye (`bench/labels`). Frames in which the animal is hidden or ambiguous are left out. A head is "
            "decided if `head_confidence` is above 0.5. The last column is the number of frames with an error over 0.25 BL.", "",
            *table(["clip", "view", "found", "head decided", "head wrong", "error, largest", "over 0.25"], rows)]


def generated_table(scores):
    def cell(kind, key):
        values = [score[key] for score in scores[kind]]
        return f"{statistics.median(values):.4g} ({min(values):.4g} to {max(values):.4g})"

    rows = [(f"`{key}`", cell("plain", key), cell("hard", key)) for key in (
        "detected_share", "centroid_px_p50", "centroid_px_p95", "head_right_share", "heading_deg_p50", "heading_deg_p95", "z_scaled_rmse_m",
        "forward_deg_p50", "forward_deg_p90")]
    return ["", "### Calibrated camera", "", "Generated films of 1200 frames with a known camera and animal, as in the papers, scored by "
            "`bench/score.py`. Cells are the median over three seeds, with minimum and maximum. Names end in the unit (`px`, `deg`, `m`) and the "
            "percentile (`p50`, `p90`, `p95`). `z_scaled_rmse_m` is the root mean square error of the depth after the best scaling.", "", *table(["measure", "plain", "hard"], rows)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("generator", type=pathlib.Path)
    parser.add_argument("--footage", type=pathlib.Path)
    parser.add_argument("--against", type=pathlib.Path)
    parser.add_argument("--films", type=pathlib.Path, default=HERE.parent / "target" / "accuracy")
    args = parser.parse_args()
    args.program = args.program.resolve()
    import measurements  # not at the top, because it imports this file
    results = measure(args)
    measurements.save("accuracy", results)
    rows = bars(results)
    if args.against:
        rows += comparison(results["generated"], generated(args.against, args.generator, args.films))
    for what, figure, bar, met in rows:
        print(f"{what:76} {figure:>9} {bar:>9}{'' if met else '  MISSED'}")


if __name__ == "__main__":
    main()
