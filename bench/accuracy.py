#!/usr/bin/env python3
"""Measures the accuracy of poses, on generated films, films with faults (cases.py), drawn films (kinds.py) and labeled recordings.

    accuracy.py FLOCKREEL GENERATOR [--footage FOLDER] [--against FLOCKREEL] [--films FOLDER] [--only NAME,...]

GENERATOR is a script called as `GENERATOR STEM --seed N [--frames N] [--hard] [--colour C] [--size WxH]
[--length M] [--height M] [--crf N]`. It writes STEM.mp4, STEM.background.png, and STEM.truth.json with
`camera`, `animal` and, for each of `frames`, `centroid_px`, `box_px`, `forward` and `position_m`.

Films are kept in the folder, by default target/accuracy. Writes bench/results/accuracy.json and its section of
docs/measurements.md. --against compares errors and processor time with another program on the generated films;
it prints the ratios and stores nothing of them. --only prints the scores of the films of these names or kinds, and
stores nothing.
"""
import argparse, collections, concurrent.futures, contextlib, json, math, os, pathlib, re, resource, statistics, subprocess, sys, tempfile
import zipfile

import cv2
import numpy as np

from table import starred, table

HERE = pathlib.Path(__file__).resolve().parent
SEEDS = (1, 2, 3)
# A centroid error up to RIGHT is right, above FAR is far off; in body lengths.
RIGHT, FAR = .1, .25
# A frame is sure above SURE; a film with more than WRONG of its frames sure and far off is silently wrong.
SURE, WRONG = .9, .03
THIN = ("zebrafish_larva_single", "slow_worm", "spider_web_tiny")


def wrap(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def quantile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * (len(values) - 1) + .5))] if values else None


class Run:
    """An analysis: its poses, or the code of its refusal; the printed text; the processor time in seconds."""

    def __init__(self, program, film, flags, library, environment):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        words = [program, "analyze", film, "-o", library, *flags]
        done = subprocess.run([str(w) for w in words], capture_output=True, text=True, env=environment)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        self.library, self.said, self.refused, self.poses = library, done.stderr, None, None
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if line.endswith(")")]
            self.refused = lines[-1].rsplit("(", 1)[1].rstrip(")") if lines else "failed"
        else:
            self.poses = json.loads((library / "poses.json").read_text())

    def mattes(self):
        """Yields the frame, left and top of each matte in the picture, and the pixels with an alpha of at least 1/2."""
        centers = json.loads((self.library / "library.json").read_text())["matte_center_px"]
        archive = self.library / "mattes.zip"
        if not archive.exists():
            return
        with zipfile.ZipFile(archive) as mattes:
            for name in mattes.namelist():
                rgba = cv2.imdecode(np.frombuffer(mattes.read(name), np.uint8), cv2.IMREAD_UNCHANGED)
                frame = int(name.removesuffix(".png"))
                centroid = self.poses["frames"][frame]["centroid_px"]
                if rgba is not None and rgba.ndim == 3 and rgba.shape[2] == 4 and centroid:
                    left, top = (round(c - m) for c, m in zip(centroid, centers[frame]))
                    yield frame, left, top, rgba[..., 3] >= 128


@contextlib.contextmanager
def analyzed(program, film, *flags, environment=None):
    with tempfile.TemporaryDirectory() as folder:
        yield Run(program, film, flags, pathlib.Path(folder) / "library", environment)


def placed(left, top, mask, shape):
    """Returns a picture of that shape with the mask at its place."""
    picture = np.zeros(shape, bool)
    y, x = max(top, 0), max(left, 0)
    inside = mask[y - top:shape[0] - top, x - left:shape[1] - left]
    picture[y:y + inside.shape[0], x:x + inside.shape[1]] = inside
    return picture


def filled(polygons, shape):
    """Returns the pixels whose centers, at half-integers, are inside the polygons by the even-odd rule."""
    picture = np.zeros(shape, bool)
    y, x = np.arange(shape[0]) + .5, np.arange(shape[1]) + .5
    for polygon in polygons:
        for (x0, y0), (x1, y1) in zip(polygon, polygon[1:] + polygon[:1]):
            rows = np.nonzero((min(y0, y1) <= y) & (y < max(y0, y1)))[0]
            if len(rows):
                picture[rows] ^= x >= (x0 + (y[rows] - y0) * (x1 - x0) / (y1 - y0))[:, None]
    return picture


