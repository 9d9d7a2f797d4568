"""Measures the search for transitions, and how its time grows with the number of frames.

    bench/transitions.py [--library DIR] [--most 50000] [--engine PROGRAM] [--write]

With --library: compares all distances between clips with the search below the library's epsilon, each on one
core and on all cores. Then runs the search for 1, 2, 5, 10, 20 and 50 thousand generated sprites of 96 x 64,
each in its own process. Prints seconds, peak memory, and the exponent of growth from 2000 frames on, by least
squares on logarithms. Exits with 1 unless 20 000 frames take less than 60 s and 1 GB. --write writes
bench/results/transitions.json and its section of docs/measurements.md.
"""

import argparse
import json
import math
import os
import subprocess
import sys

import measurements
from table import starred

SIZES = (1000, 2000, 5000, 10000, 20000, 50000)
# The bar applies to one size: its frames, most seconds and most memory.
BAR_FRAMES, MOST_S, MOST_MB = 20000, 60, 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--library", help="a library to compare all distances with the pruned ones on")
    parser.add_argument("--most", type=int, default=20000, help="the largest number of frames")
    parser.add_argument("--engine", help="the built benchmark; cargo builds and runs it when absent")
    parser.add_argument("--write", action="store_true", help="store the figures and write the page")
    args = parser.parse_args()
    if args.library:
        print(json.dumps(run(args.engine, args.library)))
    rows = []
    for n in (n for n in SIZES if n <= args.most):
        rows.append(run(args.engine, n))
        print(json.dumps(rows[-1]), flush=True)
    exponent = slope([(row["frames"], row["seconds"]) for row in rows[1:]])
    print(f"seconds grow as frames to the power of {exponent:.2f}")
    if args.write:
        measurements.save("transitions", result(rows, exponent))
    good = all(is_met(row) for row in rows if row["frames"] == BAR_FRAMES)
    print(f"{BAR_FRAMES} frames in under {MOST_S} s and {MOST_MB} MB: {'yes' if good else 'NO'}")
    return 0 if good else 1


def run(engine, *arguments):
    command = [engine] if engine else ["cargo", "bench", "-q", "--bench", "transitions", "--"]
    done = subprocess.run([*command, *map(str, arguments)], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout.splitlines()[-1])


def slope(points):
    xs, ys = zip(*((math.log(x), math.log(y)) for x, y in points))
    x_mean, y_mean = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - x_mean) * (y - y_mean) for x, y in zip(xs, ys)) / sum((x - x_mean) ** 2 for x in xs)


def is_met(row):
    return row["seconds"] < MOST_S and row["peak_mb"] < MOST_MB


def result(rows, exponent):
    def cells(row):
        has_bar = row["frames"] == BAR_FRAMES
        seconds = starred(f"{row['seconds']:.2f} s", not has_bar or is_met(row))
        bar = f"< {MOST_S} s, < {MOST_MB} MB" if has_bar else ""
        return [f"{row['frames']:,}", seconds, f"{row['peak_mb']} MB", f"{row['candidates']:,}", f"{row['transitions']:,}", bar]

    return {
        "title": "Growth of the search for transitions",
        "about": "Time and memory from the sprites to the playback graph, with both mirror sides, on "
                 f"{os.cpu_count()} cores. The sprites of 96 x 64 pixels show a drawn fish that turns at random and beats its tail. "
                 f"Time grows as the number of frames to the power of {exponent:.2f}, from {rows[1]['frames']:,} frames on.",
        "command": "make transitions",
        "head": ["frames", "time", "peak memory", "candidates", "transitions", "bar"],
        "rows": [cells(row) for row in rows],
    }


if __name__ == "__main__":
    sys.exit(main())
