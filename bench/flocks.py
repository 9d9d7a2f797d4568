#!/usr/bin/env python3
"""Compares planned flocks with the films of their animals, in motion, places and appearance.

    flocks.py FLOCKREEL GENERATOR [--footage FOLDER] [--films FOLDER] [--only NAME...]
              [--libraries FOLDER] [--keep] [--json FILE]

Each film is analyzed with default settings. Flocks of 300 frames are planned with three seeds and as many
individuals as have room. The first is drawn. Flocks of 1000 frames, of 20 individuals or as many as have room, show
where a flock is. `places.py` defines the figures of places. Speeds, shown and filmed, are those of the centroid over two frames in body lengths
per second, at least two frames away from a jump. Shown speeds are divided by the scale of the sprite. A figure that
a program does not give is null. Writes bench/results/flocks.json and its section of docs/measurements.md.
"""
import argparse, json, math, operator, pathlib, shutil, statistics, subprocess, tempfile

import cv2
import numpy as np

import cases, places
from table import starred, table

HERE = pathlib.Path(__file__).resolve().parent
RESULTS = HERE / "results" / "flocks.json"
CLIPS = ("goldfish_black_water", "mouse_round_arena", "zebrafish_juvenile_single", "zebra_finch_cage", "mouse_homecage_bedding",
         "mouse_openfield", "dog_side_with_hand", "zebrafish_larva_single")
GENERATED = ("plain-1", "silver-2", "dark-3")
SEEDS, N_FRAMES = (1, 2, 3), 300
# Size of the flock whose places are compared with the film's.
N_PLACES, MOST = 1000, 20
REST, MOVING = .1, .3
# Frames on each side of a jump that a fade may change, plus one.
AROUND = 3
# For each figure: its label, its bar, its format, and the views that it applies to.
HOLDS = {">": operator.gt, "<": operator.lt, "<=": operator.le}
ALL, SIDE, TOP = ("side", "top"), ("side",), ("top",)
BARS = {
    "as_filmed": ("frames whose speed is within 25% or 0.05 BL/s of that of the film frame shown", (">", .9), "{:.1%}", ALL),
    "correlation": ("correlation of shown and filmed speed", (">", .9), "{:.2f}", ALL),
    "half_speed": ("film frames that move (over 0.3 BL/s) and are shown below half their speed", ("<", .03), "{:.1%}", ALL),
    "rest_moving": ("film frames at rest that are shown moving (over 0.3 BL/s)", ("<", .01), "{:.2%}", ALL),
    "states_off": ("share of frames at rest, slow, usual and fast speed: largest difference from the film", ("<=", .08), "{:.1%}", ALL),
    "clipped": ("steps that a wall shortens", ("<", .03), "{:.1%}", ALL),
    "world": ("filmed places inside the flock's own world", (">", .97), "{:.0%}", ALL),
    "on_footholds": ("carried frames whose foot is within 0.25 BL of a filmed foothold or its line", (">", .95), "{:.0%}", SIDE),
    "same_cells": ("overlap of shown and filmed places, 8 x 6 cells", (">", .65), "{:.0%}", ALL),
    "visible": ("visible share of the area of bodies", (">", .67), "{:.0%}", SIDE),
    "overlap": ("share of the area of bodies that overlaps other bodies", ("<", .01), "{:.1%}", TOP),
    "neighbor_p10_bl": ("distance to the nearest neighbor in the picture, 10th percentile, BL", None, "{:.2f}", ALL),
    "polarization": ("polarization of shown headings (1 = all in one direction), bar for mice", ("<", .6), "{:.2f}", ALL),
    "jumps": ("jumps per 100 frames", ("<", 4), "{:.1f}", ALL),
    "cuts_above_natural": ("visible jumps: change between frames above the 99th percentile of the film", ("<", .05), "{:.1%}", ALL),
    "loops": ("frames in which a short run repeats three times or more", ("<", .01), "{:.1%}", ALL),
    "lookalikes": ("animals with a neighbor within 3 BL that shows nearly the same frame, mean over frames", ("<", .25), "{:.0%}", ALL),
    "halo": ("halo: share of alpha more than 2.5 px outside the outline", ("<", .01), "{:.1%}", TOP),
    "stray": ("changed pixels that belong to no animal and no shadow", ("<", .03), "{:.1%}", ALL),
    "carried": ("film frames in which something carries the animal", None, "{:.0%}", SIDE),
    "playable": ("frames that a flock may show, of those that the border does not cut", None, "{:.0%}", ALL),
    "individuals": ("individuals", None, "{:.0f}", ALL),
}


def class_of(speed, usual):
    """Returns 0 for rest, 1 slow, 2 go, 3 dart."""
    return np.select([speed < REST, speed < .5 * usual, speed < 2 * usual], [0, 1, 2], 3)