def overlaps(mattes, masks):
    """Returns the intersection over union of matte and mask for each frame of `masks`; 0 for a frame without matte."""
    found = {frame: placed(left, top, matte, masks[frame].shape) for frame, left, top, matte in mattes if frame in masks}
    none = np.zeros((1, 1), bool)
    return {frame: float((found.get(frame, none) & mask).sum() / (found.get(frame, none) | mask).sum()) for frame, mask in masks.items()}


def shape_of(matte):
    """Returns the area of the second largest piece over that of the largest, and outline squared / (4 pi area).

    The outline goes from pixel to pixel, so the latter is 1.1 for a disk.
    """
    matte = np.pad(matte, 1).astype(np.uint8)
    areas = sorted(cv2.connectedComponentsWithStats(matte, connectivity=8)[2][1:, cv2.CC_STAT_AREA], reverse=True)
    outlines = cv2.findContours(matte, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    outline_px = sum(cv2.arcLength(outline, True) for outline in outlines)
    return (float(areas[1] / areas[0]) if len(areas) > 1 else 0.0), float(outline_px ** 2 / (4 * math.pi * sum(areas)))


def score_case(poses, truth):
    """Returns scores against a known truth, in body lengths, and two lists of (confidence, is right)."""
    rows = truth["frames"]
    length_px = quantile([max(row["box_px"][2:]) for row in rows if row.get("centroid_px")], .9)
    found = flips = n_aside = invented = invented_and_sure = n_there = n_steps = leaps = 0
    off, sure, heads, turns, before = [], [], [], [], None
    # A container may repeat the last frame, so the lists may differ in length.
    for pose, row in zip(poses["frames"], rows):
        last, before = before, None
        if not row["centroid_px"] or row["centroid_px"][0] is None:
            invented += pose["detected"]
            invented_and_sure += pose["detected"] and pose["confidence"] >= .5
            continue
        n_there += 1
        if not pose["detected"]:
            continue
        found += 1
        # The generator has pixel centers at integers, flockreel at half-integers.
        true = [v + .5 for v in row["centroid_px"]]
        gap = math.dist(pose["centroid_px"], true) / length_px
        off.append(gap)
        sure.append((pose["confidence"], gap <= RIGHT))
        if pose["confidence"] > .5:
            before = pose["centroid_px"], true
            n_steps += last is not None
            # In a time lapse, the animal itself may go that far.
            leaps += last is not None and math.dist(before[0], last[0]) > length_px > math.dist(before[1], last[1])
        forward = row["forward"]
        if math.hypot(forward[0], forward[1]) > .5 and pose["heading_rad"] is not None:
            turn = abs(wrap(pose["heading_rad"] - math.atan2(forward[1], forward[0])))
            n_aside += 1
            flips += turn > math.pi / 2
            turns.append(turn)
            heads.append((pose["head_confidence"], turn <= math.pi / 2))
    sure_and_far = sum(gap > FAR and c > SURE for gap, (c, _) in zip(off, sure))
    return {
        "found": found / max(n_there, 1), "invented": invented, "off_p50": quantile(off, .5), "off_p95": quantile(off, .95),
        "right": sum(gap <= RIGHT for gap in off) / max(len(off), 1), "far": sum(gap > FAR for gap in off),
        "sure_and_far": sure_and_far, "n": n_there, "flips": flips, "n_aside": n_aside,
        "heading_deg_p50": math.degrees(quantile(turns, .5)) if turns else None,
        "silently_wrong": sure_and_far > WRONG * n_there, "leaps": leaps, "n_steps": n_steps, "invented_and_sure": invented_and_sure,
        "confidence_p50": quantile([c for c, _ in sure], .5), "far_share": sum(gap > FAR for gap in off) / max(len(off), 1),
        "flips_share": flips / max(n_aside, 1), "tail_beats": len((poses["tail_beat"] or {}).get("spans", [])),
        **{f"centroid_px_p{p}": quantile(off, p / 100) * length_px if off else None for p in (50, 95, 99)},
    }, sure, heads


def meets(expected, score, said):
    """Returns whether the score and the printed text are as the `expected` of a truth says (cases.py)."""
    if "either" in expected:
        return any(meets(one, score, said) for one in expected["either"])
    if not re.search(expected.get("says", ""), said) or "never_says" in expected and re.search(expected["never_says"], said):
        return False
    if "refused" in score or expected["refused"]:
        return score.get("refused") in (expected["refused"] or ())
    limits = {key: limit for key, limit in expected.items() if key not in ("refused", "says", "never_says", "found")}
    return score["found"] >= max(expected.get("found", 0), .01) and all(score[key] <= limit for key, limit in limits.items())


def calibration(films):
    """Compares confidence with the share of right frames, in ten bins from .5 to 1.

    `films` are pairs of a kind and a list. Every film has the same weight. Returns the bins, the expected calibration
    error, that of each kind of film, and the largest error of bins with at least 200 frames. `left_out` is the error of
    each kind if a confidence means what it means in the films of all other kinds.
    """
    films = [(kind, pairs) for kind, pairs in films if pairs]
    rows = bins_of([pairs for _, pairs in films])
    kinds = collections.defaultdict(list)
    for kind, pairs in films:
        kinds[kind].append(pairs)
    others = {kind: [pairs for other, pairs in films if other != kind] for kind in kinds}
    return {"bins": rows, "ece": error_of(rows), "kinds": {kind: error_of(bins_of(lists)) for kind, lists in kinds.items()},
            "left_out": {kind: error_of(bins_of([recalibrated(pairs, others[kind]) for pairs in lists])) for kind, lists in kinds.items()},
            "worst_bin": max((abs(row["confidence"] - row["right"]) for row in rows if row["frames"] >= 200), default=0.0)}


def bin_of(confidence):
    return min(9, max(0, int((confidence - .5) * 20)))


def recalibrated(pairs, films):
    """Returns the pairs with the share of right frames of the same bin in other films as their confidence."""
    right = {bin_of(row["confidence"]): row["right"] for row in bins_of(films)}
    return [(right.get(bin_of(confidence), confidence), is_right) for confidence, is_right in pairs]


def bins_of(films):
    bins = [[0.0, 0.0, 0.0, 0] for _ in range(10)]
    for pairs in films:
        for confidence, is_right in pairs:
            row = bins[bin_of(confidence)]
            weight = 1 / len(pairs) / len(films)
            row[0] += weight
            row[1] += weight * confidence
            row[2] += weight * is_right
            row[3] += 1
    return [{"share": w, "confidence": c / w, "right": r / w, "frames": n} for w, c, r, n in bins if w]


def error_of(rows):
    return sum(row["share"] * abs(row["confidence"] - row["right"]) for row in rows)


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


def score_outlines(run, outlines):
    """Compares mattes with outlines drawn by hand, and measures their pieces.

    Of several animals in a frame, the one that the matte fits best counts.
    """
    shape, by_frame = run.poses["image_size_px"][::-1], collections.defaultdict(list)
    for row in outlines["frames"]:
        by_frame[row["frame"]].append(filled(row["polygons_px"], shape))
    mattes = list(run.mattes())
    most = max(map(len, by_frame.values()))
    one_each = [overlaps(mattes, {frame: masks[n] for frame, masks in by_frame.items() if n < len(masks)}) for n in range(most)]
    ious = {frame: max(one[frame] for one in one_each if frame in one) for frame in by_frame}
    shapes = [shape_of(matte) for _, _, _, matte in mattes if matte.any()] or [(0.0, 0.0)]
    return {"iou": statistics.median(ious.values()), "ious": ious,
            "second_pieces": statistics.mean(second > .02 for second, _ in shapes),
            "compactness": statistics.median(compact for _, compact in shapes)}


def recording(program, footage, stem):
    """Returns the scores of a clip against its labels and its outlines, as far as it has them."""
    files = {"labels": HERE / "labels" / f"{stem}.json", "outlines": HERE / "labels" / "outlines" / f"{stem}.json"}
    known = {key: json.loads(file.read_text()) for key, file in files.items() if file.exists()}
    score_of = {"labels": lambda run, labels: score_labels(run.poses, labels), "outlines": score_outlines}
    film = footage / next(iter(known.values()))["clip"]

    def scores(keys, *flags):
        with analyzed(program, film, "--set", "sprites=always", *flags) as run:
            return {key: {"refused": run.refused} if run.refused else score_of[key](run, known[key]) for key in keys}

    first = scores(known)
    # Mattes of several animals exist only if one of them is followed.
    several = first.get("outlines") == {"refused": "several_animals"}
    return {**first, **(scores(["outlines"], "--follow-largest") if several else {})}


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
            with analyzed(program, stem.with_suffix(".mp4"), "--camera", camera, "--animal-length", known["animal"]["length_m"],
                          "--animal-height", known["animal"]["height_m"]) as run:
                words = [sys.executable, HERE / "score.py", run.library / "poses.json", truth]
                score = json.loads(subprocess.run([str(w) for w in words], check=True, capture_output=True, text=True).stdout)
            scores.setdefault(kind, []).append({**score, "cpu_s": run.cpu_s})
    return scores


def case(program, film):
    """Returns the name, kind and scores of a film, and its two lists of (confidence, is right)."""
    name, path, truth_path, flags, kind = film
    truth, masks_path, sure, heads = json.loads(truth_path.read_text()), truth_path.with_name(f"{name}.masks.npz"), [], []
    with analyzed(program, path, *flags) as run:
        if run.refused:
            score = {"refused": run.refused}
        else:
            score, sure, heads = score_case(run.poses, truth)
            if masks_path.exists():
                masks = np.load(masks_path)
                ious = overlaps(run.mattes(), dict(zip(masks["frames"].tolist(), masks["masks"])))
                score["iou"] = statistics.median(ious.values())
    return name, kind, {**score, "as_expected": meets(truth["expected"], score, run.said)}, sure, heads


def scores_of_films(args):
    """Returns what `case` returns, for the films of cases.py and kinds.py."""
    import cases
    films = cases.films(args.generator, args.films, args.only)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda film: case(args.program, film), films))


