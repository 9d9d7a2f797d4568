"""Films of one animal with typical faults, and their truth: light, camera, other objects, rest, file formats.

Each case takes a film of the generator (goldfish.py) and changes its frames and its truth. A frame without a
centroid in the truth shows no animal.
"""
import json, pathlib, subprocess, sys, zipfile

import cv2
import numpy as np

N_FRAMES = 300
ABSENT = {"absent": True, "centroid_px": None}


class Base:
    """A film of the generator, with its background and its truth."""

    def __init__(self, generator, folder, seed, *flags, n_frames=N_FRAMES):
        name = "-".join(["base", str(seed), str(n_frames), *flags]).replace("--", "")
        stem = folder / name.replace(" ", "").replace(".", "_")
        if not stem.with_suffix(".truth.json").exists():
            words = [sys.executable, generator, stem, "--seed", seed, "--frames", n_frames, *flags]
            subprocess.run([str(w) for w in words], check=True)
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


def moved(pose, x, y):
    return pose if pose["centroid_px"] is None else {**pose, "centroid_px": [pose["centroid_px"][0] + x, pose["centroid_px"][1] + y]}


def shifted(image, x, y):
    size = image.shape[1], image.shape[0]
    return cv2.warpAffine(image, np.float32([[1, 0, x], [0, 1, y]]), size, borderMode=cv2.BORDER_REPLICATE)


# Each function yields (picture, pose) for every frame of a base film.

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


CHANGES = {
    black_lead: (5, 15, 45), title_card: (6, 20, 40), camera_bump: (2, 4, 7), lights_dim: (.75, .5, .35),
    infrared: (.3, .5, .7), mains_banding: (.04, .08, .12), resting_animal: (.5, .7, .85), hand_at_start: (1.0, 1.5, 2.5),
    tether: (1, 3, 5), surface_mirror: (.4, .7, .9), time_lapse: (5, 10, 10),
}
LARGE = (.28, .34, .38)  # lengths of the animal in m, in a tank of 0.6 m
FILES = {
    "pictures.zip": None,
    "raw.h264": ["-c:v", "libx264", "-crf", "18", "-bsf:v", "h264_mp4toannexb", "-f", "h264"],
    "sound.wmv": ["-f", "lavfi", "-i", "sine=440", "-t", "12", "-map", "0:v", "-map", "1:a", "-c:v", "wmv2", "-b:v", "4M", "-c:a", "wmav2"],
    "old.mpg": ["-c:v", "mpeg1video", "-b:v", "6M"],
}


def encode(path, rows, fps=30):
    """Writes a film of (picture, pose) rows and returns the poses."""
    coder, poses = None, []
    for image, pose in rows:
        if coder is None:
            size = f"{image.shape[1]}x{image.shape[0]}"
            words = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "bgr24", "-s", size, "-r", str(fps), "-i", "-",
                     "-c:v", "libx264", "-preset", "fast", "-crf", "18", "-pix_fmt", "yuv420p", path]
            coder = subprocess.Popen(words, stdin=subprocess.PIPE)
        coder.stdin.write(np.clip(image, 0, 255).astype(np.uint8).tobytes())
        poses.append(pose)
    coder.stdin.close()
    assert coder.wait() == 0, path
    return poses


def films(generator, folder):
    """Makes the missing films. Returns (name, path, path of the truth, flags of analyze) for each case."""
    folder.mkdir(parents=True, exist_ok=True)
    made = []

    def add(name, path, make, flags=()):
        truth = folder / f"{name}.truth.json"
        if not truth.exists():
            truth.write_text(json.dumps(make(path)))
        made.append((name, path, truth, list(flags)))

    for change, strengths in CHANGES.items():
        for seed, strength in zip((3001, 3002, 3003), strengths):
            def make(path):
                colour = ["--colour", "silver"] if change is surface_mirror and seed == 3003 else []
                n_frames = N_FRAMES * (strength if change is time_lapse else 1)
                base = Base(generator, folder, seed, *colour, n_frames=min(n_frames, 1200))
                fps = 1 if change is time_lapse else 30
                return {**base.truth, "frames": encode(path, change(base, strength), fps)}
            name = f"{change.__name__}-{seed}"
            add(name, folder / f"{name}.mp4", make)
    for seed, length in zip((3022, 3023, 3024), LARGE):
        def make(path):
            # The generator draws its fish as points, so make it small and enlarge it.
            small = ["--size", "160x120", "--length", str(length), "--height", f"{.55 * length:.3f}", "--crf", "8"]
            base = Base(generator, folder, seed, *small)
            rows = ((cv2.resize(image, (640, 480), interpolation=cv2.INTER_CUBIC), {
                **pose, "centroid_px": [4 * (v + .5) - .5 for v in pose["centroid_px"]],
                "box_px": [4 * v for v in pose["box_px"]]}) for image, pose in zip(base.frames, base.poses))
            return {**base.truth, "frames": encode(path, rows)}
        add(f"large_animal-{seed}", folder / f"large_animal-{seed}.mp4", make)
    for name, coding in FILES.items():
        def make(path):
            base = Base(generator, folder, 3001)
            if coding is None:
                with zipfile.ZipFile(path, "w") as archive:
                    for k, image in enumerate(base.frames):
                        archive.writestr(f"{k:04}.png", cv2.imencode(".png", image)[1].tobytes())
            else:
                subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", base.film, *coding, path], check=True)
            return base.truth
        add(pathlib.Path(name).stem, folder / name, make, ["--fps", "30"])
    for seed in (1, 2, 3):
        for kind, flags in {"plain": [], "hard": ["--hard"], "silver": ["--colour", "silver"], "dark": ["--colour", "dark"]}.items():
            def make(path):
                base = Base(generator, folder, seed, *flags)
                path.write_bytes(base.film.read_bytes())
                return base.truth
            add(f"{kind}-{seed}", folder / f"{kind}-{seed}.mp4", make)
    return made
