#!/usr/bin/env python3
"""Measures the time of plans, from 20 individuals x 400 frames to 1000 x 1000, and over 50 000 source frames.

    bench/plan.py [--engine PROGRAM] [--library DIR] [--small-only]

The cases are:

- 20 x 400 over 1200 source frames with both mirror sides
- 1000 x 1000 over the same frames, and over one side of them
- 20 x 400 over 50 000 source frames

Runs benches/plan.rs on a generated library or on DIR, and prints one line of JSON for each case with its
limit in seconds. Times are those of the plan alone, the minimum of some runs. Exits with 1 if a limit is
missed.
"""
import argparse
import json
import subprocess
import sys

# Individuals, frames, runs, further arguments, and the time limit with all threads in seconds.
CASES = [(20, 400, 30, [], 0.060), (1000, 1000, 1, [], 4.0), (1000, 1000, 1, ["--one-side"], 4.0),
         (20, 400, 1, ["--of=50000"], None)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--engine", help="the built benchmark; cargo builds and runs it when absent")
    parser.add_argument("--library", help="a folder that `flockreel analyze` made")
    parser.add_argument("--small-only", action="store_true")
    args = parser.parse_args()
    command = [args.engine] if args.engine else ["cargo", "bench", "-q", "-p", "flockreel-core", "--bench", "plan", "--"]
    missed = False
    for count, frames, runs, flags, bar_s in CASES[: 1 if args.small_only else None]:
        words = [*command, str(count), str(frames), str(runs), *flags, *([args.library] if args.library else [])]
        done = subprocess.run(words, check=True, stdout=subprocess.PIPE)
        result = json.loads(done.stdout.splitlines()[-1])
        result.update(bar_s=bar_s, within=bar_s is None or result["all_threads_s"] < bar_s)
        missed |= not result["within"]
        print(json.dumps(result), flush=True)
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