def measure(args):
    import kinds
    scored, folder = scores_of_films(args), args.films
    is_drawn = lambda name: name in {f"{kind}-{seed}" for kind in kinds.KINDS for seed in kinds.SEEDS}
    results = {
        "cases": {name: score for name, _, score, _, _ in scored if not is_drawn(name)},
        "drawn": {name: score for name, _, score, _, _ in scored if is_drawn(name)},
        "confidence": calibration([(kind, sure) for _, kind, _, sure, _ in scored]),
        "head_confidence": calibration([(kind, heads) for _, kind, _, _, heads in scored]),
        "generated": generated(args.program, args.generator, folder),
    }
    if args.footage:
        stems = sorted({path.stem for path in (HERE / "labels").rglob("*.json")})
        scores = {stem: recording(args.program, args.footage, stem) for stem in stems}
        for key in ("labels", "outlines"):
            results[key] = {stem: score[key] for stem, score in scores.items() if key in score}
    return results


def bars(results):
    """Returns (measure, figure, limit, whether it holds)."""
    cases = [*results["cases"].values(), *results.get("drawn", {}).values()]
    measured = [score for score in cases if "refused" not in score]
    n = sum(score["n"] for score in measured)
    far = sum(score["sure_and_far"] for score in measured) / n
    rows = [("films: frames with `confidence` above 0.9 and an error over 0.25 BL", f"{far:.3%}", "< 0.3%", far < .003)]
    for name in ("confidence", "head_confidence"):
        ece, worst = results[name]["ece"], results[name]["worst_bin"]
        rows.append((f"films: mean calibration error of `{name}`", f"{ece:.4f}", "< 0.03", ece < .03))
        rows.append((f"films: largest calibration error of `{name}` in a bin of at least 200 frames", f"{worst:.3f}", "<= 0.1",
                     worst <= .1))
        kind, ece = max(results[name]["kinds"].items(), key=lambda item: item[1])
        rows.append((f"films: calibration error of `{name}` in the worst kind of films, `{kind}`", f"{ece:.4f}", "< 0.05", ece < .05))
        kind, ece = max(results[name].get("left_out", {"": 0}).items(), key=lambda item: item[1])
        rows.append((f"films: calibration error of `{name}` by the films of other kinds, in the worst kind, `{kind}`", f"{ece:.4f}",
                     "< 0.05", ece < .05))
    silent = sum(score["silently_wrong"] for score in measured)
    rows.append(("films: silently wrong (over 3% of the frames with `confidence` above 0.9 and an error over 0.25 BL)", str(silent), "0",
                 silent == 0))
    unlike = sum(not score["as_expected"] for score in cases)
    rows.append(("films: neither measured nor refused as expected", str(unlike), "0", unlike == 0))
    leaps = sum(score["leaps"] for score in measured) / sum(score["n_steps"] for score in measured)
    rows.append(("films: share of false steps over 1 BL between frames, with `confidence` above 0.5", f"{leaps:.3%}", "< 0.1%",
                 leaps < .001))
    iou = min(score["iou"] for score in results["cases"].values() if "iou" in score)
    rows.append(("films with faults: intersection over union of matte and animal, median over frames, lowest of all films", f"{iou:.3f}",
                 "> 0.9", iou > .9))
    clips = {name: clip for name, clip in results.get("labels", {}).items() if "refused" not in clip}
    if clips:
        least = min(clip["found"] / clip["n"] for clip in clips.values())
        rows.append(("recordings: share of frames in which the animal is found, lowest of all clips", f"{least:.1%}", "> 95%", least > .95))
        told = min(clip["heads_told"] / max(clip["heads"], 1) for clip in clips.values())
        rows.append(("recordings: share of visible heads with `head_confidence` above 0.5, lowest of all clips", f"{told:.1%}", "> 85%",
                     told > .85))
        wrong = sum(len(clip["heads_wrong"]) for clip in clips.values()) / sum(clip["heads_told"] for clip in clips.values())
        rows.append(("recordings: share of these heads at the wrong end, all clips together", f"{wrong:.1%}", "< 1%", wrong < .01))
        off = sum(clip["far"] for clip in clips.values()) / sum(clip["centroids"] for clip in clips.values())
        rows.append(("recordings: share of centroids with an error over 0.25 BL", f"{off:.1%}", "< 1%", off < .01))
        views = sum(not clip["view_right"] for clip in clips.values())
        rows.append(("recordings: clips with the wrong view", str(views), "0", views == 0))
        axis = clips["mouse_round_arena"]["axis_deg_p50"]
        rows.append(("clip mouse_round_arena: difference from the labeled heading, median", f"{axis:.1f}\u00b0", "< 1.5\u00b0", axis < 1.5))
    outlines = {name: clip for name, clip in results.get("outlines", {}).items() if "refused" not in clip}
    for which, is_thin, least in (("", False, .9), (" of thin animals", True, .85)):
        ious = {name: clip["iou"] for name, clip in outlines.items() if (name in THIN) == is_thin}
        if ious:
            worst = min(ious, key=ious.get)
            rows.append((f"recordings{which}: intersection over union of matte and outline by hand, median over frames, lowest of all "
                         f"clips, `{worst}`", f"{ious[worst]:.3f}", f"> {least}", ious[worst] > least))
    bedding = outlines.get("mouse_homecage_bedding")
    if bedding:
        rows.append(("clip mouse_homecage_bedding: share of mattes with a second piece over 2% of the largest",
                     f"{bedding['second_pieces']:.1%}", "< 3%", bedding["second_pieces"] < .03))
        rows.append(("clip mouse_homecage_bedding: outline squared / (4 pi area) of the mattes, median",
                     f"{bedding['compactness']:.2f}", "< 2.2", bedding["compactness"] < 2.2))
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
            *case_tables(results), *(label_table(results["labels"]) if "labels" in results else []),
            *(outline_table(results["outlines"]) if "outlines" in results else []), *generated_table(results["generated"])]


