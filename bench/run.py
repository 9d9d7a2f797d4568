"""Measures the run of Okabe et al. against ffmpeg: 1200 frames, 20 individuals x 400 frames, 640x480.

    python3 bench/run.py [PROGRAM]      PROGRAM: target/release/flockreel

The time of `analyze` plus `flock` is compared with that of ffmpeg: decoding the 1200 frames to rgb24, plus
encoding 400 frames with x264 veryfast. The encoded frames are those of the flock, from a raw file. The steps
alternate for three rounds, and the medians are compared. Exits with 1 if the ratio is 3 or more.
"""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

N_ROUNDS = 3
LIMIT = 3.0


def main():
    program = Path(sys.argv[1] if len(sys.argv) > 1 else "target/release/flockreel").resolve()
    folder = Path(tempfile.mkdtemp(prefix="flockreel-bench-"))
    try:
        ratio = measure(program, folder)
    finally:
        shutil.rmtree(folder)
    return 0 if ratio < LIMIT else 1


def measure(program, folder):
    film, library, flock, raw = folder / "film.mp4", folder / "library", folder / "flock.mp4", folder / "flock.yuv"
    run([program, "sample", "-o", film, "--frames", "1200", "--seed", "1"])

    def analyze():
        shutil.rmtree(library, ignore_errors=True)
        run([program, "analyze", film, "-o", library])

    def make_flock():
        flock.unlink(missing_ok=True)
        run([program, "flock", library, "-o", flock, "--count", "20", "--frames", "400"])

    def decode():
        ffmpeg("-i", film, "-f", "rawvideo", "-pix_fmt", "rgb24", "/dev/null")

    def encode():
        size = ["-f", "rawvideo", "-pix_fmt", "yuv420p", "-s", "640x480", "-r", "30"]
        ffmpeg(*size, "-i", raw, "-c:v", "libx264", "-preset", "veryfast", folder / "encoded.mp4")

    analyze(), make_flock()  # makes the raw frames to encode, and warms the disk cache
    ffmpeg("-i", flock, "-frames:v", "400", "-f", "rawvideo", "-pix_fmt", "yuv420p", raw)

    steps = [("ffmpeg decode 1200", decode), ("ffmpeg encode 400", encode), ("analyze 1200", analyze), ("flock 20 x 400", make_flock)]
    times_s = {name: [] for name, _ in steps}
    for _ in range(N_ROUNDS):
        for name, step in steps:
            times_s[name].append(seconds_of(step))
    return report(times_s)


def report(times_s):
    median_s = {name: statistics.median(rounds) for name, rounds in times_s.items()}
    print(f"O's run on {os.cpu_count()} cores, medians of {N_ROUNDS} rounds")
    for name, rounds in times_s.items():
        print(f"  {name:20} {median_s[name]:7.2f} s   ({', '.join(f'{time_s:.2f}' for time_s in rounds)})")
    decode_s, encode_s, analyze_s, flock_s = median_s.values()
    ratio = (analyze_s + flock_s) / (decode_s + encode_s)
    print(f"  flockreel / ffmpeg   {ratio:7.2f}     (wanted: below {LIMIT:g})")
    return ratio


def seconds_of(step):
    began = time.perf_counter()
    step()
    return time.perf_counter() - began


def ffmpeg(*arguments):
    run(["ffmpeg", "-nostdin", "-v", "error", "-y", *arguments])


def run(command):
    subprocess.run([str(part) for part in command], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main())
