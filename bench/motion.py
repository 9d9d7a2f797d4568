#!/usr/bin/env python3
"""Whether a flock moves as its animal moved: speeds, states, rest, loops and look-alikes of planned flocks.

    bench/motion.py PROGRAM LIBRARY_DIR... [--count N] [--frames 300] [--seed 1] [--matching JSON]

Plans a flock of each library and compares what it shows with what was filmed, at frames two or more away from a jump.
Speeds are those of the centroid over two frames, body lengths a second, divided by the scale of the sprite.
"""
import argparse, json, math, pathlib, subprocess, tempfile

import numpy as np

REST, MOVING = .1, .3


def wrap(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def class_of(speed, usual):
    """0 rest, 1 slow, 2 go, 3 dart."""
    return np.select([speed < REST, speed < .5 * usual, speed < 2 * usual], [0, 1, 2], 3)


def film_speeds(poses, length_px):
    """By frame, nan where the animal was not found before or after."""
    nan = [math.nan, math.nan]
    centroids = np.array([pose["centroid_px"] or nan for pose in poses["frames"]], float)
    speeds = np.full(len(centroids), math.nan)
    speeds[1:-1] = np.linalg.norm(centroids[2:] - centroids[:-2], axis=1) * poses["fps"] / 2 / length_px
    return speeds


def loops_share(frames, sides):
    """Frames in runs of at most 32 played for the third time in a row or more."""
    states = [f * 2 + s for f, s in zip(frames, sides)]
    looped = 0
    for t in range(len(states)):
        looped += any(t >= 2 * n and states[t] == states[t - n] == states[t - 2 * n] for n in range(2, 33))
    return looped / len(states)


def measure(flock, poses, component):
    length_px, fps = flock["length_px"], poses["fps"]
    film = film_speeds(poses, length_px)
    known = film[component]
    known = known[~np.isnan(known)]
    usual = float(np.median(known[known >= REST])) if (known >= REST).any() else 1.0
    shown, filmed, errors, n_jumps, n, loops = [], [], [], 0, 0, []
    people = flock["individuals"]
    for one in people:
        frames, sides = np.array(one["source_frame"]), np.array(one["mirrored"])
        places = np.array(one["centroid_px"], float)
        scale = np.array(one.get("scale") or np.ones(len(frames)), float)
        jump = (frames[1:] != frames[:-1] + 1) | (sides[1:] != sides[:-1])
        n_jumps += int(jump.sum())
        n += len(frames)
        speed = np.linalg.norm(places[2:] - places[:-2], axis=1) * fps / 2 / length_px / scale[1:-1]
        whole = ~(jump[1:] | jump[:-1])
        shown.append(speed[whole])
        filmed.append(film[frames[1:-1]][whole])
        errors.append(np.abs(wrap(np.array(one["heading_rad"]) - np.array(one["boid"]["heading_rad"]))))
        loops.append(loops_share(frames.tolist(), sides.tolist()))
    shown, filmed = np.concatenate(shown), np.concatenate(filmed)
    ok = ~np.isnan(filmed)
    shown, filmed = shown[ok], filmed[ok]
    resting = filmed < REST
    classes = [np.bincount(class_of(v, usual), minlength=4) / max(len(v), 1) for v in (known, shown)]
    alike = lookalikes(people, length_px)
    return {
        "as_filmed": float(np.mean(np.abs(shown - filmed) <= np.maximum(.25 * filmed, .05))),
        "correlation": float(np.corrcoef(shown, filmed)[0, 1]) if len(shown) > 2 else 0.0,
        "rest_moving": float(np.mean(shown[resting] > MOVING)) if resting.any() else 0.0,
        "film_states": classes[0].round(3).tolist(), "shown_states": classes[1].round(3).tolist(),
        "states_off": float(np.abs(classes[0] - classes[1]).max()),
        "jumps": 100 * n_jumps / n, "heading_p90_deg": float(np.degrees(np.quantile(np.concatenate(errors), .9))),
        "loops": float(np.mean(loops)), "lookalikes": alike,
        **({"overlap": overlap(people, poses, poses["image_size_px"][::-1])} if poses["view"] == "top" else {}),
        **{key: flock["stats"][key] for key in ("polarization", "wall_violations", "room_for", "path_deviation_p95_bl", "variety")},
    }


def lookalikes(people, length_px):
    """Share of animals and frames with another within 3 body lengths that shows nearly the same frame on the same side."""
    places = np.array([one["centroid_px"] for one in people], float)
    frames = np.array([one["source_frame"] for one in people])
    sides = np.array([one["mirrored"] for one in people])
    near = np.linalg.norm(places[:, None] - places[None], axis=-1) < 3 * length_px
    same = (np.abs(frames[:, None] - frames[None]) <= 10) & (sides[:, None] == sides[None])
    both = near & same
    both[np.arange(len(people)), np.arange(len(people))] = False
    return float(both.any(1).mean())


def overlap(people, poses, shape):
    """Share of the bodies' area that lies under or over another body: ellipses of the outlines' areas and lengths, every 10th frame."""
    height, width = (side // 2 for side in shape)
    y, x = np.mgrid[0:height, 0:width]
    covered, total = 0, 0
    for t in range(0, len(people[0]["source_frame"]), 10):
        count = np.zeros((height, width), np.uint8)
        for one in people:
            pose = poses["frames"][one["source_frame"][t]]
            a = pose["length_px"] / 2 * (one.get("scale") or [1])[t if one.get("scale") else 0]
            b = pose["area_px"] / math.pi / (pose["length_px"] / 2) * a / (pose["length_px"] / 2)
            (cx, cy), angle = one["centroid_px"][t], one["heading_rad"][t]
            dx, dy = 2 * x - cx, 2 * y - cy
            along, across = dx * math.cos(angle) + dy * math.sin(angle), dy * math.cos(angle) - dx * math.sin(angle)
            count += (along / a) ** 2 + (across / b) ** 2 <= 1
        covered += int(count[count > 1].sum())
        total += int(count.sum())
    return covered / max(total, 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("libraries", nargs="+", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--matching")
    args = parser.parse_args()
    for library in args.libraries:
        with tempfile.TemporaryDirectory() as folder:
            plan = pathlib.Path(folder) / "flock.json"
            words = [args.program, "flock", library, "-o", plan.with_suffix(".png"), "--plan", plan, "--count", args.count,
                     "--frames", args.frames, "--seed", args.seed, *(["--matching", args.matching] if args.matching else [])]
            done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
            if done.returncode:
                print(f"{library.name:28} {done.stderr.splitlines()[-1]}")
                continue
            flock = json.loads(plan.read_text())
        poses = json.loads((library / "poses.json").read_text())
        component = json.loads((library / "library.json").read_text())["component"]
        figures = measure(flock, poses, component)
        print(f"{library.name:28}", *(f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}"
                                      for key, value in figures.items()), flush=True)


if __name__ == "__main__":
    main()
