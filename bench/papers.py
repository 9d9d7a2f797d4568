#!/usr/bin/env python3
"""Compares flockreel with the two papers as printed, on films with known truth.

    papers.py FLOCKREEL [--seeds 1,2,3] [--frames 1200]

Films the virtual fish and analyzes each film in three ways. The first is as Nakajima et al. and Okabe et al.
are printed, the second corrects equation 7 of Nakajima et al., the third has default settings. Writes a table
of the scores (docs/measurements.md).
"""
import json, pathlib, statistics, subprocess, sys, tempfile

HERE = pathlib.Path(__file__).resolve().parent
TABLE = HERE.parent / "docs" / "PAPERS.md"
WAYS = [
    ("N and O as printed", ["--preset", "papers", "--set", "eq7=printed"]),
    ("preset `papers`: N (7) the right way round", ["--preset", "papers"]),
    ("flockreel", []),
]
MEASURES = [
    ("detected", "detected_share", lambda v: f"{100 * v:.1f} %"),
    ("head right", "head_right_share", lambda v: f"{100 * v:.1f} %"),
    ("heading, median", "heading_deg_p50", lambda v: f"{v:.1f}\u00b0"),
    ("heading, p95", "heading_deg_p95", lambda v: f"{v:.1f}\u00b0"),
    ("depth, RMSE", "z_rmse_m", lambda v: f"{1000 * v:.0f} mm"),
    ("direction, median", "forward_deg_p50", lambda v: f"{v:.1f}\u00b0"),
    ("direction, p90", "forward_deg_p90", lambda v: f"{v:.1f}\u00b0"),
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


def table(scores, seeds, frames):
    lines = [
        "# The papers as printed, and flockreel",
        "",
        f"Written by `make papers`: {len(seeds)} films of the virtual fish (`flockreel sample`, seeds "
        f"{', '.join(map(str, seeds))}, {frames} frames), each analyzed three ways and scored against its truth "
        "(`bench/score.py`). Median over the films, with the least and the most.",
        "",
        "| | " + " | ".join(name for name, _ in WAYS) + " |",
        "| --- |" + " ---: |" * len(WAYS),
    ]
    for label, key, say in MEASURES:
        lines.append(f"| {label} | " + " | ".join(cell(scores[name], key, say) for name, _ in WAYS) + " |")
    lines += [
        "",
        "What the first two columns take from the papers word for word: the arctangent of a quotient (N 4), which",
        "gives the axis nearer the horizontal; the other axis as the height (N 5.3), each frame by itself; the head",
        "where it was in the frame before (O 3.3), toward +axis in the first; each frame's own values, unsmoothed;",
        "acos of the clamped quotient (N 8); the sign of the depth, which N leaves open, by the change from the",
        "frame before. What they do not: moments are summed over the silhouette with its soft alpha, not over the",
        "box, and pixels are square.",
        "",
    ]
    return "\n".join(lines)


def main():
    words = dict(zip(sys.argv[2::2], sys.argv[3::2]))
    seeds = [int(seed) for seed in words.get("--seeds", "1,2,3").split(",")]
    frames = int(words.get("--frames", 1200))
    with tempfile.TemporaryDirectory() as folder:
        text = table(score_all(sys.argv[1], seeds, frames, pathlib.Path(folder)), seeds, frames)
    TABLE.write_text(text)
    print(text)


main()
