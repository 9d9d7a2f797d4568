"""Measures the rendering of a flock against encoding the same frames with x264 alone.

    python3 bench/render.py LIBRARY_DIR [PROGRAM]      PROGRAM: target/release/flockreel

Two films are rendered: 20 individuals x 400 frames at the size of the footage, and 500 individuals x 100
frames at 1920x1080. The ratio of the times must be below 1.25 and 1.5. Each film is planned once. Then two
steps alternate for five rounds, and their medians are compared:

- rendering the plan (`rendered_s`, from the first sprite to the finished file)
- ffmpeg encoding the same frames from a raw file with x264 veryfast (crf 18, 4 threads)

The program uses a cheaper motion search than that preset. ffmpeg therefore also encodes with the program's
settings, and the increase of the file size is reported. The raw frames are the drawn ones, because encoded
frames have lost detail. Last, the peak memory for 400 and 10 000 frames is compared. Exits with 1 if a ratio
is missed or the memory grows.
"""

import json
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

N_ROUNDS = 5
ENCODER = ["-c:v", "libx264", "-preset", "veryfast", "-profile:v", "high", "-crf", "18", "-threads", "4"]
# The encoder settings of src/media/encode/coding.rs.
OWN = [*ENCODER, "-x264-params", "cpu-independent=1:subme=1:me=dia"]


def main():
    library = Path(sys.argv[1]).resolve()
    program = Path(sys.argv[2] if len(sys.argv) > 2 else "target/release/flockreel").resolve()
    folder = Path(tempfile.mkdtemp(prefix="flockreel-bench-"))
    try:
        small = ratio(program, library, folder, ["--count", "20", "--frames", "400"], [], 1.25)
        large = ratio(program, library, folder, ["--count", "500", "--frames", "100"], ["--size", "1920x1080"], 1.5)
        steady = memory(program, library, folder)
    finally:
        shutil.rmtree(folder)
    return 0 if small and large and steady else 1


def ratio(program, library, folder, flock, film, most):
    plan, video, raw, drawn = folder / "flock.json", folder / "flock.mp4", folder / "flock.yuv", folder / "drawn"
    run([program, "flock", library, "-o", drawn, "--format", "png", "--plan", plan, *flock, *film])
    ffmpeg("-i", drawn / "%06d.png", "-vf", "scale=out_color_matrix=bt709", "-f", "rawvideo", "-pix_fmt", "yuv420p", raw)
    size = probe(drawn / "000000.png")
    shutil.rmtree(drawn)

    def rendered_s():
        done = run([program, "--json", "flock", library, "-o", video, "--from", plan, *film])
        return json.loads(done.stdout)["rendered_s"]

    def encoded_s(encoder):
        began = time.perf_counter()
        ffmpeg("-f", "rawvideo", "-pix_fmt", "yuv420p", "-s", size, "-r", "30", "-i", raw, *encoder, folder / "raw.mp4")
        sizes[encoder is OWN] = (folder / "raw.mp4").stat().st_size
        return time.perf_counter() - began

    sizes = {}
    rounds = [(rendered_s(), encoded_s(ENCODER), encoded_s(OWN)) for _ in range(N_ROUNDS)]
    render_s, encode_s, own_s = (statistics.median(times) for times in zip(*rounds))
    found = render_s / encode_s
    print(f"{' '.join(flock)} at {size}: rendered in {render_s:.2f} s, encoded alone in {encode_s:.2f} s, "
          f"ratio {found:.2f} (wanted: below {most}){'' if found < most else ' *'}; "
          f"with the program's settings in {own_s:.2f} s, ratio {render_s / own_s:.2f}, "
          f"{100 * (sizes[True] / sizes[False] - 1):.0f} % larger", flush=True)
    return found < most


def memory(program, library, folder):
    """Compares the peak resident memory for rendering 400 and 10 000 frames."""
    peaks = {}
    for n_frames in (400, 10_000):
        plan, video = folder / "flock.json", folder / "flock.mp4"
        run([program, "flock", library, "-o", folder / "one.png", "--plan", plan, "--count", "5", "--frames", str(n_frames)])
        words = ["/usr/bin/time", "-v", program, "flock", library, "-o", video, "--from", plan, "--ground-truth", folder / "truth"]
        said = run(words, stderr=subprocess.PIPE).stderr
        peaks[n_frames] = int(re.search(r"Maximum resident set size \(kbytes\): (\d+)", said).group(1)) / 1024
        # Subtract the plan, which is read as a whole and grows with the number of frames.
        peaks[n_frames] -= plan.stat().st_size / 2**20
    short, long = peaks.values()
    print(f"memory beside the plan: {short:.0f} MB for 400 frames, {long:.0f} MB for 10 000")
    return long < 1.3 * short + 32


def probe(video):
    words = ["ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries", "stream=width,height", "-of", "csv=p=0:s=x", video]
    return run(words).stdout.strip()


def ffmpeg(*arguments):
    run(["ffmpeg", "-nostdin", "-v", "error", "-y", *arguments])


def run(command, stderr=subprocess.DEVNULL):
    words = [str(part) for part in command]
    return subprocess.run(words, check=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=stderr, text=True)


if __name__ == "__main__":
    sys.exit(main())
