#!/usr/bin/env python3
"""Measures the speed of the boids against a loop of NumPy with scipy.spatial.cKDTree, and against Mesa.

    bench/boids.py [--count 100000] [--steps 10] [--engine PROGRAM]

The loop applies the three rules to the same number of boids at the same density (1.5 square body lengths per
boid). Each boid has the 16 nearest neighbors within 6 body lengths. The loop works in the plane, without
field of view, wander or overlap. SciPy may use all cores.

Mesa's BoidFlockers has the same number of boids at the same density, and 16 visible neighbors on average. It
compares all pairs, and a step of 100 000 boids would take a quarter of an hour. So only the steps of a sample
of its boids are timed. Its rate with 1000 boids is reported too.

Each rate is the best of three runs. Prints one line of JSON. Exits with 1 unless flockreel makes 8 times the
boid-steps per second of the loop and 1000 times those of Mesa. Requires numpy and scipy; Mesa and networkx
are optional.
"""
import argparse
import json
import subprocess
import sys
import time

import numpy as np
from scipy.spatial import cKDTree

LEAST_OF_LOOP, LEAST_OF_MESA = 8, 1000
STEP_S, CRUISE, TURN = 1 / 30, 1.0, 3.0
ROOM_BL2 = 1.5  # square body lengths per boid, as in benches/boids.rs
MESA_SAMPLE, FEW, N_RUNS = 100, 1000, 3


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--engine", help="the built benchmark; cargo builds and runs it when absent")
    args = parser.parse_args()
    command = [args.engine] if args.engine else ["cargo", "bench", "-q", "-p", "flockreel-core", "--bench", "boids", "--"]
    done = subprocess.run([*command, str(args.count), str(args.steps)], check=True, stdout=subprocess.PIPE)
    result = json.loads(done.stdout.splitlines()[-1])
    rate = args.count / result["all_threads_s"]
    loop = loop_rate(args.count, max(args.steps // 3, 2))
    mesa, mesa_of_few = mesa_rate(args.count), mesa_rate(FEW)
    result.update(agent_steps_per_s=round(rate), loop_per_s=round(loop), of_loop=round(rate / loop, 1))
    within = rate >= LEAST_OF_LOOP * loop
    if mesa is not None:
        result.update(mesa_per_s=round(mesa), of_mesa=round(rate / mesa))
        result.update(mesa_of_1000_per_s=round(mesa_of_few), of_mesa_of_1000=round(rate / mesa_of_few))
        within &= rate >= LEAST_OF_MESA * mesa
    print(json.dumps({**result, "within": bool(within)}))
    return int(not within)


def loop_rate(count, steps):
    """Returns the boid-steps per second of the loop."""
    draw = np.random.default_rng(1)
    side = (ROOM_BL2 * count) ** 0.5
    places, turns = draw.uniform(0, side, (count, 2)), draw.uniform(0, 2 * np.pi, count)
    velocities = CRUISE * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    rates = []
    for _ in range(N_RUNS):
        start = time.perf_counter()
        for _ in range(steps):
            places, velocities = step(places, velocities, side)
        rates.append(count * steps / (time.perf_counter() - start))
    return max(rates)


def step(places, velocities, side):
    distances, ids = cKDTree(places).query(places, k=17, distance_upper_bound=6.0, workers=-1)
    distances, ids = distances[:, 1:], ids[:, 1:]
    found = np.isfinite(distances)
    ids = np.where(found, ids, 0)
    offsets = places[ids] - places[:, None]
    near, beside = found & (distances < 1.0), found & (distances < 3.0)
    push = np.where(near, (1.0 / np.maximum(distances, 0.05) - 1.0) / np.maximum(distances, 0.05), 0.0)
    apart = -(offsets * push[..., None]).sum(axis=1)
    n_beside, n_found = (np.maximum(which.sum(axis=1), 1)[:, None] for which in (beside, found))
    along = (velocities[ids] * beside[..., None]).sum(axis=1) / n_beside - velocities * (n_beside > 0)
    toward = (offsets * found[..., None]).sum(axis=1) / n_found / 6.0
    walls = (places < 1.0).astype(float) - (places > side - 1.0)
    wished = 1.5 * apart + 4.0 * walls + 2.0 * along + 0.8 * toward
    size = np.linalg.norm(wished, axis=1, keepdims=True)
    velocities = velocities + STEP_S * CRUISE * TURN * wished / np.maximum(size, 1.0)
    velocities *= CRUISE / np.maximum(np.linalg.norm(velocities, axis=1, keepdims=True), 1e-9)
    return np.clip(places + STEP_S * velocities, 0.0, side), velocities


def mesa_rate(count):
    """Returns the boid-steps per second of Mesa's example, from a sample of its boids; None without Mesa."""
    try:
        from mesa.examples.basic.boid_flockers.model import BoidFlockers
    except ImportError:
        return None
    side, vision = (ROOM_BL2 * count) ** 0.5, (16 * ROOM_BL2 / np.pi) ** 0.5
    model = BoidFlockers(population_size=count, width=side, height=side, vision=vision, separation=1.0)
    agents = list(model.agents)[:MESA_SAMPLE]
    rates = []
    for _ in range(N_RUNS):
        start = time.perf_counter()
        for agent in agents:
            agent.step()
        rates.append(len(agents) / (time.perf_counter() - start))
    return max(rates)


if __name__ == "__main__":
    sys.exit(main())
