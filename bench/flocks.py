#!/usr/bin/env python3
"""How good flocks are: the measures of ALGORITHMS.md 9 on libraries that `flockreel analyze` made.

    bench/flocks.py PROGRAM LIBRARY_DIR... [--count 20] [--frames 400] [--seed 1] [--preset school] [--match BY] [--matching JSON]

For each library plans a flock, and prints what flock.json's stats say with their bars (* = missed), how far headings
shown in the picture are from the boids' (with a camera the stats tell directions in space), how many frames
the component has, and how visible the cuts are: for each jump that the flock plays, the step across it between
the sprites as exported (RGB times alpha, and alpha; ALGORITHMS.md 5), over the median step between consecutive
sprites, hard as if nothing were faded; and `faded`, the largest step between frames around a jump with the fades as
they are drawn (`natural_window`: the same around frames without a jump). `jammed` is the share of boids and seconds in which one
swims but does not get away. Needs numpy and cv2.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

# The figure, its greatest value, and how it is printed.
BARS = [
    ("heading_error_median_deg", 1.0),
    ("heading_error_p90_deg", 6.0),
    ("picture_median_deg", 1.0),
    ("picture_p90_deg", 6.0),
    ("jumps_per_100_frames", 4.0),
    ("clone_share", 0.005),
    ("cut_median", 1.3),
    ("cut_above_natural_p99", 0.0),
    ("faded_median", 1.3),
    ("faded_above_natural_p99", 0.0),
    ("path_deviation_p95_bl", 0.25),
    ("slip_median_rad", 0.05),
    ("jammed", 0.01),
    ("wall_violations", 0),
    ("overlap_violations", 0),
]

# Who gets no farther than this share of its way in a second is jammed.
JAMMED = 0.15

# What a preset is known by: its least polarization and milling, and their greatest.
PRESETS = {"school": ((0.65, 0), (1, 1)), "mill": ((0, 0.65), (0.35, 1)), "swarm": ((0, 0), (0.35, 0.35))}

# Frames either side of a jump that a fade may change, and one more.
AROUND = 3


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("libraries", nargs="+", type=pathlib.Path)
    for name, default in [("count", "20"), ("frames", "400"), ("seed", "1"), ("preset", "school"), ("match", None), ("matching", None)]:
        parser.add_argument(f"--{name}", default=default)
    args = parser.parse_args()
    for library in args.libraries:
        with tempfile.TemporaryDirectory() as folder:
            figures = measure(args, library, pathlib.Path(folder))
        if isinstance(figures, str):
            print(f"{library.name:28} {figures}", flush=True)
            continue
        words = [f"{name} {figures[name]:.4g}{'*' if figures[name] > bar else ''}" for name, bar in BARS]
        least, most = PRESETS.get(args.preset, ((0, 0), (1, 1)))
        for name, low, high in zip(("polarization", "milling"), least, most):
            words.append(f"{name} {figures[name]:.2f}{'' if low <= figures[name] <= high else '*'}")
        print(f"{library.name:28} component {figures['component']} of {figures['n_frames']} frames, {', '.join(words)}, "
              f"natural_window {figures['natural_window']:.3f}, variety {figures['variety']:.2f}, bound gap {figures['gap']:.3f}", flush=True)


def measure(args, library, folder):
    plan = folder / "flock.json"
    words = [args.program, "flock", library, "-o", folder / "x.mp4", "--plan", plan]
    for name in ("match", "matching"):
        words += [f"--{name}", getattr(args, name)] if getattr(args, name) else []
    for name in ("count", "frames", "seed", *(["preset"] if args.preset != "school" else [])):
        words += [f"--{name}", getattr(args, name)]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        return "refused: " + done.stderr.strip().splitlines()[-1]
    flock = json.loads(plan.read_text())
    known = json.loads((library / "library.json").read_text())
    poses = json.loads((library / "poses.json").read_text())
    n_frames = len(poses["frames"])
    subprocess.run([args.program, "sprites", library, "-o", folder / "sprites"], check=True, capture_output=True)
    median, p99, cuts, faded, windows = cut_steps(folder / "sprites", flock, poses)
    stats, costs = flock["stats"], [one["cost"] for one in flock["individuals"]]
    total, bound = (sum(cost[key] for cost in costs) for key in ("total", "lower_bound"))
    gaps = np.concatenate([np.subtract(one["heading_rad"], one["boid"]["heading_rad"]) for one in flock["individuals"]])
    gaps = np.degrees(np.abs((gaps + np.pi) % (2 * np.pi) - np.pi))
    return {
        **stats,
        "picture_median_deg": float(np.median(gaps)),
        "picture_p90_deg": float(np.percentile(gaps, 90)),
        "heading_error_median_deg": np.degrees(stats["heading_error_median_rad"]),
        "heading_error_p90_deg": np.degrees(stats["heading_error_p90_rad"]),
        "jammed": jammed(flock),
        "component": len(known["component"]),
        "n_frames": n_frames,
        "cut_median": float(np.median(cuts)) / median if cuts else 0.0,
        "cut_above_natural_p99": float(np.mean([cut > p99 for cut in cuts])) if cuts else 0.0,
        "faded_median": float(np.median(faded)) / median if faded else 0.0,
        "faded_above_natural_p99": float(np.mean([step > p99 for step in faded])) if faded else 0.0,
        "natural_window": float(np.median(windows)) / median,
        "gap": (total - bound) / max(total, 1e-9),
    }


def jammed(flock):
    """The share of boids and seconds in which a boid never gets a sixth or so of its way from where it was."""
    second = round(flock["fps"])
    places = np.array([one["boid"]["position"] for one in flock["individuals"]]) / flock["length_px"]
    speeds = np.array([one["boid"]["speed"] for one in flock["individuals"]])
    n = places.shape[1] - second
    if n <= 0:
        return 0.0
    ways = np.linalg.norm(np.stack([places[:, k : k + n] for k in range(1, second + 1)]) - places[:, :n], axis=3).max(axis=0)
    swum = np.cumsum(speeds, axis=1) / flock["fps"]
    return float((ways < JAMMED * (swum[:, second:] - swum[:, :-second])).mean())


def cut_steps(folder, flock, poses):
    """The median and the 99th percentile of natural steps, the step of each cut played, the largest step around
    each with its fades, and the largest step of as many consecutive frames of the footage.

    In top view sprites are turned to heading 0 first, and mirrored top to bottom.
    """
    top = poses["view"] == "top"
    headings = [(frame["heading_rad"] or 0.0) if top else 0.0 for frame in poses["frames"]]
    sprites = [compared(folder / f"{frame:06}.png", heading) for frame, heading in enumerate(headings)]
    mirrored = (lambda sprite: sprite[::-1]) if top else (lambda sprite: sprite[:, ::-1])
    step = lambda a, b: float(np.abs(a - b).sum())
    natural = [step(a, b) for a, b in zip(sprites, sprites[1:]) if a is not None and b is not None]
    span = 2 * AROUND - 1
    windows = [max(natural[k : k + span]) for k in range(0, len(natural) - span, span)]
    cuts, faded, known = [], [], {}
    for one in flock["individuals"]:
        shown = list(zip(one["source_frame"], one["mirrored"]))
        fades = {}
        for fade in one["fade"]:
            for k, frame in enumerate(fade["source_frame"]):
                fades[fade["start"] + k] = (frame, fade["mirrored"], fade["weight"][k])
        for t, ((a, side), (b, other)) in enumerate(zip(shown, shown[1:]), start=1):
            if (b, other) == (a + 1, side) or sprites[a] is None or sprites[b] is None:
                continue
            key = (a, b, side != other)
            if key not in known:
                known[key] = step(sprites[a], mirrored(sprites[b]) if key[2] else sprites[b])
            cuts.append(known[key])
            if AROUND <= t <= len(shown) - AROUND:
                drawn = [blended(sprites, shown[u], fades.get(u), mirrored) for u in range(t - AROUND, t + AROUND)]
                if all(picture is not None for picture in drawn):
                    faded.append(max(step(a, b) for a, b in zip(drawn, drawn[1:])))
    return float(np.median(natural)), float(np.percentile(natural, 99)), cuts, faded, windows


def blended(sprites, shown, fade, mirrored):
    """What a frame of an individual shows, with what fades into it; None where a sprite is missing."""
    look = lambda frame, is_mirrored: mirrored(sprites[frame]) if is_mirrored else sprites[frame]
    if sprites[shown[0]] is None or (fade and sprites[fade[0]] is None):
        return None
    picture = look(*shown)
    return picture if fade is None else (1 - fade[2]) * picture + fade[2] * look(*fade[:2])


def compared(path, turned_rad):
    """A sprite turned back by an angle, as it is compared; None where the animal was not found."""
    rgba = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) if path.exists() else None
    if rgba is None or not rgba[..., 3].any():
        return None
    rgba = rgba.astype(np.int32)
    alpha = rgba[..., 3:]
    planes = np.concatenate([(alpha * rgba[..., :3] + 127) // 255, alpha], axis=-1)
    if turned_rad:
        height, width = planes.shape[:2]
        # cv2 turns counterclockwise in the picture for a positive angle; a heading is clockwise.
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), np.degrees(turned_rad), 1)
        planes = cv2.warpAffine(planes.astype(np.float32), turn, (width, height)).round().astype(np.int32)
    return planes


if __name__ == "__main__":
    sys.exit(main())