def film_table(scores):
    mark = lambda name, s: name if s["as_expected"] else f"{name} *"
    figure = lambda value: "" if value is None else f"{value:.3f}"
    rows = [(mark(name, s), f"refused: `{s['refused']}`") if "refused" in s else
            (mark(name, s), f"{s['found']:.1%}", figure(s["off_p50"]), figure(s["off_p95"]), f"{s['right']:.1%}", s["far"], s["invented"],
             f"{s['flips']} of {s['n_aside']}", s["leaps"], figure(s.get("iou")), s["sure_and_far"])
            for name, s in scores.items()]
    return table(["film", "found", "error, median", "error, p95", "within 0.1", "over 0.25", "false detections", "wrong heads", "leaps",
                  "overlap", "sure and far"], rows)


def case_tables(results):
    yield from ("", "### Films with faults", "")
    yield ("`bench/cases.py` makes films of a synthetic fish with typical faults, each in three strengths and with three seeds. The number "
           "in a name is the seed. Films without a fault are also stored in other file formats: `pictures` (PNG, or TIFF with 16 bits), "
           "`exif_turned` (JPEG), `raw` (bare H.264), `sound` (WMV), `old` (MPEG-1), `thumbnail_first`, `moving_pictures` and "
           "`unfinished_recording`. The films from `plain-1` on have no fault added. *Over 0.25* and *false detections* (in frames "
           "without the animal) are numbers of frames. Wrong heads are counted where "
           "the animal points less than 60 degrees out of the picture plane. Leaps are steps over 1 BL between frames. The overlap is the "
           "intersection over union of the matte and the true animal. Frames are sure and far if `confidence` is above 0.9 and the "
           "error over 0.25 BL. A star marks a film that is neither measured nor refused as its truth expects.")
    yield ""
    yield from film_table(results["cases"])
    if "drawn" in results:
        yield from ("", "### Drawn films", "")
        yield ("`bench/kinds.py` draws films of kinds of animals and situations, each with three seeds. The columns are those of the table "
               "above. A star marks a film that is silently wrong, or refused without advice.")
        yield ""
        yield from film_table(results["drawn"])
    yield from ("", "### Calibration", "")
    yield ("Each row has the frames of the films above with similar confidence. The columns *mean* and *right* should be equal. `confidence` is right if "
           "the error is at most 0.1 BL, `head_confidence` if the head is at the right end. Each film has the same weight.")
    for name in ("confidence", "head_confidence"):
        yield ""
        yield from table([f"mean `{name}`", "right", "weighted share", "frames"], [
            (f"{row['confidence']:.3f}", f"{row['right']:.3f}", f"{row['share']:.1%}", row["frames"]) for row in results[name]["bins"]])
    yield from ("", "Mean calibration error of each kind of films, and its error if a confidence means what it means in the films of "
                "all other kinds:", "")
    confidence, head = results["confidence"], results["head_confidence"]
    yield from table(["kind", "`confidence`", "by the other kinds", "`head_confidence`"], [
        (kind, f"{ece:.4f}", f"{confidence.get('left_out', {}).get(kind, 0):.4f}", f"{head['kinds'].get(kind, 0):.4f}")
        for kind, ece in confidence["kinds"].items()])


