#!/usr/bin/env python3
"""Measures how exactly a flock of one on the animal's own path reproduces the footage, in levels of 255.

    bench/reproduce.py PROGRAM LIBRARY_DIR FOOTAGE [LIBRARY_DIR FOOTAGE ...]

Takes the longest run of frames in which the animal is whole, at most 400. Makes a flock.json of one
individual that shows these frames at their original place without a jump, and renders it as pictures and as
MP4. Prints mean absolute differences from the footage over R, G and B:

- `pictures` and `mp4`: the renderings, within the animal's box; the pictures must be below 2
- `again`: the footage encoded once more with the program's settings, within the box
- `scene`: the background, outside of the box, which no rendering could predict
- `without`: the background, within the box

ffmpeg converts films to RGB with exact rounding. Requires numpy and cv2. Exits with 1 if a limit is missed.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

from render import OWN

MOST_FRAMES = 400
MOST_OFF = 2.0


def main():
    program, *pairs = sys.argv[1:]
    missed = False
    for library, footage in zip(pairs[::2], pairs[1::2]):
        with tempfile.TemporaryDirectory() as folder:
            off = measure(program, pathlib.Path(library), footage, pathlib.Path(folder))
        missed |= not off["pictures"] < MOST_OFF
        told = "  ".join(f"{name} {value:.2f}" for name, value in off.items())
        print(f"{library}: {told}{'' if off['pictures'] < MOST_OFF else ' *'}", flush=True)
    return int(missed)


def measure(program, library, footage, folder):
    poses = json.loads((library / "poses.json").read_text())
    first, n_frames = longest_run(poses["frames"])
    shown = poses["frames"][first : first + n_frames]
    flock = folder / "flock.json"
    flock.write_text(json.dumps(along_its_own_path(program, library, shown, folder)))
    run(program, "flock", library, "-o", folder / "drawn", "--format", "png", "--from", flock)
    run(program, "flock", library, "-o", folder / "film.mp4", "--from", flock)
    run("ffmpeg", "-nostdin", "-v", "error", "-i", footage, "-vsync", "0", "-pix_fmt", "yuv420p", *OWN, folder / "again.mp4")
    background = cv2.imread(str(library / "background.png")).astype(int)
    off = {name: [] for name in ("pictures", "mp4", "again", "scene", "without")}
    size = poses["image_size_px"]
    film = frames_of(folder / "film.mp4", size)
    both = zip(frames_of(footage, size), frames_of(folder / "again.mp4", size), strict=True)
    for frame_idx, (real, again) in enumerate(both):
        if not first <= frame_idx < first + n_frames:
            continue
        x, y, w, h = (int(side) for side in shown[frame_idx - first]["box_px"])
        box = np.s_[y : y + h, x : x + w]
        drawn = cv2.imread(str(folder / "drawn" / f"{frame_idx - first:06d}.png")).astype(int)
        off["pictures"].append(np.abs(drawn - real)[box].mean())
        off["mp4"].append(np.abs(next(film) - real)[box].mean())
        off["again"].append(np.abs(again - real)[box].mean())
        off["without"].append(np.abs(background - real)[box].mean())
        around = np.abs(background - real)
        around[box] = 0
        off["scene"].append(around.sum() / (around.size - 3 * w * h))
    assert n_frames and len(off["pictures"]) == n_frames, f"{footage}: not the footage of {library}"
    return {name: float(np.mean(values)) for name, values in off.items()} | {"frames": n_frames}


def along_its_own_path(program, library, poses, folder):
    """Returns a flock.json of one individual that shows these frames where they were filmed."""
    plan, n_frames = folder / "plan.json", len(poses)
    run(program, "flock", library, "-o", folder / "one", "--format", "png", "--count", "1", "--frames", "2", "--plan", plan)
    flock = json.loads(plan.read_text())
    flock["params"]["frames"] = n_frames
    flock["stats"].pop("per_frame", None)
    (one,) = flock["individuals"]
    one |= {
        "source_frame": [pose["frame"] for pose in poses],
        "mirrored": [False] * n_frames,
        "rotation_rad": [0.0] * n_frames,
        "scale": [1.0] * n_frames,
        "fade": [],
        "centroid_px": [pose["centroid_px"] for pose in poses],
        "heading_rad": [pose["heading_rad"] or 0.0 for pose in poses],
        "forward": None,
        "depth_m": None,
    }
    still = [0.0] * n_frames
    one["boid"] |= {"position": [[0.0] * 3] * n_frames, "forward": None, "heading_rad": still, "speed": still}
    return flock


def longest_run(frames):
    """Returns the first frame and the length of the longest run of frames in which the animal is whole."""
    best, first = (0, 0), 0
    for idx, pose in enumerate(frames):
        if not pose["detected"] or pose["cut"]:
            first = idx + 1
        elif idx + 1 - first > best[1]:
            best = (first, idx + 1 - first)
    return best[0], min(best[1], MOST_FRAMES)


def frames_of(video, size):
    width, height = size
    rgb = ["-vf", f"scale={width}:{height}:flags=neighbor+accurate_rnd+full_chroma_int", "-pix_fmt", "bgr24"]
    words = ["ffmpeg", "-nostdin", "-v", "error", "-i", str(video), *rgb, "-f", "rawvideo", "-vsync", "0", "-"]
    with subprocess.Popen(words, stdout=subprocess.PIPE) as child:
        while len(frame := child.stdout.read(width * height * 3)) == width * height * 3:
            yield np.frombuffer(frame, np.uint8).reshape(height, width, 3).astype(int)


def run(*command):
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main())
