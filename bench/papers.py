#!/usr/bin/env python3
"""Compares flockreel with the two papers as printed, on films with known truth.

    papers.py FLOCKREEL [--seeds 1,2,3] [--frames 1200]

Films the virtual fish and analyzes each film in three ways. The first is as Nakajima et al. and Okabe et al.
are printed, the second corrects equation 7 of Nakajima et al., the third has default settings. Writes
bench/results/papers.json and its section of docs/measurements.md.
"""
import json, pathlib, statistics, subprocess, sys, tempfile

import measurements

HERE = pathlib.Path(__file__).resolve().parent
WAYS = [
    ("as printed", ["--preset", "papers", "--set", "eq7=printed"]),
    ("preset `papers`", ["--preset", "papers"]),
    ("default", []),
]
MEASURES = [
    ("detected", "detected_share", lambda v: f"{v:.1%}"),
    ("head right", "head_right_share", lambda v: f"{v:.1%}"),
    ("heading, median", "heading_deg_p50", lambda v: f"{v:.1f}\u00b0"),
    ("heading, p95", "heading_deg_p95", lambda v: f"{v:.1f}\u00b0"),
    ("depth, root mean square error", "z_rmse_m", lambda v: f"{1000 * v:.0f} mm"),
    ("direction in space, median", "forward_deg_p50", lambda v: f"{v:.1f}\u00b0"),
    ("direction in space, p90", "forward_deg_p90", lambda v: f"{v:.1f}\u00b0"),
]


def run(*words):
    return subprocess.run([str(w) for w in words], check=True, capture_output=True, text=True).stdout


def score_all(program, seeds, frames, folder):
    """Returns the scores of each film, by way of analysis."""
    scores = {name: [] for name, _ in WAYS}
    for seed in seeds:
        film, truth, camera = (folder / f"{seed}{end}" for end in (".mp4", ".truth.json", ".camera.json"))
        run(program, "sample", "-o", film, "--truth", truth, "--seed", seed, "--frames", frames)
        known = json.loads(truth.read_text())
        camera.write_text(json.dumps(known["camera"]))
        animal = known["animal"]
        for name, flags in WAYS:
            library = folder / "library"
            run(program, "analyze", film, "-o", library, "--camera", camera, "--animal-length",
                animal["length_m"], "--animal-height", animal["height_m"], *flags)
            scores[name].append(json.loads(run(sys.executable, HERE / "score.py", library / "poses.json", truth)))
    return scores


def cell(scores, key, say):
    values = [s[key] for s in scores if s[key] is not None]
    if not values:
        return "\u2013"
    middle = say(statistics.median(values))
    return middle if len(values) == 1 else f"{middle} ({say(min(values))} to {say(max(values))})"


def result(scores, seeds, frames):
    return {
        "title": "Methods of the papers",
        "about": f"The virtual fish is filmed with a known camera (`flockreel sample`, seeds {', '.join(map(str, seeds))}, {frames} frames). "
                 "Each film is analyzed in three ways, and `bench/score.py` compares the poses with the truth. Cells are the median over the films, "
                 "with minimum and maximum. The first column follows both papers word for word, frame by frame and unsmoothed. The preset "
                 "`papers` corrects equation 7 of Nakajima et al. Both sum moments over the soft silhouette, not over its box. "
                 "[Corrections to the papers](explanation/algorithms.md#corrections-to-the-papers) explains the default.",
        "command": "make papers",
        "head": ["measure", *(name for name, _ in WAYS)],
        "rows": [[label, *(cell(scores[name], key, say) for name, _ in WAYS)] for label, key, say in MEASURES],
    }


def main():
    words = dict(zip(sys.argv[2::2], sys.argv[3::2]))
    seeds = [int(seed) for seed in words.get("--seeds", "1,2,3").split(",")]
    frames = int(words.get("--frames", 1200))
    with tempfile.TemporaryDirectory() as folder:
        measured = result(score_all(sys.argv[1], seeds, frames, pathlib.Path(folder)), seeds, frames)
    measurements.save("papers", measured)
    print("\n".join(measurements.section(measured)))


if __name__ == "__main__":
    main()
