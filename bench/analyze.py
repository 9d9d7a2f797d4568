"""Measures an analysis against ffmpeg's decoding alone and against a loop in Python with OpenCV.

    python3 bench/analyze.py [PROGRAM [FILM]]      PROGRAM: target/release/flockreel

The steps alternate for five rounds on one film, by default 1200 frames of 640x480 from `flockreel sample`,
and the medians are compared. Exits with 1 unless all of these hold:

- at most 1.6 times the time of `ffmpeg` decoding to YUV
- at least 5 times as fast as `opencv_loop.py`; skipped with a message without opencv-python-headless
- less than 300 MB for the program and its children together (proportional set size, sampled every 20 ms),
  also for the film repeated nine times

`ffmpeg to a pipe` is a lower bound for every program that reads from its own decoder.
"""
import importlib.util
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import threading
import time

N_ROUNDS = 5
MOST_OF_FFMPEG, LEAST_OF_OPENCV, MOST_MB = 1.6, 5.0, 300


def main():
    program = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "target/release/flockreel").resolve()
    with tempfile.TemporaryDirectory(prefix="flockreel-bench-") as folder:
        folder = pathlib.Path(folder)
        film = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else folder / "film.mp4"
        if not film.exists():
            run(program, "sample", "-o", film, "--frames", 1200, "--seed", 1)
        steps = {
            "ffmpeg to YUV": ["ffmpeg", "-nostdin", "-v", "error", "-y", "-i", film, "-f", "rawvideo", "-pix_fmt", "yuv420p", "/dev/null"],
            "ffmpeg to a pipe": ["sh", "-c", 'ffmpeg -nostdin -v error -threads 1 -i "$0" -f rawvideo -pix_fmt yuv420p -avioflags direct pipe:1 | dd of=/dev/null bs=1M', film],
            "analyze": [program, "analyze", film, "-o", folder / "library"],
        }
        if importlib.util.find_spec("cv2"):
            steps["OpenCV loop"] = [sys.executable, pathlib.Path(__file__).with_name("opencv_loop.py"), film]
        rounds = {name: [] for name in steps}
        for name in list(steps) * (N_ROUNDS + 1):
            rounds[name].append(seconds_of(steps[name]))
        # The first round fills the disk cache and is not counted.
        long = folder / "long.mp4"
        run("ffmpeg", "-v", "error", "-stream_loop", 8, "-i", film, "-c", "copy", long)
        memory_mb = [peak_mb([program, "analyze", path, "-o", folder / "library"]) for path in (film, long)]
        return verdict({name: times[1:] for name, times in rounds.items()}, memory_mb)


def verdict(rounds, memory_mb):
    median_s = {name: statistics.median(times) for name, times in rounds.items()}
    print(f"analysis on {os.cpu_count()} cores, medians of {N_ROUNDS} rounds")
    for name, times in rounds.items():
        print(f"  {name:16} {median_s[name]:6.2f} s   ({', '.join(f'{time_s:.2f}' for time_s in times)})")
    of_ffmpeg = median_s["analyze"] / median_s["ffmpeg to YUV"]
    print(f"  analyze / ffmpeg  {of_ffmpeg:6.2f}     (wanted: at most {MOST_OF_FFMPEG:g})")
    of_pipe = median_s["analyze"] / median_s["ffmpeg to a pipe"]
    print(f"  analyze / pipe    {of_pipe:6.2f}")
    for what, mb in zip(("memory", "of the long film"), memory_mb):
        print(f"  {what:16} {mb:6.0f} MB   (wanted: below {MOST_MB})")
    good = of_ffmpeg <= MOST_OF_FFMPEG and max(memory_mb) < MOST_MB
    if "OpenCV loop" not in median_s:
        print("  OpenCV / analyze: SKIPPED, opencv-python-headless is not installed")
        return int(not good)
    of_opencv = median_s["OpenCV loop"] / median_s["analyze"]
    print(f"  OpenCV / analyze  {of_opencv:6.2f}     (wanted: at least {LEAST_OF_OPENCV:g})")
    return int(not (good and of_opencv >= LEAST_OF_OPENCV))


def seconds_of(command):
    began = time.perf_counter()
    run(*command)
    return time.perf_counter() - began


def peak_mb(command):
    """Returns the peak memory of a command and its children, MB."""
    process = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    most = 0
    waiting = threading.Thread(target=process.wait)
    waiting.start()
    while waiting.is_alive():
        most = max(most, sum(map(pss_kb, family(process.pid))))
        waiting.join(0.02)
    return most / 1024


def family(pid):
    found = [pid]
    for parent in found:
        try:
            for task in pathlib.Path(f"/proc/{parent}/task").iterdir():
                found += [int(child) for child in (task / "children").read_text().split()]
        except OSError:
            pass  # the process has ended
    return found


def pss_kb(pid):
    try:
        lines = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))


def run(*command):
    subprocess.run([str(word) for word in command], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main())
