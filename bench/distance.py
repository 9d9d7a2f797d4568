"""Measures the distance engine against SciPy and FAISS, and checks that the distances are equal.

    python3 bench/distance.py [--frames 1200] [--size 96x64] [--clip-frames 8] [--engine PROGRAM]

Makes sprites and times the engine alone by `benches/distance.rs`. Recomputes d from the same RGBA bytes with
scipy.spatial.distance.cdist(..., "cityblock") on one core (docs/explanation/algorithms.md, "Distances"), and
checks d and the window sums D for equality. FAISS is optional and runs with L1 on one core, in 32-bit floats.
Prints one line of JSON.

The share of the machine's psadbw peak is measured with sprites without a blank byte, which are all compared.
Both are timed in turn, and the median of fifteen turns counts. Exits with 1 if the distances differ or the
engine is less than 60 times as fast as SciPy. Requires numpy and scipy.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

# Select one core, before numpy is loaded.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np  # noqa: E402
from scipy.spatial.distance import cdist  # noqa: E402

LEAST_RATIO = 60


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=1200)
    parser.add_argument("--size", default="96x64", help="width x height of a sprite, pixels")
    parser.add_argument("--clip-frames", type=int, default=8)
    parser.add_argument("--engine", help="the built benchmark; cargo builds and runs it when absent")
    args = parser.parse_args()
    width, height = (int(side) for side in args.size.split("x"))
    sprites = make_sprites(args.frames, width, height)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "sprites.rgba").write_bytes(sprites.tobytes())
        engine = run_engine(args, width, height, folder)
        d, clips = np.load(folder / "d.npy"), np.load(folder / "D.npy")
    seconds, wanted = scipy_distances(sprites)
    faiss_s = faiss_seconds(sprites)
    equal = bool(
        np.array_equal(d, wanted) and np.array_equal(clips, window_sums(wanted, args.clip_frames))
    )
    result = {
        "frames": args.frames,
        "size": args.size,
        "clip_frames": args.clip_frames,
        "equal": equal,
        "scipy_s": round(seconds, 3),
        "times_faster_one_thread": round(seconds / engine["one_thread_s"], 1),
        "faiss_s": faiss_s and round(faiss_s, 3),
        "times_faster_than_faiss": faiss_s and round(faiss_s / engine["one_thread_s"], 1),
        **engine,
    }
    print(json.dumps(result))
    return 0 if equal and result["times_faster_one_thread"] >= LEAST_RATIO else 1


def make_sprites(n_frames, width, height):
    """Returns sprites of a shaded ellipse that swims and bends, with noise and soft alpha: (N, h, w, 4)."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[:height, :width]
    sprites = np.zeros((n_frames, height, width, 4), np.uint8)
    for t, sprite in enumerate(sprites):
        bend = 4 * np.sin(t / 5 + x / width * 5) * (x / width)
        across = (y - height / 2 - bend) / (height * (0.25 + 0.1 * np.sin(t / 40)))
        along = (x - width / 2) / (width * 0.45)
        inside = 1 - along**2 - across**2
        sprite[..., 3] = np.clip(inside * 900, 0, 255)
        shade = 90 + 120 * np.clip(inside, 0, 1) + rng.normal(0, 3, inside.shape)
        for channel, tint in enumerate((1.0, 0.6, 0.3)):
            sprite[..., channel] = np.clip(shade * tint, 0, 255)
    return sprites


def run_engine(args, width, height, folder):
    command = [args.engine] if args.engine else ["cargo", "bench", "-q", "-p", "flockreel-core", "--bench", "distance", "--"]
    command += [folder / "sprites.rgba", width, height, args.clip_frames, folder]
    done = subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout.splitlines()[-1])


def faiss_seconds(sprites):
    """Returns the time of FAISS for the same matrix, seconds; None if it is not installed."""
    try:
        import faiss
    except ImportError:
        return None
    faiss.omp_set_num_threads(1)
    u = premultiplied(sprites).astype(np.float32)
    start = time.perf_counter()
    faiss.pairwise_distances(u, u, metric=faiss.METRIC_L1)
    return time.perf_counter() - start


def scipy_distances(sprites):
    """Returns the time of cdist, seconds, and the distances d as integers."""
    u = premultiplied(sprites).astype(np.float64)
    start = time.perf_counter()
    d = cdist(u, u, "cityblock")
    return time.perf_counter() - start, d.astype(np.int64)


def premultiplied(sprites):
    """Returns the premultiplied bytes of every sprite, one row each."""
    alpha = sprites[..., 3:].astype(np.int64)
    color = (alpha * sprites[..., :3] + 127) // 255
    return np.concatenate([color, alpha], axis=-1).reshape(len(sprites), -1)


def window_sums(d, clip_frames):
    """Returns the window sums D(i, j) = sum over k < f of d(i + k, j + k)."""
    n_clips = len(d) - clip_frames + 1
    return sum(d[k : k + n_clips, k : k + n_clips] for k in range(clip_frames))


if __name__ == "__main__":
    sys.exit(main())
