"""Films of one animal with typical faults, and their truth: light, camera, other objects, rest, file formats.

Each case takes a film of the generator (goldfish.py) and changes its frames and its truth; `holds_station` draws its
own. The films that kinds.py draws are made here, too. A frame without a centroid in the truth shows no animal.
NAME.masks.npz has the animal in ten frames of some films, as `frames` and `masks`.

`expected` of a truth tells what a good program does. `refused` is null, or the codes of right refusals. `found` is the
least share of frames with the animal in which it is found. Other numbers are upper limits of the scores of accuracy.py,
such as `centroid_px_p95`. `says` and `never_says` are patterns of the printed text. `either` lists alternatives.
"""
import io, json, pathlib, subprocess, sys, zipfile

import cv2
import numpy as np
from PIL import Image

import drawing, kinds

N_FRAMES = 300
SEEDS = (3001, 3002, 3003)
ABSENT = {"absent": True, "centroid_px": None}


class Base:
    """A film of the generator, with its background and its truth."""

    def __init__(self, generator, folder, seed, *flags, n_frames=N_FRAMES):
        def make(*flags):
            name = "-".join(["base", str(seed), str(n_frames), *flags]).replace("--", "")
            stem = folder / name.replace(" ", "").replace(".", "_")
            if not stem.with_suffix(".truth.json").exists():
                words = [sys.executable, generator, stem, "--seed", seed, "--frames", n_frames, *flags]
                subprocess.run([str(w) for w in words], check=True)
            return stem

        stem, self.make = make(*flags), make
        self.film = stem.with_suffix(".mp4")
        self.truth = json.loads(stem.with_suffix(".truth.json").read_text())
        self.poses = self.truth["frames"]
        reader = cv2.VideoCapture(str(self.film))
        self.frames = [reader.read()[1] for _ in self.poses]
        self.scene = cv2.imread(str(stem) + ".background.png").astype(np.float32)
        self.height, self.width = self.scene.shape[:2]
        self.rng = np.random.default_rng(seed)

    def noisy(self, image, sigma=2.0):
        return image + self.rng.normal(0, sigma, image.shape)

    def mask(self, k):
        """Returns the mask of the animal in frame k, 0 to 1: where its box differs from the background."""
        x, y, w, h = self.poses[k]["box_px"]
        box = slice(max(y - 2, 0), y + h + 2), slice(max(x - 2, 0), x + w + 2)
        differs = np.abs(self.frames[k][box].astype(np.float32) - self.scene[box]).max(-1) > 12
        differs = cv2.morphologyEx(differs.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
        mask = np.zeros((self.height, self.width), np.float32)
        mask[box] = cv2.morphologyEx(differs, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        return cv2.GaussianBlur(mask, (3, 3), 0)[..., None]

    def alphas(self):
        """Yields the alpha of the animal in each frame.

        It is the difference between lossless films of two colors, over the largest difference near by.
        """
        films = [cv2.VideoCapture(str(self.make("--crf", "0", "--colour", colour).with_suffix(".mp4"))) for colour in ("orange", "dark")]
        for _ in self.poses:
            orange, dark = (cv2.cvtColor(film.read()[1], cv2.COLOR_BGR2GRAY).astype(np.float32) for film in films)
            change = np.abs(orange - dark)
            alpha = change / np.maximum(cv2.dilate(change, np.ones((5, 5))), 20)
            outlines = cv2.findContours((alpha >= .5).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
            body = cv2.erode(cv2.drawContours(np.zeros_like(alpha), outlines, -1, 1, -1), np.ones((3, 3)))
            yield np.maximum(alpha, body)[..., None]


def moved(pose, x, y):
    return pose if pose["centroid_px"] is None else {**pose, "centroid_px": [pose["centroid_px"][0] + x, pose["centroid_px"][1] + y]}


def shifted(image, x, y):
    size = image.shape[1], image.shape[0]
    return cv2.warpAffine(image, np.float32([[1, 0, x], [0, 1, y]]), size, borderMode=cv2.BORDER_REPLICATE)


def enlarged(image, pose, by, method=cv2.INTER_AREA):
    return cv2.resize(image, None, fx=by, fy=by, interpolation=method), {
        **pose, "centroid_px": [by * (v + .5) - .5 for v in pose["centroid_px"]], "box_px": [by * v for v in pose["box_px"]]}


# Each function yields (picture, pose) for every frame of a base film. A `mask` in a pose is stored apart.

def black_lead(base, n_black):
    for k, pose in enumerate(base.poses):
        yield (np.full_like(base.frames[k], 16), {**pose, **ABSENT}) if k < n_black else (base.frames[k], pose)


def title_card(base, n_titles):
    card = cv2.putText(np.full_like(base.frames[0], 40), "TANK 3", (120, 260), cv2.FONT_HERSHEY_SIMPLEX, 3, (220, 220, 220), 8)
    for k, pose in enumerate(base.poses):
        is_title = 100 <= k < 100 + n_titles
        yield (card, {**pose, **ABSENT}) if is_title else (base.frames[k], pose)


def camera_bump(base, by_px):
    for k, pose in enumerate(base.poses):
        x, y = (by_px, round(.75 * by_px)) if k >= len(base.poses) // 2 else (0, 0)
        yield shifted(base.frames[k], x, y), moved(pose, x, y)


def lights_dim(base, to):
    for k, pose in enumerate(base.poses):
        yield (base.noisy(base.frames[k] * to, 1.0) if k >= len(base.poses) // 2 else base.frames[k]), pose


def infrared(base, share):
    for k, pose in enumerate(base.poses):
        gray = cv2.cvtColor(base.frames[k], cv2.COLOR_BGR2GRAY)[..., None].repeat(3, -1)
        yield (base.noisy(gray * .8, 1.0) if k < share * len(base.poses) else base.frames[k]), pose


def mains_banding(base, depth):
    rows = np.arange(base.height)[:, None, None] / base.height
    for k, pose in enumerate(base.poses):
        yield base.frames[k] * (1 + depth * np.sin(2 * np.pi * (2.2 * rows + .37 * k))), pose


def resting_animal(base, share):
    first = round((1 - share) * len(base.poses))
    for k, pose in enumerate(base.poses):
        at = min(k, first)
        yield (base.frames[k] if k <= first else base.noisy(base.frames[first].astype(np.float32), 1.5)), base.poses[at]


def hand_at_start(base, seconds):
    leaves = round(30 * seconds)
    for k, pose in enumerate(base.poses):
        there = k >= 20
        image = base.frames[k].astype(np.float32) if there else base.noisy(base.scene)
        reach = 1 if k < 20 else max(0, 1 - (k - 20) / max(leaves - 20, 1))
        if reach > 0:
            hand = np.zeros((base.height, base.width), np.uint8)
            low = int(260 * reach) - 60
            cv2.rectangle(hand, (260, -10), (360, low), 255, -1)
            cv2.ellipse(hand, (310, low), (75, 60), 0, 0, 360, 255, -1)
            alpha = cv2.GaussianBlur(hand, (5, 5), 0)[..., None] / 255.0
            image = image * (1 - alpha) + np.array([120, 150, 200]) * alpha
        yield image, pose if there else {**pose, **ABSENT}


def tether(base, thick_px):
    for k, pose in enumerate(base.poses):
        x, y = pose["centroid_px"]
        image = base.frames[k].copy()
        cv2.line(image, (base.width // 2 * 8, 0), (int(x * 8), int(y * 8)), (35, 35, 35), thick_px, cv2.LINE_AA, 3)
        mask = base.mask(k)
        yield image * (1 - mask) + base.frames[k] * mask, pose


def surface_mirror(base, strength):
    surface = 110
    rows = 2 * surface - np.arange(surface)
    for k, pose in enumerate(base.poses):
        image = base.frames[k].astype(np.float32)
        alpha = base.mask(k)[rows] * strength
        image[:surface] = image[:surface] * (1 - alpha) + cv2.GaussianBlur(image[rows], (1, 3), 0) * alpha
        image[surface - 1:surface + 1] = image[surface - 1:surface + 1] * .5 + 110
        yield image, pose


def time_lapse(base, every):
    for k in range(0, len(base.poses), every):
        yield base.frames[k], base.poses[k]


def timelapse_rate(base, fps):
    yield from zip(base.frames, base.poses)


def cast_shadow(base, strength):
    """A lamp at one side throws a soft shadow of the animal on the wall behind it."""
    x, y = int(base.rng.choice((-1, 1)) * base.rng.integers(40, 80)), int(base.rng.integers(6, 24))
    for image, pose, alpha in zip(base.frames, base.poses, base.alphas()):
        shadow = cv2.GaussianBlur(shifted(alpha, x, y), (0, 0), 3)[..., None]
        yield image * (1 - strength * shadow * (1 - alpha)), {**pose, "mask": alpha[..., 0] >= .5}


def swaying(base, by_px):
    """Leaves sway in the flow of a pump in a third of the picture; the animal swims in front of them."""
    draw, height = base.rng, base.height
    stalks = [(draw.integers(20, 230), draw.integers(150, 300), draw.uniform(0, 6.28), draw.uniform(.25, .6),
               [int(draw.integers(*span)) for span in ((25, 60), (110, 170), (40, 90))]) for _ in range(14)]
    along = np.linspace(0, 1, 24)
    for k, (image, pose, alpha) in enumerate(zip(base.frames, base.poses, base.alphas())):
        plants = base.scene.copy()
        for foot, top, phase, frequency, colour in stalks:
            x = foot + by_px * along ** 1.4 * np.sin(2 * np.pi * frequency * k / 30 + phase) + 6 * np.sin(9 * along + phase)
            points = np.stack([x, height + (top - height) * along], 1)
            cv2.polylines(plants, [np.int32(np.round(8 * points))], False, colour, 5, cv2.LINE_AA, 3)
            for n in range(4, 24, 4):
                at = [int(v) for v in np.round(8 * points[n])]
                cv2.ellipse(plants, at, (104, 40), 30 if n % 8 else 150, 0, 360, [.9 * v for v in colour], -1, cv2.LINE_AA, 3)
        yield base.noisy(plants) * (1 - alpha) + image * alpha, {**pose, "mask": alpha[..., 0] >= .5}


def camera_settles(base, by_px):
    """The camera shakes in the first two seconds, and in the last one."""
    n = len(base.poses)
    walk = np.clip(np.cumsum(base.rng.normal(0, by_px / 6, (n, 2)), 0), -by_px, by_px)
    for k, pose in enumerate(base.poses):
        x, y = (float(v) for v in walk[k] * max(0, 1 - k / 60, (k - n + 30) / 30))
        yield (shifted(base.frames[k], x, y) if x or y else base.frames[k]), moved(pose, x, y)


def focus_hunting(base, growth):
    """The focus is lost four times for 0.8 s, while the picture grows."""
    middle = np.array([base.width, base.height]) / 2
    for k, pose in enumerate(base.poses):
        share = max((np.sin(np.pi * (k - first) / 24) for first in (60, 170, 260, 390) if first < k < first + 24), default=0)
        if not share:
            yield base.frames[k], pose
            continue
        scale = 1 + growth * share
        turn = cv2.getRotationMatrix2D(tuple(middle), 0, scale)
        image = cv2.warpAffine(base.frames[k], turn, (base.width, base.height), borderMode=cv2.BORDER_REPLICATE)
        place = middle + scale * (np.array(pose["centroid_px"]) - middle)
        yield cv2.GaussianBlur(image, (0, 0), .1 + 150 * growth * share), {**pose, "centroid_px": place.tolist()}


def holds_station(seed, length_px):
    """A fish, seen from above, holds its place in a current: its middle never uncovers the floor."""
    draw = np.random.default_rng(seed)
    width, height, tailward = 640, 360, int(draw.choice((-1, 1)))
    nose, middle = draw.uniform(80, width - 80 - length_px), draw.uniform(130, 230)
    wave, beats, half_px = draw.uniform(.08, .12) * length_px, draw.uniform(1.2, 2.2), draw.uniform(.08, .11) * length_px
    body = draw.uniform(30, 70)
    floor = draw.uniform(195, 230) + draw.normal(0, 2, (height, width, 1)).repeat(3, -1)
    for _ in range(60):
        cv2.circle(floor, [int(v) for v in draw.integers((width, height))], int(draw.integers(1, 4)), (120, 120, 120), -1)
    along = np.linspace(0, 1, 60)
    half = half_px * np.interp(along, [0, .08, .3, .7, .9, 1], [.2, .7, 1, .45, .15, .4])
    for k in range(240):
        x = nose + 3 * np.sin(k / 23) + length_px * along
        x = x if tailward > 0 else width - 1 - x
        y = middle + 2 * np.sin(k / 31) + wave * along ** 2.2 * np.sin(2 * np.pi * (beats * k / 30 - .9 * along))
        outline = np.concatenate([np.stack([x, y - half], 1), np.stack([x, y + half], 1)[::-1]])
        drawn = cv2.fillPoly(np.zeros((height, width), np.uint8), [np.int32(np.round(16 * outline))], 255, cv2.LINE_AA, 4)
        alpha = drawn[..., None] / 255
        moments, mask = cv2.moments(drawn), drawn >= 128
        yield floor * (1 - alpha) + body * alpha + draw.normal(0, 1.5, (height, width, 1)), {
            "centroid_px": [moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]], "forward": [-tailward, 0, 0],
            "box_px": cv2.boundingRect(mask.astype(np.uint8)), "area_px": int(mask.sum()), "mask": mask}


CHANGES = {
    black_lead: (5, 15, 45), title_card: (6, 20, 40), camera_bump: (2, 4, 7), lights_dim: (.75, .5, .35),
    infrared: (.3, .5, .7), mains_banding: (.04, .08, .12), resting_animal: (.5, .7, .85), hand_at_start: (1.0, 1.5, 2.5),
    tether: (1, 3, 5), surface_mirror: (.4, .7, .9), time_lapse: (5, 10, 10), timelapse_rate: (.2, 1, 1.1),
    cast_shadow: (.3, .45, .6), swaying: (6, 9, 13), camera_settles: (8, 14, 20), focus_hunting: (.01, .015, .02),
}
LENGTHS = {swaying: 450, camera_settles: 450, focus_hunting: 450, timelapse_rate: 60}
STATION = (160, 230, 300)  # lengths of the fish in pixels
LARGE = (.28, .34, .38)  # lengths of the animal in m, in a tank of 0.6 m


# Each function returns a function that writes the file of a base film, and returns the poses if they differ.

def coded(*words):
    def write(base, path):
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", base.film, *words, path], check=True)
    return write


def thumbnail_first(*words):
    """A stream with one picture, and the film in the next stream."""
    def write(base, path):
        thumbnail = path.with_name(f"{path.name}.jpg")
        cv2.imwrite(str(thumbnail), base.frames[0])
        coded("-i", thumbnail, "-map", "1", "-map", "0", "-c:v:0", "copy", *words)(base, path)
    return write


def moving_pictures(every, *words):
    """The first five seconds at 480x360, every nth frame."""
    def write(base, path):
        return encode(path, (enlarged(base.frames[k], base.poses[k], .75) for k in range(0, 150, every)), 30 // every, words)
    return write


def unfinished(share):
    """A recording that the camera did not finish: its index is missing."""
    def write(base, path):
        coded("-c", "copy")(base, path)
        data = path.read_bytes()
        path.write_bytes(data[:int(share * len(data))])
    return write


def pictures(picture, name="{:04}.png", first=0):
    def write(base, path):
        files = ((name.format(first + k), picture(image)) for k, image in enumerate(base.frames))
        if path.suffix == ".zip":
            with zipfile.ZipFile(path, "w") as archive:
                for file, data in files:
                    archive.writestr(file, data)
        else:
            path.mkdir(exist_ok=True)
            for file, data in files:
                (path / file).write_bytes(data)
    return write


def png(image):
    return cv2.imencode(".png", image)[1].tobytes()


def gray_tiff(image):
    return cv2.imencode(".tif", cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.uint16) * 257)[1].tobytes()


def turned_jpeg(image):
    """Returns a JPEG that is stored lying on its side, with the orientation in its EXIF data."""
    exif, file = Image.Exif(), io.BytesIO()
    exif[0x0112] = 6
    Image.fromarray(np.ascontiguousarray(np.rot90(image)[..., ::-1])).save(file, "jpeg", quality=92, exif=exif)
    return file.getvalue()


# The kind is the first word of a name. Each film is made with all seeds.
FILES = {
    "pictures-folder": ("", pictures(png)), "pictures-tiff": ("", pictures(gray_tiff, "{:04}.tif")),
    "pictures-zip": (".zip", pictures(png)),
    "exif_turned-folder": ("", pictures(turned_jpeg, "IMG_{}.JPG", 9950)),
    "exif_turned-zip": (".zip", pictures(turned_jpeg, "IMG_{}.JPG", 9950)),
    "raw": (".h264", coded("-c:v", "libx264", "-crf", "18", "-bsf:v", "h264_mp4toannexb", "-f", "h264")),
    "sound": (".wmv", coded("-f", "lavfi", "-i", "sine=440", "-t", "12", "-map", "0:v", "-map", "1:a", "-c:v", "wmv2", "-b:v", "4M",
                            "-c:a", "wmav2")),
    "old": (".mpg", coded("-c:v", "mpeg1video", "-b:v", "6M")),
    "thumbnail_first-mp4": (".mp4", thumbnail_first("-c:v:1", "copy")),
    "thumbnail_first-wmv": (".wmv", thumbnail_first("-c:v:1", "wmv2", "-b:v:1", "4M")),
    "moving_pictures-gif": (".gif", moving_pictures(3, "-loop", "0")),
    "moving_pictures-apng": (".png", moving_pictures(2, "-f", "apng", "-plays", "0")),
    "moving_pictures-webp": (".webp", moving_pictures(2, "-loop", "0")),
    "unfinished_recording-30": (".mp4", unfinished(.3)), "unfinished_recording-50": (".mp4", unfinished(.5)),
    "unfinished_recording-90": (".mp4", unfinished(.9)),
}
SHORT = {"pictures": 120, "exif_turned": 120, "moving_pictures": 150}
WITHOUT_RATE = ("pictures", "exif_turned", "raw")

GOOD = {"refused": None, "found": .99, "centroid_px_p95": 1}
SOUND = {"refused": None, "found": .99, "centroid_px_p95": 3}
NEAR = {"refused": None, "found": .95, "centroid_px_p95": 12}
MOVED = {"refused": ["camera_moved", "background_not_static"]}
# By the kind or the name without seed. Other films are measured as well as GOOD.
EXPECTED = {
    "black_lead": {"either": [{**GOOD, "invented": 0}, {"refused": ["scene_changes", "light_changes"]}]},
    "title_card": {"either": [{**GOOD, "invented": 0}, {"refused": ["scene_changes"]}]},
    "camera_bump": {"either": [{"refused": None, "found": .99, "centroid_px_p50": 1, "centroid_px_p99": 12, "flips_share": .02}, MOVED]},
    "lights_dim": {"either": [{"refused": None, "found": .99, "centroid_px_p95": 2}, {"refused": ["light_changes"]}]},
    "infrared": {"either": [NEAR, {"refused": ["light_changes"]}]},
    "mains_banding": {"either": [SOUND, {"refused": ["light_changes"]}]},
    "resting_animal": {"refused": None, "found": .99, "centroid_px_p95": 2, "never_says": "seldom_found"},
    "hand_at_start": {"refused": None, "far_share": .02, "invented_and_sure": 0},
    "tether": {**NEAR, "flips_share": .05, "never_says": "often_at_border"},
    "surface_mirror": {"either": [{"refused": None, "found": .95, "centroid_px_p95": 2},
                                  {"refused": ["several_animals"], "says": "mirror"}]},
    "large_animal": {"either": [{"refused": None, "found": .99, "centroid_px_p95": 8}, {"refused": ["animal_too_large"]}]},
    "timelapse_rate": {**GOOD, "tail_beats": 0},
    "cast_shadow": NEAR,
    "swaying": NEAR,
    "camera_settles": {"either": [{"refused": None, "found": .78, "centroid_px_p50": 1, "sure_and_far": 0}, MOVED]},
    "focus_hunting": {"either": [{**NEAR, "found": .9, "never_says": "other_movers"},
                                 {"refused": ["background_not_static"], "says": "focus"}]},
    "holds_station": {"either": [NEAR, {"refused": ["nothing_moves"], "says": "--background"},
                                 {"refused": None, "confidence_p50": .8, "says": "--background"}]},
    "sound": SOUND,
    "old": SOUND,
    # In gray, parts of the fish are as bright as the water.
    "pictures-tiff": {**NEAR, "found": .99},
    "exif_turned": SOUND,
    "thumbnail_first-wmv": SOUND,
    "moving_pictures": SOUND,
    # No tool reads a file without index, so a conversion with ffmpeg cannot be the advice.
    "unfinished_recording": {"refused": ["truncated"], "never_says": "ffmpeg -i"},
    "hard": SOUND,
}


# Drawn films may be difficult: the program may be unsure, or refuse them with advice, but not be wrong and sure.
DRAWN = {"either": [{"refused": None, "silently_wrong": 0},
                    {"refused": ["nothing_moves", "background_not_static", "several_animals", "animal_too_large", "light_changes"],
                     "says": "--[a-z]|[Ff]ilm "}]}


H264 = ("-c:v", "libx264", "-preset", "fast", "-crf", "18", "-pix_fmt", "yuv420p")


def encode(path, rows, fps=30, coding=H264):
    """Writes a film of (picture, pose) rows and returns the poses."""
    coder, poses = None, []
    for image, pose in rows:
        if coder is None:
            size = f"{image.shape[1]}x{image.shape[0]}"
            words = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "bgr24", "-s", size, "-r", str(fps), "-i", "-",
                     *coding, path]
            coder = subprocess.Popen(words, stdin=subprocess.PIPE)
        coder.stdin.write(np.clip(image, 0, 255).astype(np.uint8).tobytes())
        poses.append(pose)
    coder.stdin.close()
    assert coder.wait() == 0, path
    return poses


def films(generator, folder, only=()):
    """Makes the missing films. Returns (name, path, path of the truth, flags of analyze, kind) for each.

    `only` are names and kinds of films; all are made if it is empty.
    """
    folder.mkdir(parents=True, exist_ok=True)
    made = []

    def add(name, suffix, make, flags=(), expected=None):
        path, truth, case = folder / f"{name}{suffix}", folder / f"{name}.truth.json", name.rsplit("-", 1)[0]
        kind = case.split("-")[0]
        if only and name not in only and kind not in only:
            return
        if not truth.exists():
            known = {**make(path), "expected": expected or EXPECTED.get(case, EXPECTED.get(kind, GOOD))}
            masks = {k: pose.pop("mask") for k, pose in enumerate(known["frames"]) if "mask" in pose}
            if masks:
                frames = [list(masks)[k] for k in np.linspace(0, len(masks) - 1, 12)[1:-1].round().astype(int)]
                np.savez_compressed(folder / f"{name}.masks.npz", frames=frames, masks=[masks[k] for k in frames])
            truth.write_text(json.dumps(known))
        made.append((name, path, truth, list(flags), kind))

    for change, strengths in CHANGES.items():
        for seed, strength in zip(SEEDS, strengths):
            def make(path):
                colour = ["--colour", "silver"] if change is surface_mirror and seed == 3003 else []
                n_frames = LENGTHS.get(change, N_FRAMES) * (strength if change is time_lapse else 1)
                base = Base(generator, folder, seed, *colour, n_frames=min(n_frames, 1200))
                fps = {time_lapse: 1, timelapse_rate: strength}.get(change, 30)
                return {**base.truth, "frames": encode(path, change(base, strength), fps)}
            add(f"{change.__name__}-{seed}", ".mp4", make)
    for seed, length_px in zip(SEEDS, STATION):
        add(f"holds_station-{seed}", ".mp4", lambda path: {"fps": 30, "frames": encode(path, holds_station(seed, length_px))})
    for seed, length in zip((3022, 3023, 3024), LARGE):
        def make(path):
            # The generator draws its fish as points, so make it small and enlarge it.
            small = ["--size", "160x120", "--length", str(length), "--height", f"{.55 * length:.3f}", "--crf", "8"]
            base = Base(generator, folder, seed, *small)
            rows = (enlarged(image, pose, 4, cv2.INTER_CUBIC) for image, pose in zip(base.frames, base.poses))
            return {**base.truth, "frames": encode(path, rows)}
        add(f"large_animal-{seed}", ".mp4", make)
    for case, (suffix, write) in FILES.items():
        for seed in SEEDS:
            def make(path):
                base = Base(generator, folder, seed, n_frames=SHORT.get(case.split("-")[0], N_FRAMES))
                return {**base.truth, "frames": write(base, path) or base.poses}
            add(f"{case}-{seed}", suffix, make, ["--fps", "30"] if case.split("-")[0] in WITHOUT_RATE else [])
    for seed in (1, 2, 3):
        for kind, flags in {"plain": [], "hard": ["--hard"], "silver": ["--colour", "silver"], "dark": ["--colour", "dark"]}.items():
            def make(path):
                base = Base(generator, folder, seed, *flags)
                path.write_bytes(base.film.read_bytes())
                return base.truth
            add(f"{kind}-{seed}", ".mp4", make)
    for kind, draw in kinds.KINDS.items():
        for seed in kinds.SEEDS:
            add(f"{kind}-{seed}", ".mp4", lambda path: {"fps": 30, "frames": encode(path, draw(drawing.Film(kind, seed)))},
                kinds.FLAGS.get(kind, ()), DRAWN)
    return made
