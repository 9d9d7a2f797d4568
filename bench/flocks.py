#!/usr/bin/env python3
"""Compares planned flocks with the films of their animals, in motion and appearance.

    flocks.py FLOCKREEL GENERATOR [--footage FOLDER] [--films FOLDER] [--only NAME...]

Each film is analyzed with default settings. Flocks of 300 frames are planned with three seeds and as many
individuals as have room. Speeds, shown and filmed, are those of the centroid over two frames in body lengths
per second, at least two frames away from a jump. Shown speeds are divided by the scale of the sprite. Writes
bench/results/flocks.json and its section of docs/measurements.md.
"""
import argparse, json, math, operator, pathlib, shutil, statistics, subprocess, tempfile

import cv2
import numpy as np

import cases
from table import starred, table

HERE = pathlib.Path(__file__).resolve().parent
PLACE = HERE.parent / "target" / "flocks"
RESULTS = HERE / "results" / "flocks.json"
CLIPS = ("goldfish_black_water", "mouse_round_arena", "zebrafish_juvenile_single", "zebra_finch_cage", "mouse_homecage_bedding",
         "mouse_openfield", "dog_side_with_hand", "zebrafish_larva_single")
GENERATED = ("plain-1", "silver-2", "dark-3")
SEEDS, N_FRAMES = (1, 2, 3), 300
REST, MOVING = .1, .3
# Frames on each side of a jump that a fade may change, plus one.
AROUND = 3
# For each figure: its label, its bar, its format, and the views that it applies to.
HOLDS = {">": operator.gt, "<": operator.lt, "<=": operator.le}
ALL, SIDE, TOP = ("side", "top"), ("side",), ("top",)
BARS = {
    "as_filmed": ("frames whose speed is within 25% or 0.05 BL/s of that of the film frame shown", (">", .85), "{:.1%}", ALL),
    "correlation": ("correlation of shown and filmed speed", (">", .9), "{:.2f}", ALL),
    "states_off": ("share of frames at rest, slow, usual and fast speed: largest difference from the film", ("<=", .1), "{:.1%}", ALL),
    "rest_moving": ("film frames at rest that are shown moving (over 0.3 BL/s)", ("<", .01), "{:.2%}", ALL),
    "jumps": ("jumps per 100 frames", ("<", 4), "{:.1f}", ALL),
    "heading_p90_deg": ("difference of the heading from that of the simulated boid, 90th percentile, degrees", ("<", 8), "{:.1f}", SIDE),
    "loops": ("frames in which a short run repeats three times or more", ("<", .02), "{:.1%}", ALL),
    "lookalikes": ("animals with a neighbor within 3 BL that shows nearly the same frame, mean over frames", ("<", .25), "{:.0%}", ALL),
    "cuts_above_natural": ("visible jumps: change between frames above the 99th percentile of the film", ("<=", 0), "{:.1%}", ALL),
    "overlap": ("share of the area of bodies that overlaps other bodies", ("<", .01), "{:.1%}", TOP),
    "halo": ("halo: share of alpha more than 2.5 px outside the outline", ("<", .01), "{:.1%}", TOP),
    "stray": ("changed pixels that belong to no animal and no shadow", ("<", .03), "{:.1%}", ALL),
    "blobs": ("separate bodies in the picture of a flock of 20 with 1.5 BL spacing, mean", (">", 16), "{:.1f}", SIDE),
    "polarization": ("polarization (1 = all head in one direction)", None, "{:.2f}", ALL),
    "playable": ("frames that a flock may show, of those that the border does not cut", None, "{:.0%}", ALL),
    "individuals": ("individuals", None, "{:.0f}", ALL),
}


