#!/usr/bin/env python3
"""Scores poses.json against the truth of a generated film.

    score.py POSES.json TRUTH.json [--worst]

TRUTH.json comes from a film generator: frames with centroid_px, forward and position_m; animal with length_m.
The poses.json format of `flockreel sample --truth` is also accepted. Prints one JSON object with errors and
shares (docs/explanation/algorithms.md, "Quality measures").
"""
import json, math, sys


def percentile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * (len(values) - 1) + .5))] if values else None


def wrap(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def main():
    poses, truth = (json.load(open(path)) for path in sys.argv[1:3])
    # goldfish.py has pixel centers at integers, flockreel at half-integers.
    offset = 0 if "schema" in truth else .5
    centroid, heading, flips, angles, z = [], [], [], [], []
    n_seen = n_detected = 0
    worst = []
    for k, (got, want) in enumerate(zip(poses["frames"], truth["frames"])):
        if not want["centroid_px"] or want["centroid_px"][0] is None:
            continue
        n_seen += 1
        if not got["detected"]:
            continue
        n_detected += 1
        centroid.append(math.dist(got["centroid_px"], [c + offset for c in want["centroid_px"]]))
        forward = want["forward"]
        cos_gamma = math.hypot(forward[0], forward[1])
        if cos_gamma > .5 and got["heading_rad"] is not None:
            gap = abs(wrap(got["heading_rad"] - math.atan2(forward[1], forward[0])))
            heading.append(gap)
            flips.append(gap > math.pi / 2)
            worst.append((gap, k))
        if got["forward"] and want["position_m"]:
            dot = sum(a * b for a, b in zip(got["forward"], forward))
            angles.append(math.acos(max(-1, min(1, dot))))
        if got["position_m"] and want["position_m"] and not got["cut"]:
            z.append((got["position_m"][2], want["position_m"][2]))
    scale = sum(a * b for a, b in z) / sum(a * a for a, _ in z) if z else None
    rmse = lambda s: math.sqrt(sum((s * a - b) ** 2 for a, b in z) / len(z)) if z else None
    degrees = lambda values, share: None if not values else math.degrees(percentile(values, share))
    print(json.dumps({
        "frames": n_seen, "detected_share": n_detected / max(n_seen, 1),
        "centroid_px_p50": percentile(centroid, .5), "centroid_px_p95": percentile(centroid, .95),
        "head_right_share": 1 - sum(flips) / max(len(flips), 1),
        "heading_deg_p50": degrees(heading, .5), "heading_deg_p95": degrees(heading, .95),
        "z_rmse_m": rmse(1.0), "z_scaled_rmse_m": rmse(scale) if z else None, "z_scale": scale,
        "forward_deg_p50": degrees(angles, .5), "forward_deg_p90": degrees(angles, .9),
    }))
    if "--worst" in sys.argv:
        for gap, k in sorted(worst, reverse=True)[:12]:
            print(f"frame {k}: heading off by {math.degrees(gap):.0f} degrees", file=sys.stderr)


main()