def label_table(labels):
    rows = [(name, f"refused: `{c['refused']}`") if "refused" in c else
            (name, c["view"] + ("" if c["view_right"] else " (wrong)"), f"{c['found']} of {c['n']}", f"{c['heads_told']} of {c['heads']}",
             len(c["heads_wrong"]), f"{c['off_max']:.2f}", c["far"]) for name, c in labels.items()]
    return ["", "### Recordings", "", "Forty frames of each clip are labeled by eye (`bench/labels`). Frames in which the animal is hidden or ambiguous are left out. A head is "
            "decided if `head_confidence` is above 0.5. The last column is the number of frames with an error over 0.25 BL.", "",
            *table(["clip", "view", "found", "head decided", "head wrong", "error, largest", "over 0.25"], rows)]


def outline_table(outlines):
    rows = [(name, f"refused: `{clip['refused']}`") if "refused" in clip else
            (name, f"{clip['iou']:.3f}", f"{min(clip['ious'].values()):.3f}", f"{clip['second_pieces']:.1%}", f"{clip['compactness']:.2f}")
            for name, clip in outlines.items()]
    return ["", "### Outlines", "", "Ten frames of each clip have outlines drawn by hand (`bench/labels/outlines`). The overlap is the "
            "intersection over union of outline and matte. The last columns are of all mattes: the share with a second piece over 2% of "
            "the largest, and outline squared / (4 pi area). Of several animals, the largest is followed.", "",
            *table(["clip", "overlap, median", "lowest", "second pieces", "compactness, median"], rows)]


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
    parser.add_argument("--only", type=lambda names: names.split(","), default=())
    args = parser.parse_args()
    args.program = args.program.resolve()
    if args.only:
        scored = scores_of_films(args)
        print(*film_table({name: score for name, _, score, _, _ in scored}), sep="\n")
        print(json.dumps(calibration([(kind, sure) for _, kind, _, sure, _ in scored]), indent=1))
        return
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