def wrap(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def class_of(speed, usual):
    """Returns 0 for rest, 1 slow, 2 go, 3 dart."""
    return np.select([speed < REST, speed < .5 * usual, speed < 2 * usual], [0, 1, 2], 3)


def film_speeds(poses, length_px):
    """Returns the speed at each frame, body lengths/s; nan if the animal is missing before or after."""
    nan = [math.nan, math.nan]
    centroids = np.array([pose["centroid_px"] or nan for pose in poses["frames"]], float)
    speeds = np.full(len(centroids), math.nan)
    speeds[1:-1] = np.linalg.norm(centroids[2:] - centroids[:-2], axis=1) * poses["fps"] / 2 / length_px
    return speeds


def loops_share(one):
    """Returns the share of frames in loops: runs of 2 to 32 frames shown at least three times in a row."""
    states = [2 * frame + side for frame, side in zip(one["source_frame"], one["mirrored"])]
    looped = 0
    for t in range(len(states)):
        looped += any(t >= 2 * n and states[t] == states[t - n] == states[t - 2 * n] for n in range(2, 33))
    return looped / len(states)


def lookalikes(flock):
    """Returns the share of individuals and frames with a similar neighbor.

    The neighbor is within 3 body lengths and shows a frame at most 10 frames away, on the same side.
    """
    people = flock["individuals"]
    places = np.array([one["centroid_px"] for one in people], float)
    frames = np.array([one["source_frame"] for one in people])
    sides = np.array([one["mirrored"] for one in people])
    near = np.linalg.norm(places[:, None] - places[None], axis=-1) < 3 * flock["length_px"]
    both = near & (np.abs(frames[:, None] - frames[None]) <= 10) & (sides[:, None] == sides[None])
    both[np.arange(len(people)), np.arange(len(people))] = False
    return float(both.any(1).mean())


def overlap(flock, poses):
    """Returns the share of the bodies' area that overlaps other bodies, over every 10th frame.

    A body is an ellipse with the area and length of its outline.
    """
    width, height = (side // 2 for side in poses["image_size_px"])
    y, x = np.mgrid[0:height, 0:width]
    covered, total = 0, 0
    for t in range(0, len(flock["individuals"][0]["source_frame"]), 10):
        count = np.zeros((height, width), np.uint8)
        for one in flock["individuals"]:
            pose = poses["frames"][one["source_frame"][t]]
            along, across = pose["length_px"] / 2, pose["area_px"] / math.pi / (pose["length_px"] / 2)
            (cx, cy), angle = one["centroid_px"][t], one["heading_rad"][t]
            dx, dy = 2 * x - cx, 2 * y - cy
            a, b = dx * math.cos(angle) + dy * math.sin(angle), dy * math.cos(angle) - dx * math.sin(angle)
            count += (a / along) ** 2 + (b / across) ** 2 <= 1
        covered += int(count[count > 1].sum())
        total += int(count.sum())
    return covered / max(total, 1)


def motion(flock, poses, component):
    length_px, fps = flock["length_px"], poses["fps"]
    film = film_speeds(poses, length_px)
    known = film[component]
    known = known[~np.isnan(known)]
    usual = float(np.median(known[known >= REST])) if (known >= REST).any() else 1.0
    shown, filmed, errors, n_jumps, n = [], [], [], 0, 0
    for one in flock["individuals"]:
        frames, sides = np.array(one["source_frame"]), np.array(one["mirrored"])
        places = np.array(one["centroid_px"], float)
        scale = np.array(one.get("scale") or np.ones(len(frames)), float)
        jump = (frames[1:] != frames[:-1] + 1) | (sides[1:] != sides[:-1])
        n_jumps, n = n_jumps + int(jump.sum()), n + len(frames)
        speed = np.linalg.norm(places[2:] - places[:-2], axis=1) * fps / 2 / length_px / scale[1:-1]
        whole = ~(jump[1:] | jump[:-1])
        shown.append(speed[whole])
        filmed.append(film[frames[1:-1]][whole])
        errors.append(np.abs(wrap(np.array(one["heading_rad"]) - np.array(one["boid"]["heading_rad"]))))
    shown, filmed = np.concatenate(shown), np.concatenate(filmed)
    shown, filmed = shown[~np.isnan(filmed)], filmed[~np.isnan(filmed)]
    resting = filmed < REST
    shares = [np.bincount(class_of(v, usual), minlength=4) / max(len(v), 1) for v in (known, shown)]
    return {
        "as_filmed": float(np.mean(np.abs(shown - filmed) <= np.maximum(.25 * filmed, .05))),
        "correlation": float(np.corrcoef(shown, filmed)[0, 1]),
        "rest_moving": float(np.mean(shown[resting] > MOVING)) if resting.any() else 0.0,
        "states_off": float(np.abs(shares[0] - shares[1]).max()),
        "jumps": 100 * n_jumps / n, "heading_p90_deg": float(np.degrees(np.quantile(np.concatenate(errors), .9))),
        "loops": statistics.mean(map(loops_share, flock["individuals"])), "lookalikes": lookalikes(flock),
        "polarization": flock["stats"]["polarization"], "individuals": len(flock["individuals"]),
    }


def sprites_of(folder, poses):
    """Returns each sprite as premultiplied RGB and alpha, in top view rotated to heading 0, or None."""
    def compared(frame):
        path = folder / f"{frame:06}.png"
        rgba = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) if path.exists() else None
        if rgba is None or not rgba[..., 3].any():
            return None
        alpha = rgba[..., 3:].astype(np.int32)
        planes = np.concatenate([(alpha * rgba[..., :3] + 127) // 255, alpha], axis=-1)
        heading = poses["frames"][frame]["heading_rad"]
        if poses["view"] == "side" or not heading:
            return planes
        height, width = planes.shape[:2]
        # cv2 rotates counterclockwise in the picture for a positive angle; a heading is clockwise.
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), np.degrees(heading), 1)
        return cv2.warpAffine(planes.astype(np.float32), turn, (width, height)).round().astype(np.int32)
    return [compared(frame) for frame in range(len(poses["frames"]))]


def halo(alphas):
    """Returns the share of alpha more than 2.5 px outside the contour at 1/2, the median of 20 pictures."""
    shares = []
    for alpha in alphas[::max(1, len(alphas) // 20)]:
        alpha = np.pad(alpha, 8)
        away = cv2.distanceTransform((alpha < 128).astype(np.uint8), cv2.DIST_L2, 5)
        shares.append(float(alpha[away > 2.5].sum() / alpha.sum()))
    return statistics.median(shares) if shares else None


def stray(film, truth, background):
    """Returns the share of changed pixels that no label explains, over every 10th frame.

    Changed pixels differ from the background by more than 12 levels. Labels are those of animals and shadows;
    a pixel more than 2 px outside of all of them is unexplained.
    """
    video, t, n_changed, n_stray = cv2.VideoCapture(str(film)), 0, 0, 0
    background = cv2.imread(str(background)).astype(np.int16)
    while (read := video.read())[0]:
        if t % 10 == 0:
            name = f"{t:06}.png"
            files = [truth / kind / name for kind in ("masks", "shadows") if (truth / kind / name).exists()]
            shown = sum((cv2.imread(str(file), cv2.IMREAD_UNCHANGED) > 0).astype(np.uint8) for file in files) > 0
            away = cv2.distanceTransform((~shown).astype(np.uint8), cv2.DIST_L2, 5)
            changed = np.abs(read[1].astype(np.int16) - background).max(axis=-1) > 12
            n_changed, n_stray = n_changed + int(changed.sum()), n_stray + int((changed & (away > 2)).sum())
        t += 1
    return n_stray / max(n_changed, 1)


def blobs(run, library, folder, poses):
    """Returns the mean number of separate bodies in a film of 20 individuals, 1.5 body lengths apart.

    A body is a connected component that differs from the background by more than 12 levels, with at least 30
    % of the animal's area.
    """
    film = folder / "blobs.mp4"
    run("flock", library, "-o", film, "--count", 20, "--spacing", 1.5, "--frames", 200)
    background = cv2.imread(str(library / "background.png")).astype(np.int16)
    least_px = .3 * statistics.median(pose["area_px"] for pose in poses["frames"] if pose["area_px"])
    video, counts = cv2.VideoCapture(str(film)), []
    while (read := video.read())[0]:
        changed = (np.abs(read[1].astype(np.int16) - background).max(axis=-1) > 12).astype(np.uint8)
        stats = cv2.connectedComponentsWithStats(changed, connectivity=8)[2]
        counts.append(int((stats[1:, cv2.CC_STAT_AREA] >= least_px).sum()))
    return statistics.mean(counts)


def cuts_above_natural(flock, sprites, poses):
    """Returns the share of jumps with a step between drawn frames above the film's 99th percentile."""
    top = poses["view"] == "top"
    turned = lambda sprite: sprite[::-1] if top else sprite[:, ::-1]
    look = lambda frame, is_mirrored: turned(sprites[frame]) if is_mirrored else sprites[frame]
    step = lambda a, b: float(np.abs(a - b).sum())
    natural = [step(a, b) for a, b in zip(sprites, sprites[1:]) if a is not None and b is not None]
    limit, above = float(np.percentile(natural, 99)), []
    for one in flock["individuals"]:
        shown = list(zip(one["source_frame"], one["mirrored"]))
        fades = {fade["start"] + k: (frame, fade["mirrored"], fade["weight"][k])
                 for fade in one["fade"] for k, frame in enumerate(fade["source_frame"])}

        def drawn(t):
            picture, fade = look(*shown[t]), fades.get(t)
            return picture if fade is None else (1 - fade[2]) * picture + fade[2] * look(*fade[:2])

        for t in range(AROUND, len(shown) - AROUND):
            if shown[t] != (shown[t - 1][0] + 1, shown[t - 1][1]):
                around = [drawn(u) for u in range(t - AROUND, t + AROUND)]
                above.append(max(step(a, b) for a, b in zip(around, around[1:])) > limit)
    return statistics.mean(above) if above else 0.0


def measure(program, name, film, flags):
    """Returns the mean of each figure over the seeds, or the code of a refusal."""
    library = PLACE / name
    shutil.rmtree(library, ignore_errors=True)
    run = lambda *words: subprocess.run([str(word) for word in (program, *words)], capture_output=True, text=True)
    code = lambda done: done.stderr.rstrip().rsplit("(", 1)[-1].rstrip(")") if "(" in done.stderr else done.stderr.strip()
    done = run("analyze", film, "-o", library, *flags)
    if done.returncode:
        codes = [line.rsplit("(", 1)[1].rstrip(")") for line in done.stderr.splitlines() if line.endswith(")")]
        return {"refused": codes[-1] if codes else "failed"}
    poses = json.loads((library / "poses.json").read_text())
    component = json.loads((library / "library.json").read_text())["component"]
    uncut = {pose["frame"] for pose in poses["frames"] if pose["detected"] and not pose["cut"]}
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        run("sprites", library, "-o", folder / "sprites")
        sprites = sprites_of(folder / "sprites", poses)
        for seed in SEEDS:
            plan = folder / "flock.json"
            film, truth = folder / "flock.mp4", folder / "truth"
            done = run("flock", library, "-o", film, "--plan", plan, "--ground-truth", truth, "--frames", N_FRAMES, "--seed", seed)
            if done.returncode:
                return {"refused": code(done)}
            flock = json.loads(plan.read_text())
            figures.append(motion(flock, poses, component) | {"cuts_above_natural": cuts_above_natural(flock, sprites, poses),
                                                         "stray": stray(film, truth, library / "background.png")}
                           | ({"overlap": overlap(flock, poses)} if poses["view"] == "top" else {}))
        dense = {"blobs": blobs(run, library, folder, poses)} if poses["view"] == "side" else {}
    means = {key: statistics.mean(one[key] for one in figures) for key in figures[0]} | dense
    return {"view": poses["view"], **means, "halo": halo([sprite[..., 3] for sprite in sprites if sprite is not None]), "playable": len(uncut & set(component)) / max(len(uncut), 1)}


def page(results):
    """Returns the section of docs/measurements.md."""
    yield "## Motion and appearance of flocks"
    yield ""
    yield ("Flocks of 300 frames are compared with the films of their animals. They have default settings, and as many individuals as fit, "
           "at most 20. Figures are the mean of three seeds, and `bench/flocks.py` defines them. The first three films from the side are generated, "
           "all others are recordings.")
    yield ""
    yield "Repeat: `make flocks GENERATOR=goldfish.py FOOTAGE=folder`"
    for name, film in results.items():
        if "refused" in film:
            yield from ("", f"`{name}` is refused: `{film['refused']}`.")
    for view, title in (("side", "From the side"), ("top", "From above")):
        names = [name for name, film in results.items() if film.get("view") == view]
        yield from ("", f"### {title}", "")
        yield from table(["measure", *names, "bar"], [(label, *(figure(results[name][key], bar, form) for name in names), limit(bar, form))
                                                      for key, (label, bar, form, views) in BARS.items() if view in views])


def figure(value, bar, form):
    return starred(form.format(value), bar is None or HOLDS[bar[0]](value, bar[1]))


def limit(bar, form):
    return f"{bar[0]} {form.format(bar[1])}" if bar else ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("generator", type=pathlib.Path)
    parser.add_argument("--footage", type=pathlib.Path)
    parser.add_argument("--films", type=pathlib.Path, default=HERE.parent / "target" / "accuracy")
    parser.add_argument("--only", nargs="+", help="measure these films alone, and keep the figures of the others")
    args = parser.parse_args()
    import measurements  # not at the top, because it imports this file
    films = [(name, path, flags) for name, path, _, flags, _ in cases.films(args.generator, args.films) if name in GENERATED]
    if args.footage:
        clips = [json.loads((HERE / "labels" / f"{clip}.json").read_text())["clip"] for clip in CLIPS]
        films += [(clip, args.footage / file, []) for clip, file in zip(CLIPS, clips)]
    results = json.loads(RESULTS.read_text()) if args.only and RESULTS.exists() else {}
    for name, film, flags in films:
        if not args.only or name in args.only:
            results[name] = measure(args.program, name, film, flags)
            words = [f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}" for key, value in results[name].items()]
            print(f"{name:28}", *words, flush=True)
    measurements.save("flocks", results)


if __name__ == "__main__":
    main()
