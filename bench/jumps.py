#!/usr/bin/env python3
"""Lists the jumps of the centroid in poses.json, as frames to inspect.

    jumps.py POSES.json... [--above 0.3]

A jump is a step of more than --above body lengths between consecutive frames. The body length is the 80th
percentile of length_px over uncut frames. Prints one line for each file and one for each jump: frame, step in
body lengths, ratio of the areas. A fast animal also makes such steps.
"""
import argparse, json, math

ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
ap.add_argument("poses", nargs="+")
ap.add_argument("--above", type=float, default=.3, help="body lengths")
args = ap.parse_args()

for path in args.poses:
    frames = json.load(open(path))["frames"]
    found = [f for f in frames if f["detected"] and f["length_px"]]
    lengths = sorted(f["length_px"] for f in found if not f["cut"]) or sorted(f["length_px"] for f in found)
    if not lengths:
        print(f"{path}: nothing was found")
        continue
    length_px = lengths[int(.8 * (len(lengths) - 1))]
    jumps = []
    for a, b in zip(frames, frames[1:]):
        if a["detected"] and b["detected"]:
            step = math.dist(a["centroid_px"], b["centroid_px"]) / length_px
            if step > args.above:
                jumps.append((b["frame"], step, b["area_px"] / a["area_px"]))
    print(f"{path}: {len(jumps)} jumps above {args.above} of {length_px:.0f} px in {len(frames)} frames")
    for frame, step, areas in jumps:
        print(f"  frame {frame}: {step:.2f} lengths, area x {areas:.2f}")
