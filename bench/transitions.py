"""Measures the search for transitions, and how its time grows with the number of frames.

    python3 bench/transitions.py [--library DIR] [--most 50000] [--engine PROGRAM] [--write PAGE]

With --library: compares all distances between clips with the search below the library's epsilon, each on one
core and on all cores. Then runs the search for 1, 2, 5, 10, 20 and 50 thousand generated sprites of 96 x 64,
each in its own process. The two largest also run approximately. Prints seconds, peak memory, and the exponent
of growth, by least squares on logarithms. Exits with 1 unless 20 000 frames take less than 60 s and 1 GB.
--write writes the table to a page. Requires no packages.
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import sys

SIZES = (1000, 2000, 5000, 10000, 20000, 50000)
MOST_S, MOST_MB = 60, 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--library", help="a library to compare all distances with the pruned ones on")
    parser.add_argument("--most", type=int, default=20000, help="the largest number of frames")
    parser.add_argument("--engine", help="the built benchmark; cargo builds and runs it when absent")
    parser.add_argument("--write", type=pathlib.Path, help="the page to write the table to")
    args = parser.parse_args()
    if args.library:
        print(json.dumps(run(args.engine, args.library)))
    rows = []
    for n in (n for n in SIZES if n <= args.most):
        rows.append(run(args.engine, n))
        print(json.dumps(rows[-1]), flush=True)
    approximate = [run(args.engine, n, "approximate") for n in SIZES[-2:] if n <= args.most]
    for row in approximate:
        print(json.dumps(row), flush=True)
    exponent = slope([(row["frames"], row["seconds"]) for row in rows[1:]])
    print(f"seconds grow as frames to the power of {exponent:.2f}")
    if args.write:
        args.write.write_text(page(rows, approximate, exponent))
    twenty = [row for row in rows if row["frames"] == 20000]
    good = all(row["seconds"] < MOST_S and row["peak_mb"] < MOST_MB for row in twenty)
    print(f"20000 frames in under {MOST_S} s and {MOST_MB} MB: {'yes' if good else 'NO'}")
    return 0 if good else 1


def run(engine, *arguments):
    command = [engine] if engine else ["cargo", "bench", "-q", "--bench", "transitions", "--"]
    done = subprocess.run([*command, *map(str, arguments)], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout.splitlines()[-1])


def slope(points):
    xs, ys = zip(*((math.log(x), math.log(y)) for x, y in points))
    x_mean, y_mean = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - x_mean) * (y - y_mean) for x, y in zip(xs, ys)) / sum((x - x_mean) ** 2 for x in xs)


def page(rows, approximate, exponent):
    lines = [
        "# How the search for transitions grows",
        "",
        "Made by `python3 bench/transitions.py --write docs/SCALING.md`: sprites of 96 x 64 drawn by code (a fish that",
        "turns at random and beats its tail), both mirror sides, from the sprites to the playback graph, exact where nothing "
        f"else is said (`approximate`, with the share of like pairs that it finds); {os.cpu_count()} cores.",
        "",
        "| frames | seconds | peak memory | candidates | transitions |",
        "| --- | --- | --- | --- | --- |",
    ]
    for row in rows + approximate:
        how = "" if row["recall"] is None else f" approximately, recall {row['recall']:.3f}"
        lines.append(
            f"| {row['frames']:,}{how} | {row['seconds']:.2f} | {row['peak_mb']} MB | {row['candidates']:,} | {row['transitions']:,} |"
        )
    lines += ["", f"Seconds grow as frames to the power of {exponent:.2f} (fitted from the second row on).", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