def film_speeds(film, length_px):
    """Returns the speed at each frame, body lengths/s; nan if the animal is missing before or after."""
    speeds = np.full(len(film.centroids), math.nan)
    speeds[1:-1] = np.linalg.norm(film.centroids[2:] - film.centroids[:-2], axis=1) * film.poses["fps"] / 2 / length_px
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
    centroids = np.array([one["centroid_px"] for one in people], float)
    frames = np.array([one["source_frame"] for one in people])
    sides = np.array([one["mirrored"] for one in people])
    near = np.linalg.norm(centroids[:, None] - centroids[None], axis=-1) < 3 * flock["length_px"]
    both = near & (np.abs(frames[:, None] - frames[None]) <= 10) & (sides[:, None] == sides[None])
    both[np.arange(len(people)), np.arange(len(people))] = False
    return float(both.any(1).mean())


def motion(flock, film):
    length_px, fps = flock["length_px"], film.poses["fps"]
    speeds = film_speeds(film, length_px)
    known = speeds[film.component]
    known = known[~np.isnan(known)]
    usual = float(np.median(known[known >= REST])) if (known >= REST).any() else 1.0
    shown, filmed, n_jumps, n = [], [], 0, 0
    for one in flock["individuals"]:
        frames, sides, scale = np.array(one["source_frame"]), np.array(one["mirrored"]), places.column(one, "scale")
        centroids = np.array(one["centroid_px"], float)
        jump = (frames[1:] != frames[:-1] + 1) | (sides[1:] != sides[:-1])
        n_jumps, n = n_jumps + int(jump.sum()), n + len(frames)
        shown.append(np.linalg.norm(centroids[2:] - centroids[:-2], axis=1) * fps / 2 / length_px / scale[1:-1])
        filmed.append(np.where(jump[1:] | jump[:-1], math.nan, speeds[frames[1:-1]]))
    good = [np.where(np.isnan(was), math.nan, np.abs(now - was) <= np.maximum(.25 * was, .05)) for now, was in zip(shown, filmed)]
    clipped = places.clipped(flock, [np.pad(one, 1, constant_values=math.nan) for one in good])
    shown, filmed, good = np.concatenate(shown), np.concatenate(filmed), np.concatenate(good)
    shown, filmed = shown[~np.isnan(filmed)], filmed[~np.isnan(filmed)]
    resting, moving = filmed < REST, filmed > MOVING
    shares = [np.bincount(class_of(v, usual), minlength=4) / max(len(v), 1) for v in (known, shown)]
    return {
        "as_filmed": float(np.nanmean(good)), "correlation": float(np.corrcoef(shown, filmed)[0, 1]),
        "half_speed": float(np.mean(shown[moving] < filmed[moving] / 2)) if moving.any() else None,
        "rest_moving": float(np.mean(shown[resting] > MOVING)) if resting.any() else None,
        "states_off": float(np.abs(shares[0] - shares[1]).max()), "clipped": clipped, "jumps": 100 * n_jumps / n,
        "loops": statistics.mean(map(loops_share, flock["individuals"])), "lookalikes": lookalikes(flock),
        "individuals": len(flock["individuals"]),
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


def stray(video, truth, background):
    """Returns the share of changed pixels that no label explains, over every 10th frame.

    Changed pixels differ from the background by more than 12 levels. Labels are those of animals and shadows;
    a pixel more than 2 px outside of all of them is unexplained.
    """
    video, t, n_changed, n_stray = cv2.VideoCapture(str(video)), 0, 0, 0
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


def measure(program, footage, flags, library, is_kept):
    """Returns the mean of each figure over the seeds, or the code of a refusal."""
    run = lambda *words: subprocess.run([str(word) for word in (program, *words)], capture_output=True, text=True)
    if not (is_kept and (library / "library.json").exists()):
        shutil.rmtree(library, ignore_errors=True)
        done = run("analyze", footage, "-o", library, *flags)
        if done.returncode:
            return {"refused": refusal(done)}
    film = places.Film(library)
    uncut = {pose["frame"] for pose in film.poses["frames"] if pose["detected"] and not pose["cut"]}
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        run("sprites", library, "-o", folder / "sprites")
        sprites = sprites_of(folder / "sprites", film.poses)

        def flock_of(output, *words):
            """Returns a planned flock, or the code of its refusal."""
            done = run("flock", library, "-o", folder / output, "--plan", folder / "flock.json", *words)
            return refusal(done) if done.returncode else json.loads((folder / "flock.json").read_text())

        for seed in SEEDS:
            drawn = ["flock.mp4", "--ground-truth", folder / "truth"] if seed == SEEDS[0] else ["flock.png"]
            flock = flock_of(*drawn, "--frames", N_FRAMES, "--seed", seed)
            if isinstance(flock, str):
                return {"refused": flock}
            long = flock_of("flock.png", "--frames", N_PLACES, "--seed", seed, "--count", min(flock["stats"]["room_for"] or MOST, MOST))
            figures.append(motion(flock, film) | places.crowding(flock, film) | {
                "cuts_above_natural": cuts_above_natural(flock, sprites, film.poses), "polarization": places.polarization(flock),
                "world": places.world(flock, film), "on_footholds": places.on_footholds(flock, film),
                "neighbor_p10_bl": places.neighbor_p10(flock), "same_cells": None if isinstance(long, str) else places.same_cells(long, film)})
        once = {"stray": stray(folder / "flock.mp4", folder / "truth", library / "background.png")}
    known = {key: [one[key] for one in figures if one[key] is not None] for key in figures[0]}
    return {"view": film.poses["view"], **{key: statistics.mean(values) if values else None for key, values in known.items()}, **once,
            "halo": halo([sprite[..., 3] for sprite in sprites if sprite is not None]), "carried": float(film.carried.mean()),
            "playable": len(uncut & set(film.component)) / max(len(uncut), 1)}


def refusal(done):
    """Returns the error code at the end of a program's last message, or the message."""
    codes = [line.rsplit("(", 1)[1].rstrip(")") for line in done.stderr.splitlines() if line.endswith(")")]
    return codes[-1] if codes else done.stderr.strip() or "failed"


def page(results):
    """Returns the section of docs/measurements.md."""
    yield "## Motion and appearance of flocks"
    yield ""
    yield ("Flocks of 300 frames are compared with the films of their animals. They have default settings, and as many individuals as fit, "
           "at most 20. Figures are the mean of three seeds. `bench/flocks.py` and `bench/places.py` define them. `sample` and the next three films "
           "from the side are generated, all others are recordings.")
    yield ""
    yield "Repeat: `make flocks GENERATOR=goldfish.py FOOTAGE=folder`"
    for name, film in results.items():
        if "refused" in film:
            yield from ("", f"`{name}` is refused: `{film['refused']}`.")
    for view, title in (("side", "From the side"), ("top", "From above")):
        names = [name for name, film in results.items() if film.get("view") == view]
        yield from ("", f"### {title}", "")
        yield from table(["measure", *names, "bar"], [(label, *(figure(key, name, results[name].get(key)) for name in names), limit(bar, form))
                                                      for key, (label, bar, form, views) in BARS.items() if view in views])


def figure(key, name, value):
    _, bar, form, _ = BARS[key]
    if value is None:
        return ""
    is_judged = bar and (key != "polarization" or name.startswith("mouse"))
    return starred(form.format(value), not is_judged or HOLDS[bar[0]](value, bar[1]))


def limit(bar, form):
    return f"{bar[0]} {form.format(bar[1])}" if bar else ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("generator", type=pathlib.Path)
    parser.add_argument("--footage", type=pathlib.Path)
    parser.add_argument("--films", type=pathlib.Path, default=HERE.parent / "target" / "accuracy")
    parser.add_argument("--only", nargs="+", help="measure these films alone, and keep the figures of the others")
    parser.add_argument("--libraries", type=pathlib.Path, default=HERE.parent / "target" / "flocks", help="folder of the analyzed films")
    parser.add_argument("--keep", action="store_true", help="use the libraries that this folder has")
    parser.add_argument("--json", type=pathlib.Path, help="write the figures to this file only")
    args = parser.parse_args()
    import measurements  # not at the top, because it imports this file
    films = [(name, path, flags) for name, path, _, flags, _ in cases.films(args.generator, args.films, GENERATED)]
    args.libraries.mkdir(parents=True, exist_ok=True)
    sample = args.libraries / "sample.mp4"
    if not (args.keep and sample.exists()):
        subprocess.run([args.program, "sample", "-o", sample], check=True, capture_output=True)
    films.insert(0, ("sample", sample, []))
    if args.footage:
        clips = [json.loads((HERE / "labels" / f"{clip}.json").read_text())["clip"] for clip in CLIPS]
        films += [(clip, args.footage / file, []) for clip, file in zip(CLIPS, clips)]
    file = args.json or RESULTS
    results = json.loads(file.read_text()) if args.only and file.exists() else {}
    for name, film, flags in films:
        if not args.only or name in args.only:
            results[name] = measure(args.program, film, flags, args.libraries / name, args.keep)
            words = [f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}" for key, value in results[name].items()]
            print(f"{name:28}", *words, flush=True)
    if args.json:
        args.json.write_text(json.dumps(results, indent=1) + "\n")
    else:
        measurements.save("flocks", results)


if __name__ == "__main__":
    main()
