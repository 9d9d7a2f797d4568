#!/usr/bin/env python3
"""How right the poses are, on films of a generator that knows the truth, against what is wanted.

    accuracy.py FLOCKREEL GENERATOR [--seeds 1,2,3,4,5] [--keep FOLDER] [-- GENERATOR FLAGS...]

GENERATOR is a Python script called as `GENERATOR STEM --seed N [--hard] FLAGS` that writes STEM.mp4 and
STEM.truth.json (camera, animal, frames); films already in FOLDER are not filmed again. Each film is
analyzed with its camera and animal, scored by score.py, and the medians over the seeds are printed.
Ends with 1 when a bar is missed.
"""
import json, pathlib, statistics, subprocess, sys, tempfile

HERE = pathlib.Path(__file__).resolve().parent
# Measure, key of score.py, bar on plain films, bar on hard ones, whether more is better.
BARS = [
    ("detected frames", "detected_share", 1.0, 0.99, True),
    ("centroid p50, px", "centroid_px_p50", 0.4, 0.6, False),
    ("centroid p95, px", "centroid_px_p95", 1.0, 2.0, False),
    ("head right", "head_right_share", 0.998, 0.99, True),
    ("heading p50, deg", "heading_deg_p50", 3.0, 4.0, False),
    ("heading p95, deg", "heading_deg_p95", 10.0, 14.0, False),
    ("depth after one scale, m", "z_scaled_rmse_m", 0.020, 0.030, False),
    ("direction p50, deg", "forward_deg_p50", 8.0, 10.0, False),
    ("direction p90, deg", "forward_deg_p90", 20.0, 28.0, False),
]


def score(program, generator, stem, seed, hard, flags):
    film, truth = stem.with_suffix(".mp4"), stem.with_suffix(".truth.json")
    if not truth.exists():
        words = [sys.executable, generator, stem, "--seed", seed, *(["--hard"] if hard else []), *flags]
        subprocess.run([str(w) for w in words], check=True)
    known = json.loads(truth.read_text())
    camera = stem.with_suffix(".camera.json")
    camera.write_text(json.dumps({k: known["camera"][k] for k in ("z_min_m", "pane_px_per_m")}))
    with tempfile.TemporaryDirectory() as folder:
        library = pathlib.Path(folder) / "library"
        words = [program, "analyze", film, "-o", library, "--camera", camera, "--animal-length",
                 known["animal"]["length_m"], "--animal-height", known["animal"]["height_m"]]
        subprocess.run([str(w) for w in words], check=True, capture_output=True)
        words = [sys.executable, HERE / "score.py", library / "poses.json", truth]
        return json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


def main():
    words = sys.argv[1:]
    flags = words[words.index("--") + 1:] if "--" in words else []
    words = words[:words.index("--")] if "--" in words else words
    option = lambda name, usual: words[words.index(name) + 1] if name in words else usual
    seeds = [int(s) for s in option("--seeds", "1,2,3,4,5").split(",")]
    folder = pathlib.Path(option("--keep", None) or tempfile.mkdtemp())
    missed = 0
    for kind, hard in (("easy", False), ("hard", True)):
        scores = [score(words[0], words[1], folder / f"{kind}{seed}", seed, hard, flags) for seed in seeds]
        print(f"{kind}, {len(seeds)} films: median (least to most)")
        for name, key, *bars, more in BARS:
            values = [s[key] for s in scores]
            if None in values:
                print(f"  {name:26} not measured in every film")
                missed += 1
                continue
            bar, middle = bars[hard], statistics.median(values)
            met = middle >= bar if more else middle < bar
            missed += not met
            span = f"({min(values):.4g} to {max(values):.4g})"
            print(f"  {name:26} {middle:8.4g} {span:24} wanted {'>=' if more else '<'} {bar:g}{'' if met else '  MISSED'}")
    sys.exit(1 if missed else 0)


main()
