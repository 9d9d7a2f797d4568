#!/usr/bin/env python3
"""Compares the virtual animal with the filmed one: silhouettes and colors, drawn with the camera of the footage.

    fish.py FLOCKREEL [--footage FOLDER] [--seeds 1,2,3] [--frames 400]

Films the sample, and takes the recordings below from the folder. Analyzes each film, and makes the virtual animal with
default parameters. `flockreel fish --json` tells how far both agree. Writes bench/results/fish.json and its section of
docs/measurements.md.
"""
import json, pathlib, subprocess, sys, tempfile

import measurements

# Recording, flags of the analysis, and the least overlap and the largest difference of color that are wanted.
FILMS = [
    ("goldfish_black_water.mp4", [], 0.80, 25),
    ("zebrafish_larva_single.mkv", ["--view", "top"], 0.75, None),
    ("zebrafish_juvenile_single.avi", ["--view", "top"], 0.75, None),
    ("mouse_openfield.mp4", ["--view", "top"], 0.75, None),
]
SAMPLE = (0.88, 20)


def run(*words):
    return subprocess.run([str(w) for w in words], check=True, capture_output=True, text=True).stdout


def compare(program, film, flags, folder):
    library = folder / f"{film.stem}.library"
    run(program, "analyze", film, "-o", library, *flags)
    return json.loads(run(program, "fish", library, "-o", folder / "fish.glb", "--json"))


def row(name, found, overlap, levels):
    def cell(value, bar, say, is_met):
        return f"{say(value)}{'' if bar is None or is_met(value, bar) else ' *'}"
    return [
        name, str(found["compared_frames"]),
        cell(found["silhouette_overlap"], overlap, lambda v: f"{v:.2f}", lambda v, bar: v > bar), f"> {overlap:.2f}",
        cell(found["color_difference_levels"], levels, lambda v: f"{v:.1f}", lambda v, bar: v < bar), f"< {levels}" if levels else "",
    ]


def main():
    words = dict(zip(sys.argv[2::2], sys.argv[3::2]))
    program, seeds, rows = sys.argv[1], words.get("--seeds", "1,2,3").split(","), []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for seed in seeds:
            film = folder / f"sample-{seed}.mp4"
            run(program, "sample", "-o", film, "--seed", seed, "--frames", words.get("--frames", 400))
            rows.append(row(f"sample, seed {seed}", compare(program, film, [], folder), *SAMPLE))
        for film, flags, *bars in FILMS if "--footage" in words else []:
            rows.append(row(f"`{film}`", compare(program, pathlib.Path(words["--footage"]) / film, flags, folder), *bars))
    measured = {
        "title": "Likeness of the virtual animal",
        "about": "The virtual animal with default parameters, drawn with the camera of the footage, against the mattes of the same frames. Only frames that "
                 "show the whole animal are compared, at most 300 of a film. Overlap is the intersection of both silhouettes divided by their union, and the "
                 "difference of color is the mean of the absolute differences inside both, of 255 levels; cells are medians over the frames. No camera is given.",
        "command": "make fish FOOTAGE=folder",
        "head": ["film", "frames", "overlap", "bar", "difference of color", "bar"],
        "rows": rows,
    }
    measurements.save("fish", measured)
    print("\n".join(measurements.section(measured)))


if __name__ == "__main__":
    main()
