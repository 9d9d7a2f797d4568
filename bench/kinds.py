"""Films of kinds of animals and situations, drawn, with exact truth: python kinds.py FOLDER [KIND ...]

Each kind draws one animal as textured, shaded bodies with soft edges on a textured place, seen through a slightly
blurred, noisy camera. Everything (place, colors, sizes, timing) follows from the kind and the seed.
"""
import json, os, pathlib, subprocess, sys, zlib

import cv2
import numpy as np

cv2.setNumThreads(1)
TAU = 2 * np.pi
SIZES = [(320, 240), (480, 270), (480, 360), (640, 360), (640, 360), (640, 480), (800, 450), (960, 540)]


def mix(a, b, t):
    return np.asarray(a, np.float32) * (1 - t) + np.asarray(b, np.float32) * t


def step(x, lo, hi):
    t = np.clip((x - lo) / (hi - lo), 0, 1)
    return t * t * (3 - 2 * t)


def smooth(a, sigma):
    """Returns a curve smoothed over time, its ends held."""
    r = int(4 * sigma) + 1
    g = np.exp(-.5 * (np.arange(-r, r + 1) / sigma) ** 2)
    return np.convolve(np.pad(np.asarray(a, float), r, "edge"), g / g.sum(), "valid")


def drift(rng, n, sigma):
    """Returns a slow random curve of unit spread."""
    a = smooth(rng.standard_normal(n + int(8 * sigma)), sigma)[int(4 * sigma):][:n]
    return a / max(a.std(), 1e-6)


def fractal(rng, h, w, cell=64.0, octaves=5, gain=.6, stretch=(1, 1)):
    """Returns value noise of several octaves, of unit spread; stretch lengthens its grains (x, y)."""
    total = np.zeros((h, w), np.float32)
    for o in range(octaves):
        cx, cy = max(cell * stretch[0] / 2 ** o, 1), max(cell * stretch[1] / 2 ** o, 1)
        grid = rng.standard_normal((int(h / cy) + 4, int(w / cx) + 4)).astype(np.float32)
        big = cv2.resize(grid, (int(grid.shape[1] * cx) + 1, int(grid.shape[0] * cy) + 1), interpolation=cv2.INTER_CUBIC)
        oy, ox = rng.integers(int(cy) + 1), rng.integers(int(cx) + 1)
        total += gain ** o * big[oy:oy + h, ox:ox + w]
    return (total - total.mean()) / total.std()


# Places. Each returns a float picture (BGR) of the film's size.

def stones(rng, h, w, size, palette, gap=.45):
    image = np.full((h, w, 3), np.mean(palette, 0) * gap, np.float32)
    for big in (1.5, 1.0, .7):
        for _ in range(int(1.1 * h * w / (size * big) ** 2)):
            x, y = rng.uniform(-size, w + size), rng.uniform(-size, h + size)
            a, b = size * big * rng.uniform(.4, .8), size * big * rng.uniform(.3, .55)
            color = palette[rng.integers(len(palette))] * rng.uniform(.75, 1.2)
            turn = rng.uniform(0, 180)
            for dx, dy, f, g in ((.18, .2, 1.05, .45), (0, 0, 1, 1), (-.12, -.15, .55, 1.13)):
                cv2.ellipse(image, (int((x + dx * b) * 16), int((y + dy * b) * 16)), (int(a * f * 16), int(b * f * 16)), turn, 0, 360,
                            (color * g).tolist(), -1, cv2.LINE_AA, 4)
    image = cv2.GaussianBlur(image, (0, 0), .6)
    return image * (1 + .06 * fractal(rng, h, w, 6, 3)[..., None]) * (1 + .08 * fractal(rng, h, w, w / 3, 3)[..., None])


def gravel(rng, h, w):
    tone = mix([60, 75, 90], [150, 165, 180], rng.uniform())
    return stones(rng, h, w, w / 640 * rng.uniform(7, 16), tone * rng.uniform(.7, 1.3, (6, 1)) + rng.normal(0, 9, (6, 3)))


def sand(rng, h, w, color=None):
    color = mix([105, 145, 170], [170, 195, 210], rng.uniform()) if color is None else color
    turn = rng.uniform(0, np.pi)
    y, x = np.mgrid[:h, :w] / w * 640
    wave = np.sin((x * np.cos(turn) + y * np.sin(turn)) / rng.uniform(6, 14) + 1.6 * fractal(rng, h, w, 90, 4))
    light = 1 + .03 * wave + .03 * fractal(rng, h, w, 120, 5) + .035 * fractal(rng, h, w, 10, 4) + .07 * rng.standard_normal((h, w))
    return color * cv2.GaussianBlur(light.astype(np.float32), (0, 0), .7)[..., None]


def strips(rng, h, w, length, thick, palette, n, curl=.6):
    """Shavings or straw: many short bent strips, each with its shadow."""
    image = np.full((h, w, 3), np.mean(palette, 0) * .55, np.float32)
    for _ in range(n):
        x, y, turn, bend = rng.uniform(-20, w + 20), rng.uniform(-20, h + 20), rng.uniform(0, TAU), rng.normal(0, curl)
        t = np.linspace(-.5, .5, 7); a = turn + bend * t
        line = np.stack([np.cos(a), np.sin(a)], 1).cumsum(0) * length * rng.uniform(.5, 1.3) / 7 + (x, y)
        side = np.stack([-np.sin(a), np.cos(a)], 1) * thick * rng.uniform(.6, 1.3) * (1 - 1.6 * t[:, None] ** 2) / 2
        color = palette[rng.integers(len(palette))] * rng.uniform(.8, 1.15)
        for d, f, g in ((thick * .3, 1, .62), (0, 1, 1), (-thick * .08, .45, 1.09)):
            poly = np.concatenate([line + side * f, (line - side * f)[::-1]]) + d
            cv2.fillPoly(image, [np.round(poly * 16).astype(np.int32)], (color * g).tolist(), cv2.LINE_AA, 4)
    return cv2.GaussianBlur(image, (0, 0), .6) * (1 + .05 * fractal(rng, h, w, 8, 4)[..., None])


def bedding(rng, h, w):
    tone, s = mix([110, 150, 185], [165, 195, 215], rng.uniform()), w / 640
    return strips(rng, h, w, 26 * s, rng.uniform(5, 9) * s, tone * rng.uniform(.85, 1.15, (6, 1)) + rng.normal(0, 5, (6, 3)), 3200)


def litter(rng, h, w):
    """Dead leaves, one over another, with midribs."""
    s = w / 640
    image = stones(rng, h, w, 7 * s, np.array([[35, 45, 60], [50, 65, 85], [30, 36, 45]], np.float32))
    for _ in range(170):
        x, y, a, l = rng.uniform(0, w), rng.uniform(0, h), rng.uniform(0, TAU), rng.uniform(35, 95) * s
        u = np.linspace(0, 1, 14); bend = rng.normal(0, .15) * l * u * (1 - u) * 4
        wide = l * rng.uniform(.16, .3) * np.sin(np.pi * u ** .8) * (1 + rng.normal(0, .06, 14))
        turn = np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
        at = lambda v: np.stack([l * (u - .5), v + bend], 1) @ turn + (x, y)
        color = mix([40, 75, 120], [85, 125, 165], rng.uniform()) * rng.uniform(.6, 1.15) + rng.normal(0, 8, 3)
        for up, low, d, g in ((1, 1, 4 * s, .45), (1, 1, 0, 1), (.0, .95, 0, .86)):
            poly = np.concatenate([at(wide * up), at(-wide * low)[::-1]]) + d
            cv2.fillPoly(image, [np.round(poly * 16).astype(np.int32)], (color * g).tolist(), cv2.LINE_AA, 4)
        cv2.polylines(image, [np.round(at(0 * u) * 16).astype(np.int32)], False, (color * 1.2).tolist(), 1, cv2.LINE_AA, 4)
        for j in range(2, 12, 2):
            for side in (-1, 1):
                ends = np.stack([at(0 * u)[j], at(wide * side * .8)[min(j + 2, 13)]])
                cv2.polylines(image, [np.round(ends * 16).astype(np.int32)], False, (color * .8).tolist(), 1, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(image, (0, 0), .6) * (1 + .09 * fractal(rng, h, w, 20, 5)[..., None])


def wood(rng, h, w):
    color, upright = mix([60, 95, 140], [130, 170, 205], rng.uniform()), rng.uniform() < .5
    h, w = (w, h) if upright else (h, w)
    image, y, thick = np.zeros((h, w, 3), np.float32), 0, int(h / rng.uniform(2.2, 5))
    while y < h:
        grain = fractal(rng, thick, w, 26, 6, .7, (9, .6))
        rings = np.sin(np.arange(thick)[:, None] / thick * rng.uniform(8, 25) + 2.2 * fractal(rng, thick, w, 80, 3, .5, (4, 1)))
        board = color * rng.uniform(.88, 1.1) * (1 + .07 * grain + .05 * rings)[..., None]
        board[:2] *= .5; image[y:y + thick] = board[:h - y]; y += thick
    return image if not upright else np.ascontiguousarray(image.transpose(1, 0, 2))


def weave(rng, h, w):
    color = rng.uniform(80, 180) + rng.normal(0, 17, 3); p = rng.uniform(5, 9) * w / 640
    y, x = np.mgrid[:h, :w].astype(np.float32); warp = fractal(rng, h, w, 80, 3)
    a, b = np.sin(TAU * (x + .8 * warp) / p), np.sin(TAU * (y + .8 * warp) / p)
    pattern = np.where(np.sin(np.pi * x / p) * np.sin(np.pi * y / p) > 0, a * .5 + .5, b * .5 + .5)
    light = .78 + .2 * pattern + .05 * fractal(rng, h, w, 4, 2) + .06 * fractal(rng, h, w, w / 4, 4)
    light *= np.where((x // (p * 9)).astype(int) % 5 == 0, rng.uniform(.8, 1.15), 1)
    return np.clip(color * light[..., None], 8, 245).astype(np.float32)


def soil(rng, h, w):
    color = mix([45, 60, 78], [110, 130, 150], rng.uniform())
    light = 1 + .06 * fractal(rng, h, w, 90, 3) + .13 * fractal(rng, h, w, 12, 4, .8) + .08 * rng.standard_normal((h, w))
    image = color * np.clip(light, .3, 2).astype(np.float32)[..., None]
    for _ in range(int(rng.integers(60, 300))):
        x, y, r = rng.uniform(0, w), rng.uniform(0, h), rng.exponential(1.8) * w / 640 + .5
        for d, g in ((.5, .5), (0, rng.uniform(.8, 1.5))):
            cv2.ellipse(image, (int((x + d * r) * 16), int((y + d * r) * 16)), (int(r * 16), int(r * 11)), rng.uniform(0, 180), 0, 360,
                        np.clip(color * g, 0, 240).tolist(), -1, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(image, (0, 0), .5)


def arena(rng, h, w):
    """A laboratory's floor: light plastic with scratches, smudges and dirt."""
    color = rng.uniform(135, 215) + rng.normal(0, 6, 3)
    image = (color * (1 + .03 * fractal(rng, h, w, w / 3, 6)[..., None])).astype(np.float32)
    for _ in range(70):
        x, y, a, l = rng.uniform(0, w), rng.uniform(0, h), rng.uniform(0, TAU), rng.exponential(w / 14)
        ends = np.array([[x, y], [x + l * np.cos(a), y + l * np.sin(a)]]) * 16
        cv2.polylines(image, [ends.astype(np.int32)], False, (color * rng.uniform(.85, 1.1)).tolist(), 1, cv2.LINE_AA, 4)
    for _ in range(int(rng.integers(15, 60))):
        x, y, r = rng.uniform(0, w), rng.uniform(0, h), rng.exponential(.8) * w / 640 + .4
        cv2.circle(image, (int(x * 16), int(y * 16)), int(r * 16), (color * rng.uniform(.5, .92)).tolist(), -1, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(image, (0, 0), .6)


def ground(rng, h, w, *places):
    return (places or (gravel, bedding, sand, wood, weave, arena, soil))[rng.integers(len(places) or 7)](rng, h, w)


def tank(rng, h, w, floor=.86, bed=True, plain=False, water=1):
    """A tank from the side: a mottled back wall, its water line, dirt on the glass, and a bed of gravel below."""
    deep, pale = rng.uniform(40, 110) * np.array([1.15, 1.0, .8]), rng.uniform(130, 200) * np.array([1.05, 1.02, .9])
    y = np.linspace(0, 1, h)[:, None, None]
    image = mix(pale, deep, y ** rng.uniform(.6, 1.5) * rng.uniform(.4, .9)) * np.ones((1, w, 1))
    image = image * (1 + (.04 if plain else .1) * fractal(rng, h, w, w / 5, 7, .7)[..., None])
    for _ in range(0 if plain else int(rng.integers(3, 7))):  # something out of focus behind the glass
        x, wide, top = rng.uniform(0, w), rng.uniform(.04, .14) * w, rng.uniform(.1, .6) * h
        spot = np.zeros((h, w), np.float32); spot[int(top):, max(int(x - wide), 0):int(x + wide)] = 1
        image *= 1 + cv2.GaussianBlur(spot, (0, 0), w / 60)[..., None] * rng.uniform(-.25, .2)
    image *= 1 + .05 * np.clip(fractal(rng, h, w, 14, 3) - 1.6, 0, 1)[..., None] * 3
    if bed:
        edge = h * floor + 3 * w / 640 * fractal(rng, 1, w, w / 6, 4)[0]
        bed = gravel(rng, h, w) * mix(.6, 1, np.linspace(0, 1, h)[:, None, None])
        over = np.clip(np.arange(h)[:, None] - edge + .5, 0, 1)[..., None]
        image = image * (1 - over) + bed * over
    top = int(h * rng.uniform(.02, .07)) * water; image[:top] *= .55; image[top:top + 2 * water] += 45
    return image.astype(np.float32)


# Bodies.

def skin(rng, color, belly=None, patch=None, bands=0, grain=.1, spots=0, shine=.25, rough=.45, cell=30):
    """Returns a body's texture, from head to tail (x) and from one side to the other (y), shaded as something round."""
    h, w = 96, 384
    v, u = np.linspace(-1, 1, h)[:, None, None], np.linspace(0, 1, w)[None, :, None]
    color = np.asarray(color, np.float32)
    tex = color * np.ones((h, w, 1), np.float32)
    if patch is not None:
        tex = mix(tex, patch, step(fractal(rng, h, w, 55, 3), .1, .35)[..., None])
    if bands:
        tex = tex * (1 - .45 * step(np.sin(TAU * bands * u + .5 * fractal(rng, h, w, 60, 2)[..., None]), .1, .6))
    if spots:
        tex = tex * (1 - spots * step(fractal(rng, h, w, 16, 2), .9, 1.2)[..., None])
    if belly is not None:
        tex = mix(tex, belly, step(v + .12 * fractal(rng, h, w, 50, 3)[..., None], -.1, .75))
    tex = tex * (1 + grain * fractal(rng, h, w, cell, 5, .75, (2, 1))[..., None])
    tex = tex * (1 - rough + rough * np.sqrt(np.clip(1 - .92 * v * v, 0, 1))) + 255 * shine * .35 * np.exp(-((v + .3) / .22) ** 2)
    return np.clip(tex, 3, 250).astype(np.float32)


class Layer:
    """What lies over the place: premultiplied color, its opacity, and how much of each pixel the animal covers."""

    def __init__(self, h, w):
        self.rgb, self.a, self.cov = np.zeros((h, w, 3), np.float32), np.zeros((h, w), np.float32), np.zeros((h, w), np.float32)

    def put(self, win, alpha, color, opacity=1.0, own=True):
        a = (alpha * opacity)[..., None]
        self.rgb[win] = self.rgb[win] * (1 - a) + color * a
        self.a[win] = self.a[win] * (1 - a[..., 0]) + a[..., 0]
        if own:
            self.cov[win] = np.maximum(self.cov[win], alpha)

    def tube(self, pts, half, color, opacity=1.0, soft=1.0, flip=1, own=True):
        """Draws a body around a line, with its half widths; color is one color or a skin."""
        h, w = self.a.shape
        pts, pad = np.asarray(pts, float), 2 + soft
        half = np.broadcast_to(np.asarray(half, float), len(pts))
        lo = np.maximum(np.floor((pts - half[:, None]).min(0) - pad), 0).astype(int)
        hi = np.minimum(np.ceil((pts + half[:, None]).max(0) + pad) + 1, (w, h)).astype(int)
        if (hi <= lo).any():
            return
        shape = hi[1] - lo[1], hi[0] - lo[0]
        sdf, u, v = np.full(shape, 99, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        s = np.concatenate([[0], np.hypot(*np.diff(pts, axis=0).T).cumsum()])
        s = s / max(s[-1], 1e-6)
        for (ax, ay), (bx, by), r0, r1, s0, s1 in zip(pts, pts[1:], half, half[1:], s, s[1:]):
            r = max(r0, r1) + pad
            x0, x1 = max(int(min(ax, bx) - r), lo[0]), min(int(max(ax, bx) + r) + 2, hi[0])
            y0, y1 = max(int(min(ay, by) - r), lo[1]), min(int(max(ay, by) + r) + 2, hi[1])
            if x1 <= x0 or y1 <= y0:
                continue
            gx, gy = (np.arange(x0, x1) - ax).astype(np.float32), (np.arange(y0, y1) - ay).astype(np.float32)[:, None]
            dx, dy = np.float32(bx - ax), np.float32(by - ay)
            t = np.clip((gx * dx + gy * dy) / (dx * dx + dy * dy + 1e-9), 0, 1)
            dist = np.hypot(gx - t * dx, gy - t * dy)
            wide = np.float32(r0) + np.float32(r1 - r0) * t
            win = slice(y0 - lo[1], y1 - lo[1]), slice(x0 - lo[0], x1 - lo[0])
            nearer = dist - wide < sdf[win]
            sdf[win][nearer] = (dist - wide)[nearer]
            u[win][nearer] = (s0 + (s1 - s0) * t)[nearer]
            v[win][nearer] = (np.where(dx * gy > dy * gx, dist, -dist) / np.maximum(wide, .5))[nearer]
        alpha = np.clip(.5 - sdf / soft, 0, 1) * min(1, 2.2 * half.max())
        if np.ndim(color) == 3:
            color = cv2.remap(color, u * (color.shape[1] - 1), np.clip(.5 + .5 * v * np.float32(flip), 0, 1) * (color.shape[0] - 1), cv2.INTER_LINEAR)
        self.put((slice(lo[1], hi[1]), slice(lo[0], hi[0])), alpha, np.asarray(color, np.float32), opacity, own)

    def dot(self, x, y, r, color, opacity=1.0, **more):
        self.tube([[x, y], [x + .01, y]], r, color, opacity, **more)

    def poly(self, pts, color, opacity=1.0, own=True, rays=None):
        """Draws a fin or a flat part; rays are lines from one point to the outline's points."""
        h, w = self.a.shape
        pts = np.asarray(pts, float)
        lo = np.maximum(np.floor(pts.min(0)) - 2, 0).astype(int)
        hi = np.minimum(np.ceil(pts.max(0)) + 3, (w, h)).astype(int)
        if (hi <= lo).any():
            return
        mask = np.zeros((hi[1] - lo[1], hi[0] - lo[0]), np.uint8)
        cv2.fillPoly(mask, [np.round((pts - lo) * 16).astype(np.int32)], 255, cv2.LINE_AA, 4)
        light = np.ones(mask.shape, np.float32)
        if rays is not None:
            for p in pts:
                for q in (.35, .7, 1):
                    end = (np.asarray(rays) * (1 - q) + p * q - lo) * 16
                    cv2.line(light, tuple(int(c) for c in (np.asarray(rays) - lo) * 16), tuple(int(c) for c in end), .72, 1, cv2.LINE_AA, 4)
        self.put((slice(lo[1], hi[1]), slice(lo[0], hi[0])), mask / np.float32(255), np.asarray(color, np.float32) * light[..., None], opacity, own)

    def warp(self, m):
        """Returns the layer moved by a 2 x 3 matrix."""
        other, size = Layer(1, 1), self.a.shape[::-1]
        other.rgb, other.a, other.cov = (cv2.warpAffine(p, np.float32(m), size) for p in (self.rgb, self.a, self.cov))
        return other

    def over(self, image, opacity=1.0):
        rows, cols = self.a.any(1).nonzero()[0], self.a.any(0).nonzero()[0]
        if len(rows):
            win = slice(rows[0], rows[-1] + 1), slice(cols[0], cols[-1] + 1)
            o = opacity[win] if np.ndim(opacity) else np.full((1, 1), opacity, np.float32)
            image[win] = image[win] * (1 - (self.a[win] * o)[..., None]) + self.rgb[win] * o[..., None]
        return image


def darken(image, shadow, strength, blur=0):
    """Darkens a picture where there is shadow (0 to 1), a bit less in blue, as the sky or the room fills it."""
    if blur:
        shadow = cv2.GaussianBlur(shadow, (0, 0), blur)
    return image * (1 - (strength * shadow)[..., None] * np.float32([.94, .98, 1]))


class Film:
    """One film while it is made: its random numbers, its camera, its file and its truth."""

    def __init__(self, folder, kind, seed, size=None, n=None):
        self.stem, self.kind, self.seed = pathlib.Path(folder) / f"{kind}-{seed}", kind, seed
        self.rng = rng = np.random.default_rng([zlib.crc32(kind.encode()), seed])
        self.w, self.h = SIZES[rng.integers(len(SIZES))]
        self.n, self.s = int(rng.integers(240, 451)), self.w / 640
        self.blur, self.noise = rng.uniform(.5, .95) * max(self.s, .7), rng.uniform(.9, 2.6)
        y, x = np.mgrid[-1:1:self.h * 1j, -1:1:self.w * 1j]
        slope = rng.normal(0, .05, 2)
        self.lens = ((1 - rng.uniform(.04, .2) * (x * x + y * y) / 2 + slope[0] * x + slope[1] * y)[..., None] * rng.normal(1, .03, 3)).astype(np.float32)
        self.frames, self.masks = [], []
        self.part = self.stem.with_suffix(".part.mp4")
        self.out = subprocess.Popen(
            f"ffmpeg -v error -y -f rawvideo -pix_fmt bgr24 -s {self.w}x{self.h} -r 30 -i - -c:v libx264 -crf 18 -pix_fmt yuv420p".split()
            + ["-threads", "1", str(self.part)], stdin=subprocess.PIPE)

    def layer(self):
        return Layer(self.h, self.w)

    def add(self, image, animal, forward, hide=None, after=None, **more):
        """Takes the next frame: the picture before the lens, the animal's layer (or cover), what hides it, what the camera prints on it."""
        image = cv2.GaussianBlur(np.asarray(image, np.float32) * self.lens, (0, 0), self.blur)
        grain = self.rng.standard_normal((self.h, self.w, 4), np.float32)
        grain = cv2.GaussianBlur(.8 * grain[..., :3] + .6 * grain[..., 3:], (3, 3), .45) * 1.3
        image = np.clip(image + grain * (self.noise * np.sqrt(.3 + np.clip(image, 0, 255) / 180)), 0, 255)
        image = image if after is None else after(image)
        assert np.isfinite(image).all()
        self.out.stdin.write(np.clip(image + .5, 0, 255).astype(np.uint8).tobytes())
        cov = animal.cov if isinstance(animal, Layer) else animal
        cov = cov if hide is None else cov * (1 - hide)
        mask, area = cov >= .5, float(cov.sum())
        self.masks.append(np.packbits(mask))
        if mask.sum() < 12:
            self.frames.append({"centroid_px": None, "forward": [0, 0, 0], "box_px": None, "area_px": 0, "absent": True, **more})
            return
        x, y, w, h = cv2.boundingRect(mask.astype(np.uint8))
        long = np.hypot(*forward[:2])
        ahead = [round(float(forward[0] / long), 5), round(float(forward[1] / long), 5), 0] if long > 1e-6 else [0, 0, 0]
        at = [float(cov.sum(0) @ np.arange(self.w)) / area, float(cov.sum(1) @ np.arange(self.h)) / area]
        self.frames.append({"centroid_px": [round(c, 3) for c in at], "forward": ahead, "box_px": [x, y, w, h],
                            "area_px": round(area, 1), "absent": False, **more})

    def close(self):
        self.out.stdin.close()
        assert self.out.wait() == 0
        seen = [k for k, f in enumerate(self.frames) if not f["absent"]]
        picks = [seen[i] for i in np.linspace(0, len(seen) - 1, 10).round().astype(int)]
        masks = np.stack([np.unpackbits(self.masks[k])[:self.h * self.w].reshape(self.h, self.w).astype(bool) for k in picks])
        np.savez_compressed(f"{self.stem}.masks.npz", frames=np.array(picks), masks=masks)
        pathlib.Path(f"{self.stem}.truth.json").write_text(json.dumps({"fps": 30, "kind": self.kind, "seed": self.seed, "frames": self.frames}))
        os.replace(self.part, f"{self.stem}.mp4")


# Ways to move.

def roam(film, speed, margin, turn=.1, pace=None, idle=.02):
    """Returns x, y, heading and the way made, from one far goal to the next; pace (0 to 1 per frame) slows it."""
    rng, w, h = film.rng, film.w, film.h
    x0, y0, x1, y1 = margin, margin, w - margin, h - margin
    goal = lambda: np.array([rng.uniform(x0, x1), rng.uniform(y0, y1)])
    at, aim, a, rows, way = goal(), goal(), None, [], 0.0
    fast = speed * film.s * np.exp(.3 * drift(rng, film.n, 25)) * (1 if pace is None else pace)
    side = .5 * drift(rng, film.n, 18)
    for k in range(film.n):
        while np.hypot(*(aim - at)) < max(.12 * (x1 - x0), 3 * speed * film.s):
            aim = goal()
        want = np.arctan2(*(aim - at)[::-1]) + side[k]
        a = want if a is None else a + np.clip((want - a + np.pi) % TAU - np.pi, -1, 1) * turn * min(1, fast[k] / (speed * film.s + 1e-9) + idle)
        at = at + fast[k] * np.array([np.cos(a), np.sin(a)])
        at = np.clip(at, (x0, y0), (x1, y1)); way += fast[k]
        rows.append((*at, a, way))
    x, y, a, way = np.array(rows).T
    return smooth(x, 2), smooth(y, 2), smooth(np.unwrap(a), 2), way


def glide(film, speed, box, first=None):
    """Returns x, y, the facing (-1 left to 1 right), the pitch and the swum way of a fish seen from the side."""
    rng, (x0, y0, x1, y1) = film.rng, box
    at = np.array(first if first is not None else (rng.uniform(x0, x1), rng.uniform(y0, y1)))
    rows = []
    while len(rows) < film.n + 40:
        goal = np.array([rng.uniform(x0, x1), np.clip(at[1] + rng.normal(0, .3) * (y1 - y0), y0, y1)])
        if abs(goal[0] - at[0]) < .4 * (x1 - x0):
            continue
        m = int(np.hypot(*(goal - at)) / (speed * film.s * rng.uniform(.7, 1.3))) + 2
        rows += list(at + (goal - at) * np.linspace(0, 1, m, endpoint=False)[:, None]); at = goal
    x, y = (smooth(c, 7)[:film.n] for c in np.array(rows).T)
    vx, vy = np.gradient(x), np.gradient(y)
    face = smooth(np.where(vx > 0, 1.0, -1.0), 3)
    pitch = np.clip(smooth(np.arctan2(-vy, np.abs(vx) + .3), 5), -.38, .38)
    return x, y, face, pitch, np.hypot(vx, vy).cumsum()


def lag(curve, k, frames):
    return np.interp(k - frames, np.arange(len(curve)), curve)


def spine(x, y, angles, length):
    """Returns the points of a body from its nose on; angles are where each piece points (forward)."""
    pieces = length / len(angles) * np.stack([np.cos(angles), np.sin(angles)], 1)
    return np.array([x, y]) - np.concatenate([[[0, 0]], pieces.cumsum(0)])


def aside(pts, u, out):
    """Returns a point beside a spine: at u (0 nose to 1 tail), out px to its left or right."""
    i = u * (len(pts) - 1); j = min(int(i), len(pts) - 2)
    d = pts[j] - pts[j + 1]; d = d / (np.hypot(*d) + 1e-9)
    return pts[j] + (pts[j + 1] - pts[j]) * (i - j) + out * np.array([-d[1], d[0]]), d


def fish_color(rng, dark=None):
    hues = [[40, 45, 50], [55, 75, 85], [30, 90, 190], [60, 120, 200], [120, 130, 140], [150, 110, 60], [70, 60, 120]]
    hues = hues[:2] if dark else hues
    return np.clip(np.array(hues[rng.integers(len(hues))]) * rng.uniform(.8, 1.2) + rng.normal(0, 8, 3), 15, 235)


def top_fish(film, length, color=None, wide=None, look=None):
    """Returns draw(layer, x, y, angles, phase, beat): a fish from above, its nose at x, y."""
    rng = film.rng
    color = fish_color(rng) if color is None else color
    patch, bands, spots = look or (rng.uniform() < .6 and rng.uniform(.55, 1.4), rng.choice([0, 0, 7]), rng.choice([0, .4]))
    tex = skin(rng, color, patch=color * patch if patch else None, bands=bands, spots=spots)
    u = np.linspace(0, 1, 31)
    half = length * (wide or rng.uniform(.085, .12)) * np.interp(u, [0, .04, .12, .26, .5, .75, .86, 1], [.3, .55, .85, 1, .8, .36, .2, .1])

    def draw(layer, x, y, angles, phase=0.0, beat=1.0):
        v = np.linspace(0, 1, 30)
        pts = spine(x, y, angles + beat * (.5 * v ** 1.3 - .06) * np.sin(phase - 4.5 * v), length)
        for side in (-1, 1):
            (root, d), flap = aside(pts, .27, side * half[8] * .8), .25 * np.sin(phase * .5 + side)
            n = side * np.array([-d[1], d[0]])
            fin = [root + length * (a * -d + b * n) for a, b in ((-.02, 0), (.02, .08 + .03 * flap), (.09, .13 + .05 * flap), (.13, .09), (.07, 0))]
            layer.poly(fin, color * .85 + 12, .55, rays=root)
        end, d = aside(pts, .93, 0); n = np.array([-d[1], d[0]]); bend = .02 * np.sin(phase - 6) * beat
        layer.poly([end, end + length * (-.06 * d + (.018 + bend) * n), end + length * (-.11 * d + bend * 2 * n), end + length * (-.06 * d + (bend - .018) * n)], color * .8, .6)
        layer.tube(pts, half, tex)
        layer.tube([aside(pts, q, 0)[0] for q in (.38, .48, .6)], [.2, length * .009, .2], color * .45, .8)
        for side in (-1, 1):
            eye = aside(pts, .1, side * half[3] * .78)[0]
            layer.dot(*eye, length * .016, [12, 12, 12]); layer.dot(eye[0] - length * .004, eye[1] - length * .004, length * .005, [200] * 3, .7)
        return pts
    return draw


def side_fish(film, length, color=None, tall=None):
    """Returns draw(layer, x, y, face, pitch, phase): a fish from the side, its middle at x, y."""
    rng = film.rng
    color = fish_color(rng) if color is None else np.asarray(color, float)
    tall = tall or rng.uniform(.13, .2)
    tex = skin(rng, color, belly=mix(color, [200, 210, 215], rng.uniform(.3, .8)), bands=rng.choice([0, 0, 4, 6]), spots=rng.choice([0, .35]), grain=.12, cell=14)
    fin, fork, u = mix(color, rng.uniform(60, 200, 3), .3), rng.uniform(.0, .09), np.linspace(0, .84, 26)
    half = length * tall * np.interp(u, [0, .03, .1, .2, .34, .55, .72, .84], [.1, .38, .68, .9, 1, .78, .4, .28])

    def draw(layer, x, y, face, pitch, phase=0.0, beat=1.0):
        c, s, wave = np.cos(pitch), np.sin(pitch), beat * (.5 + .5 * np.sin(phase))
        f = np.copysign(max(abs(face), .22), face)

        def at(u, v=0.0):  # u from nose to tail, v upward, in lengths
            ahead = length * (.5 - u + .07 * wave * np.maximum(u - .4, 0)); v = v * length
            return np.stack([x + f * (ahead * c - v * s), y - ahead * s - v * c], -1)
        tip = .1 + .02 * np.sin(phase)
        layer.poly([at(.8, .045), at(.92, tip), at(1, tip * 1.25), at(1 - fork, .0), at(1, -tip * 1.25), at(.92, -tip), at(.8, -.045)], fin, .72, rays=at(.8))
        layer.poly([at(.3, tall * .9), at(.38, tall * 1.45), at(.5, tall * 1.4), at(.64, tall * 1.05), at(.66, tall * .5)], fin, .7, rays=at(.42, tall * .6))
        layer.poly([at(.55, -tall * .65), at(.62, -tall * 1.2), at(.7, -tall * .95), at(.72, -tall * .3)], fin, .65, rays=at(.58, -tall * .4))
        layer.poly([at(.36, -tall * .9), at(.45, -tall * 1.3), at(.48, -tall * .8)], fin, .65)
        layer.tube(at(u), half, tex, flip=-1 if f > 0 else 1)
        layer.tube([at(.19, tall * .55), at(.225, .1 * tall), at(.2, -tall * .5)], length * .006, color * .5, .55)
        flap = .05 + .035 * np.sin(phase * .6 + 1)
        layer.poly([at(.26, -.1 * tall), at(.36, -.1 * tall + flap), at(.39, -.35 * tall - flap), at(.3, -.4 * tall)], fin * .85, .7, rays=at(.26, -.2 * tall))
        if abs(face) > .25:
            eye, r = at(.085, tall * .22), length * .02
            layer.dot(*eye, r * 1.25, mix(color, [190, 205, 210], .6)); layer.dot(*eye, r * .8, [14, 14, 14])
            layer.dot(eye[0] - r * .3, eye[1] - r * .35, r * .25, [235] * 3, .9)
    return draw


def apart(color, image, by=38):
    """Returns a color made darker or lighter, so that it differs from the place."""
    tone = image.mean()
    if abs(color.mean() - tone) > by:
        return color
    return np.clip(color * (tone - by if tone > 95 else tone + by * 1.6) / color.mean(), 8, 240)


def facing(face, pitch):
    return (0, 0) if abs(face) < .3 else (np.sign(face) * np.cos(pitch), -np.sin(pitch))


def rodent(film, length, color, paws, nose=None, tail=True, below=False):
    """Returns draw(layer, x, y, angles, step): a mouse or rat from above (or below), the tip of its nose at x, y."""
    rng = film.rng
    tex = skin(rng, color, patch=color * rng.uniform(.88, 1.12), grain=.09, shine=.08, rough=.5, cell=10)
    u = np.linspace(0, 1, 25); pink = np.asarray(paws, float)
    half = length * rng.uniform(.92, 1.1) * np.interp(u, [0, .05, .16, .28, .42, .68, .88, 1], [.022, .05, .095, .095, .125, .165, .125, .05])
    if nose is not None:
        t = step(np.linspace(0, 1, tex.shape[1]), .1, .2)[None, :, None]
        tex = (nose * (.7 + .3 * tex / tex.mean()) * (1 - t) + tex * t).astype(np.float32)

    def draw(layer, x, y, angles, way, sway=0.0):
        a = np.interp(np.linspace(0, 1, 24), np.linspace(0, 1, len(angles)), angles)
        pts = spine(x, y, a, length); ph = TAU * way / (length * .75)
        if tail:
            end, d = aside(pts, .97, 0); b = np.arctan2(d[1], d[0]) + .5 * np.sin(np.linspace(0, 3.4, 16) + sway) * np.linspace(.2, 1, 16)
            layer.tube(spine(*end, b, length * .85), length * np.linspace(.028, .009, 17), skin_of(pink * .85))

        def limb(q, side, reach, shift, size):
            swing = np.sin(ph + shift)
            (hip, d), n = aside(pts, q, side * half[int(q * 24)] * .6), None
            n = side * np.array([-d[1], d[0]])
            foot = hip + length * (reach * n + (.06 + .085 * swing) * d)
            layer.tube([hip, (hip + foot) / 2, foot], length * np.array([.04, .03, .022]), color * .8 if not below else mix(color, pink, .5), soft=1.5)
            layer.tube([foot, foot + length * size * d], length * np.array([.022, .024]), pink)
            for toe in (-.5, 0, .5):
                layer.tube([foot + length * size * d, foot + length * (size * 1.5 * d + size * .55 * toe * n)], length * .008, pink * .95)
        limbs = [(.33, 1, .10, 0, .035), (.33, -1, .10, np.pi, .035), (.78, 1, .13, np.pi, .075), (.78, -1, .13, 0, .075)]
        if not below:
            [limb(*l) for l in limbs]
        layer.tube(pts, half, tex, soft=1.8)
        if below:
            [limb(*l) for l in limbs]
        for side in (-1, 1):
            ear = aside(pts, .22, side * half[5] * 1.0)[0]
            layer.dot(*ear, length * .047, mix(color, pink, .35), soft=1.6); layer.dot(*ear, length * .026, mix(color * .8, pink, .6), .8, soft=1.5)
            if not below:
                layer.dot(*aside(pts, .11, side * half[3] * .7)[0], length * .014, [10, 10, 10])
        layer.dot(*pts[0], length * .016, mix(pink, [90, 90, 160], .4) if nose is None else nose * .92)
        return pts
    return draw


def skin_of(color):
    """Returns a small plain round texture."""
    v = np.linspace(-1, 1, 16)[:, None, None]
    return (np.asarray(color, np.float32) * (.5 + .5 * np.sqrt(np.clip(1 - .9 * v * v, 0, 1))) * np.ones((16, 8, 1))).astype(np.float32)


# The kinds. Each gets a film and adds its frames.

def station(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    left, length = rng.uniform() < .5, w * rng.uniform(.26, .42)
    image = arena(rng, h, w) * rng.uniform(.6, 1)
    x, y = np.mgrid[:w, :h].transpose(0, 2, 1)
    along = x if film.seed % 2 else y
    p = rng.uniform(22, 50) * s
    image *= 1 - rng.uniform(.25, .55) * (.5 + .5 * np.clip(3 * np.sin(TAU * along / p), -1, 1))[..., None] * (1 + .15 * fractal(rng, h, w, 30, 4)[..., None])
    wall = int(h * rng.uniform(.08, .15))
    for rows in (slice(0, wall), slice(h - wall, h)):
        image[rows] = mix(image[rows], rng.uniform(60, 120, 3), .75) * (1 + .05 * fractal(rng, wall, w, 30, 4, .6, (8, 1))[..., None])
    for row in (wall, h - wall):
        image[row - 2:row + 2] = image[row - 2:row + 2] * .4 + 60
    fish, f0 = top_fish(film, length), rng.uniform(1.2, 2.6)
    x0, y0 = w * rng.uniform(.22, .36), h * rng.uniform(.4, .6)
    dx, dy = 1.6 * s * drift(rng, film.n, 40), 1.6 * s * drift(rng, film.n, 40)
    phase, turn = TAU * np.cumsum(f0 / 30 * (1 + .12 * drift(rng, film.n, 20))), .03 * drift(rng, film.n, 30)
    motes = rng.uniform(0, 1, (25, 4))
    for k in range(film.n):
        layer, frame = film.layer(), image.copy()
        pts = fish(layer, x0 + dx[k], y0 + dy[k], np.pi + turn[k] + np.zeros(30), phase[k], 1.0)
        shade = film.layer(); shade.a = cv2.warpAffine(layer.cov, np.float32([[1, 0, 7 * s], [0, 1, 10 * s]]), (w, h))
        frame = layer.over(darken(frame, shade.a, .22, 5 * s))
        for q, r, v, c in motes:  # what the current carries along
            mx, my = (q + k * (.012 + .008 * v)) % 1.2 * w - .1 * w, wall + r * (h - 2 * wall)
            drop = film.layer(); drop.tube([[mx, my], [mx + 5 * s, my]], .6 * s, [200 * c + 30] * 3, .35); drop.over(frame)
        cover = layer.cov
        ahead = pts[0] - pts[20]
        if not left:
            frame, cover, ahead = frame[:, ::-1], cover[:, ::-1], ahead * (-1, 1)
        film.add(frame, cover, ahead)


def slow_crawler(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    what = ("slug", "worm", "caterpillar")[film.seed % 3]
    agar = what == "worm" or rng.uniform() < .3
    length = w * (rng.uniform(.2, .32) if what != "worm" else rng.uniform(.16, .26))
    if agar:
        image = (rng.uniform(140, 190) + rng.normal(0, 6, 3)) * (1 + .035 * fractal(rng, h, w, w / 2, 7, .55)[..., None])
        cv2.circle(image, (int(w * rng.uniform(.4, .6)), int(h * rng.uniform(.4, .6))), int(.52 * w), (image.mean((0, 1)) * .6).tolist(), int(5 * s), cv2.LINE_AA)
        for _ in range(120):
            cv2.circle(image, (int(rng.integers(w)), int(rng.integers(h))), int(rng.integers(1, 3)), (image.mean((0, 1)) * rng.uniform(.5, 1.15)).tolist(), -1, cv2.LINE_AA)
    else:
        image = litter(rng, h, w)
    colors = {"slug": [35, 50, 70], "worm": [110, 125, 160], "caterpillar": [60, 150, 120]}
    color = np.array(colors[what]) * rng.uniform(.8, 1.2) + rng.normal(0, 8, 3)
    waves = 15 if what != "slug" else 0
    tex = skin(rng, color, bands=waves, spots=.4 if what == "slug" else 0, grain=.16, shine=.5 if what != "caterpillar" else .15, cell=16)
    thick = {"slug": .085, "worm": .026, "caterpillar": .065}[what]
    made = length * rng.uniform(.35, .75) * np.linspace(0, 1, film.n)
    made = smooth(made + length * .012 * np.sin(np.arange(film.n) / 30 * TAU * rng.uniform(.4, .8)), 2)
    a0, trail = rng.uniform(0, TAU), np.arange(0, 3 * length, 1.0)  # the way it takes, one point a px
    bend = rng.uniform(.3, .6) * drift(rng, len(trail), length * .3) if what != "worm" else .75 * np.sin(TAU * trail / length / rng.uniform(.55, .8))
    way = np.cumsum(np.stack([np.cos(a0 + bend), np.sin(a0 + bend)], 1), 0)
    way += (w / 2, h / 2) - way[int(1.55 * length)]
    u = np.linspace(0, 1, 34)
    for k in range(film.n):
        layer, head = film.layer(), 1.2 * length + made[k]
        squeeze = np.sin(TAU * (2 * u - k / 30 * .7))
        where = head - length * (u + (.018 * squeeze if what != "worm" else 0))
        pts = np.stack([np.interp(where, trail, c) for c in way.T], 1)
        half = length * thick * np.interp(u, [0, .05, .15, .5, .8, 1], [.45, .75, .9, 1, .8, .12 if what != "caterpillar" else .6]) * (1 - .1 * squeeze * (what != "worm"))
        d = pts[0] - pts[2]; d = d / np.hypot(*d); n = np.array([-d[1], d[0]])
        if what == "slug":
            for side, q in ((-1, .11), (1, .1), (-.6, .05), (.6, .05)):
                tip = pts[0] + length * (q * d + side * .045 * n * (1 + .15 * np.sin(k / 17 + side)))
                layer.tube([pts[0], tip], length * .006, color * .8); layer.dot(*tip, length * .01, color * .4)
        if what == "caterpillar":
            half = half * (1 + .07 * np.sin(TAU * 15 * u))
            for q in np.linspace(.06, .95, 14):
                for side in (-1, 1):
                    i = min(int(q * 33), 32); dd = pts[i] - pts[i + 1]; dd = dd / np.hypot(*dd)
                    layer.tube([pts[i], pts[i] + side * length * .075 * np.array([-dd[1], dd[0]])], length * .006, color * .55)
        layer.tube(pts, half, tex, soft=1.2)
        if what == "slug":
            layer.tube(pts[4:13], half[4:13] * .78, tex * .82, .8)
        if what == "caterpillar":
            layer.dot(*pts[0], length * .045, color * .35)
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 3 * s], [0, 1, 4 * s]]), (w, h))
        film.add(layer.over(darken(image.copy(), shade, .4, 2.5 * s)), layer, pts[0] - pts[-1])


def head_fixed(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    length = w * rng.uniform(.36, .55)
    light = rng.uniform(120, 185)
    image = light * (1 + .04 * fractal(rng, h, w, w / 2, 8, .55)) + 0 * light
    x0, y0, a0 = w * .5, h * .5, rng.choice([0, np.pi / 2, np.pi, -np.pi / 2]) + rng.normal(0, .12)
    if abs(np.sin(a0)) > .7:
        length = h * rng.uniform(.6, .75)
    d = np.array([np.cos(a0), np.sin(a0)]); n = np.array([-d[1], d[0]])
    nose = np.array([x0, y0]) + d * length * .45
    gel = film.layer()  # the cut edge of the agarose that holds the head
    cut = [nose + length * (-.3 * d + v * n + .05 * np.sin(v * 6 + 1) * d) for v in np.linspace(-3, 3, 40)]
    gel.tube(cut, 3.2 * s, [light * .6] * 3, .6, soft=3); gel.tube(np.array(cut) - d * 4 * s, 1.5 * s, [min(light * 1.35, 250)] * 3, .6, soft=3)
    image = gel.over((image[..., None] * rng.normal(1, .02, 3)).astype(np.float32))
    for _ in range(60):
        spot = film.layer(); px, py, r = rng.uniform(0, w), rng.uniform(0, h), rng.exponential(2.2) * s + .6
        spot.dot(px, py, r, [light * .55] * 3, .5, soft=2); spot.dot(px, py, r * .5, [light * 1.2] * 3, .5, soft=2); spot.over(image)
    bout, k = np.zeros(film.n), int(rng.integers(15, 45))
    while k < film.n:
        long = int(rng.integers(8, 28)); bout[k:k + long] = rng.uniform(.5, 1) * rng.choice([-1, 1]); k += long + int(rng.integers(18, 75))
    beat, phase = smooth(bout, 2.0), np.cumsum(TAU * rng.uniform(2.5, 5) / 30 * (1 + .1 * drift(rng, film.n, 20)))
    dark = np.array([light * .42] * 3) * rng.normal(1, .05, 3)
    tex = skin(rng, dark, spots=.5, grain=.14, shine=.05, cell=10)
    tail = mix(skin(rng, dark * 1.25, bands=16, grain=.1, shine=.2), [light] * 3, .25).astype(np.float32)
    v = np.linspace(0, 1, 34)
    for k in range(film.n):
        layer = film.layer()
        angles = a0 + beat[k] * 1.5 * step(v, .3, .95) * (np.sin(phase[k] - 4 * v) + .35)
        pts = spine(*nose, angles, length); u = np.linspace(0, 1, 35)
        layer.tube(pts[8:], length * .045 * np.interp(u[8:], [.24, .5, .9, 1], [.9, .75, .6, .1]), [light * .85] * 3, .45)  # the fin fold
        layer.tube(pts[8:], length * .034 * np.interp(u[8:], [.24, .5, .9, 1], [1, .55, .22, .1]), tail, .9)
        layer.tube(pts[:13], length * .075 * np.interp(u[:13], [0, .03, .1, .17, .26, .36], [.4, .75, .98, .85, .75, .4]), tex, .92, soft=1.5)
        for side in (-1, 1):
            layer.tube([aside(pts, .065, side * length * .058)[0], aside(pts, .115, side * length * .062)[0]], length * .026, [18, 18, 20])
            (root, fd), flap = aside(pts, .2, side * length * .05), .03 * np.sin(phase[k] * .7) * abs(beat[k])
            fn = side * np.array([-fd[1], fd[0]])
            layer.poly([root, root + length * (.02 * -fd + (.05 + flap) * fn), root + length * (.08 * -fd + (.045 + flap) * fn), root - length * .06 * fd], [light * .8] * 3, .4)
        layer.tube(pts[8:11], length * .03, [light * .25] * 3, .6, soft=2)  # the swim bladder
        film.add(layer.over(image.copy()), layer, d)


def resting_mirror(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    floor, wall, right = h * rng.uniform(.72, .8), w * rng.uniform(.2, .27), rng.uniform() < .5
    image = tank(rng, h, w, bed=False, plain=True)
    below, beyond = np.arange(h)[:, None] > floor, np.arange(w)[None, :] < wall
    flip = image[np.clip((2 * floor - np.arange(h)).astype(int), 0, h - 1)]
    image = np.where(below[..., None], flip * .62 + 8, image); image = np.where((beyond & ~below)[..., None], image * .72 + 12, image)
    image[int(floor) - 1:int(floor) + 2] = image[int(floor) - 1:int(floor) + 2] * .5 + 70
    image[:, int(wall) - 1:int(wall) + 1] *= .55
    length, rest = w * rng.uniform(.2, .28), int(.8 * film.n)
    fish, tall = side_fish(film, length, tall=.16), .16 * length * 1.35
    box = wall + .6 * length, h * .25, w - .6 * length, floor - tall - 3 * s
    x1, y1 = box[0] + rng.uniform(-.03, .08) * w, floor - tall - 2 * s
    gx, gy, gf, gp, gw = glide(film, 3.2, box, first=(x1, y1))
    t = np.arange(film.n); moved = np.maximum(t - rest, 0)
    x = np.where(t < rest, x1 + .8 * s * drift(rng, film.n, 50), lag(gx, moved, 0)); y = np.where(t < rest, y1 + .6 * s * np.sin(t / 31), lag(gy, moved, 0))
    x, y = smooth(x, 2), smooth(y, 2)
    face = np.where(t < rest, gf[0], lag(gf, moved, 0)); pitch = smooth(np.where(t < rest, -.03, lag(gp, moved, 0)), 3)
    phase = np.cumsum(np.where(t < rest, .1, .5) * (1 + .2 * drift(rng, film.n, 20)))
    dim, side = rng.uniform(.35, .55), rng.uniform(.25, .4)
    soft = cv2.GaussianBlur(fractal(rng, h, w, 30, 3) * .12 + 1, (0, 0), 2)
    for k in range(film.n):
        layer = film.layer(); fish(layer, x[k], y[k], face[k], pitch[k], phase[k], .25 if k < rest else 1)
        frame = image.copy()
        low = layer.warp([[1, 0, 0], [0, -1, 2 * floor]]); low.rgb, low.a = cv2.GaussianBlur(low.rgb, (0, 0), 1.0 * s), cv2.GaussianBlur(low.a, (0, 0), 1.0 * s)
        low.over(frame, (dim * soft * below).astype(np.float32))
        layer.warp([[-1, 0, 2 * wall], [0, 1, 0]]).over(frame, (side * soft * (beyond & ~below)).astype(np.float32))
        frame, cover, ahead = layer.over(frame), layer.cov, facing(face[k], pitch[k])
        if right:
            frame, cover, ahead = frame[:, ::-1], cover[:, ::-1], (-ahead[0], ahead[1])
        film.add(frame, cover, ahead)


def side_mirror(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    slant, right = np.radians(rng.uniform(10, 40)) * rng.choice([-1, 1]), rng.uniform() < .5
    px, py = w * rng.uniform(.28, .38), h * .5
    nx, ny = np.cos(slant), np.sin(slant)  # into the tank
    gy, gx = np.mgrid[:h, :w].astype(np.float32)
    depth = ((gx - px) * nx + (gy - py) * ny).astype(np.float32)
    image = tank(rng, h, w, floor=.88)
    copy = cv2.remap(image, gx - 2 * depth * np.float32(nx), gy - 2 * depth * np.float32(ny), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    beyond = step(-depth, -.7, .7)
    image = mix(image, copy * .75 + 10, beyond[..., None]) * (1 - .45 * np.exp(-(depth / (1.6 * s)) ** 2)[..., None])
    m = [[1 - 2 * nx * nx, -2 * nx * ny, 2 * nx * (nx * px + ny * py)], [-2 * nx * ny, 1 - 2 * ny * ny, 2 * ny * (nx * px + ny * py)]]
    length, strength = w * rng.uniform(.14, .22), rng.uniform(.5, .8)
    far = w - .6 * length - px - abs(np.tan(slant)) * .28 * h
    fish = side_fish(film, length)
    x, y, face, pitch, way = glide(film, rng.uniform(2.2, 3.6), (.58 * length, .22 * h, min(.5 * w, far), .78 * h))
    x = x + px - (y - py) * np.tan(slant)  # it keeps along the mirror
    for k in range(film.n):
        layer = film.layer(); fish(layer, x[k], y[k], face[k], pitch[k], way[k] / length * 9)
        mirror = layer.warp(m); frame = mirror.over(image.copy(), strength * beyond)
        layer.rgb *= (1 - beyond)[..., None]; layer.a *= 1 - beyond; layer.cov *= 1 - beyond
        frame, cover, ahead = layer.over(frame), layer.cov, facing(face[k], pitch[k])
        if right:
            frame, cover, ahead = frame[:, ::-1], cover[:, ::-1], (-ahead[0], ahead[1])
        film.add(frame, cover, ahead)


def cast_shadow(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = tank(rng, h, w, plain=rng.uniform() < .5) * 1.1 + 15
    length = w * rng.uniform(.16, .26)
    fish = side_fish(film, length)
    x, y, face, pitch, way = glide(film, rng.uniform(2, 3.5), (.5 * length, .18 * h, w - .75 * length, .72 * h))
    dx, dy = rng.choice([-1, 1]) * rng.uniform(.3, .6) * length, rng.uniform(-.1, .3) * length
    dark, soft, big = rng.uniform(.35, .6), rng.uniform(1.2, 2.6) * s, rng.uniform(1, 1.12)
    for k in range(film.n):
        layer = film.layer(); fish(layer, x[k], y[k], face[k], pitch[k], way[k] / length * 9)
        m = np.float32([[big, 0, dx + (1 - big) * x[k]], [0, big, dy + (1 - big) * y[k]]])
        shade = cv2.warpAffine(cv2.GaussianBlur(layer.a, (0, 0), soft), m, (w, h))
        film.add(layer.over(darken(image.copy(), shade, dark)), layer, facing(face[k], pitch[k]))


def lamp_shadow(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = ground(rng, h, w, gravel, bedding, wood, weave, arena, soil) * 1.1
    length = w * rng.uniform(.15, .22)
    color = np.array([[55, 65, 75], [140, 150, 158], [60, 85, 115], [205, 212, 215]][rng.integers(4)]) * rng.uniform(.85, 1.1)
    mouse = rodent(film, length, color, [140, 150, 195])
    pace = step(drift(rng, film.n, 25), -1.1, -.4)
    x, y, a, way = roam(film, 2.6, .2 * w, .12, pace)
    lamp, dark = rng.uniform(0, TAU), rng.uniform(.4, .6)
    image *= (1 + .18 * (np.cos(lamp) * np.linspace(1, -1, w)[None, :] + np.sin(lamp) * np.linspace(1, -1, h)[:, None]))[..., None]
    steps = np.linspace(0, 1, 12)
    for k in range(film.n):
        layer = film.layer(); pts = mouse(layer, x[k], y[k], lag(a, k, np.linspace(0, 9, 24)), way[k], way[k] / length * 2)
        shade, body = np.zeros((h, w), np.float32), layer.cov
        back = film.layer(); mid = pts[4:22]; back.tube(mid, length * .1, [0, 0, 0])
        for t in steps:  # higher parts fall farther, and softer
            part = cv2.GaussianBlur(body if t == 0 else back.cov, (0, 0), (.8 + 3 * t) * s)
            shade = np.maximum(shade, cv2.warpAffine(part, np.float32([[1, 0, t * length * np.cos(lamp)], [0, 1, t * length * np.sin(lamp)]]), (w, h)) * (1 - .25 * t))
        film.add(layer.over(darken(image.copy(), shade, dark)), layer, pts[0] - pts[18])


def two_tone(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    below = film.seed % 2 == 0
    image = arena(rng, h, w) if below or rng.uniform() < .5 else ground(rng, h, w, bedding, sand, wood)
    image = image / image.mean() * rng.uniform(150, 190)
    tone = image.mean((0, 1)) * rng.normal(1, .02, 3)
    if below:  # the frame of a glass floor
        image = image * .9 + 12; image[:, :int(.04 * w)] *= .35; image[:, -int(.04 * w):] *= .35
    length = w * rng.uniform(.2, .3)
    mouse = rodent(film, length, rng.uniform(28, 55) * np.array([.9, 1, 1.1]), tone, tone, rng.uniform() < .7, below)
    x, y, a, way = roam(film, 2.8, .24 * w, .11, step(drift(rng, film.n, 30), -1.3, -.6))
    for k in range(film.n):
        layer = film.layer(); pts = mouse(layer, x[k], y[k], lag(a, k, np.linspace(0, 9, 24)), way[k], way[k] / length * 2)
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 2 * s], [0, 1, 3 * s]]), (w, h))
        film.add(layer.over(darken(image.copy(), shade, .12 if below else .3, (6 if below else 3) * s)), layer, pts[0] - pts[18])


def insect(film, length, color, kind="ant"):
    """Returns draw(layer, x, y, angle, way): an ant or a beetle from above, its middle at x, y."""
    rng = film.rng
    tex = skin(rng, color, grain=.08, shine=.5 if kind == "ant" else .3, rough=.55)
    ant = [(.36, .1, .085), (.08, .12, .06), (-.12, .03, .03), (-.33, .17, .1)]
    beetle = [(.42, .06, .09), (.24, .08, .16), (-.17, .29, .2)]
    parts = ant if kind == "ant" else beetle

    def draw(layer, x, y, a, way, feel=0.0):
        turn = np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
        at = lambda u, v: np.array([u, v]) @ turn * length + (x, y)
        ph = TAU * way / (length * .7)
        for i, (root, out, ahead) in enumerate(((.14, .36, .26), (.06, .42, -.02), (-.02, .4, -.34))):
            for side in (-1, 1):
                swing = .1 * np.sin(ph + np.pi * ((i + (side > 0)) % 2))
                layer.tube([at(root, .05 * side), at(root + ahead * .45 + swing * .6, side * out * .62), at(root + ahead + swing, side * out)],
                           length * np.array([.02, .017, .01]), color * .75)
        for side in (-1, 1):
            layer.tube([at(.42, .03 * side), at(.53, .13 * side), at(.66, side * (.12 + .04 * np.sin(feel + side)))], length * .01, color * .8)
        for u, long, wide in parts[::-1]:
            v = np.linspace(-1, 1, 9)
            layer.tube([at(u - q * long * .9, 0) for q in v], length * wide * np.sqrt(1.02 - v * v * .9), tex)
        if kind != "ant":
            layer.tube([at(.08, 0), at(-.45, 0)], length * .006, color * .3, .9)
        return turn[0]
    return draw


def stop_and_go(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = (sand, wood, arena, weave, soil)[film.seed * 2 % 5](rng, h, w)
    image = image * max(1, 120 / image.mean())
    length, kind = rng.uniform(26, 44) * max(s, .75), ("ant", "beetle")[int(rng.integers(2))]
    ant = insect(film, length, rng.uniform(20, 50) * np.array([.8, .95, 1.2]), kind)
    pace, k = np.ones(film.n), int(rng.integers(25, 70))
    while k < film.n - 20:
        long = int(rng.integers(60, 121)); pace[k:k + long] = 0; k += long + int(rng.integers(25, 60))
    pace = np.clip(smooth(pace, 1.5) * 1.04 - .02, 0, 1)
    x, y, a, way = roam(film, 3.4, .1 * w, .16, pace, 0)
    for k in range(film.n):
        layer = film.layer(); d = ant(layer, x[k], y[k], a[k], way[k], way[k] * .3)
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 1.5 * s], [0, 1, 2 * s]]), (w, h))
        film.add(layer.over(darken(image.copy(), shade, .3, 1.5 * s)), layer, d)


def ripple(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = ground(rng, h, w, gravel, sand, gravel)
    length = w * rng.uniform(.16, .26)
    fish = top_fish(film, length)
    x, y, a, way = roam(film, 2.6, .16 * w, .08)
    gy, gx = np.mgrid[:h, :w].astype(np.float32)
    waves = [(TAU / (rng.uniform(70, 200) * s), rng.uniform(0, TAU), rng.uniform(.5, 1.3), rng.uniform(0, TAU)) for _ in range(5)]
    reach = rng.uniform(3, 4)
    for k in range(film.n):
        layer = film.layer(); pts = fish(layer, x[k], y[k], lag(a, k, np.linspace(0, 10, 30)), way[k] / length * 7, .8)
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 8 * s], [0, 1, 12 * s]]), (w, h))
        frame = layer.over(darken(image.copy(), shade, .3, 4 * s))
        dx, dy, bright = np.zeros((h, w), np.float32), np.zeros((h, w), np.float32), np.zeros((h, w), np.float32)
        for f, b, speed, p in waves:
            arg = f * (gx * np.float32(np.cos(b)) + gy * np.float32(np.sin(b))) - np.float32(TAU * speed * k / 30 - p)
            c = np.cos(arg); dx += c * np.float32(np.cos(b)); dy += c * np.float32(np.sin(b)); bright -= np.sin(arg)
        dx, dy = (reach / 2.6 * d for d in (dx, dy))
        warp = lambda p: cv2.remap(p, gx + dx, gy + dy, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        film.add(warp(frame) * (1 + .035 * bright)[..., None], warp(layer.cov), pts[0] - pts[20])


def shoal(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = ground(rng, h, w, gravel, sand, arena, sand)
    length = w * rng.uniform(.07, .1)
    color = apart(fish_color(rng, rng.uniform() < .6), image)
    sizes = length * np.append(rng.uniform(.78, 1.0, 13), 1.3)
    look = (rng.choice([0, .6, 1.35]), rng.choice([0, 7]), rng.choice([0, .4]))
    film_fish = [top_fish(film, l, color * rng.uniform(.93, 1.07), .1, look) for l in sizes]
    x, y, _, _ = roam(film, rng.uniform(1.6, 2.6), .24 * w, .05)
    spread = rng.uniform(.09, .13) * w
    swarm = []
    for l in sizes:
        px, py = x + spread * drift(rng, film.n, 65), y + .8 * spread * drift(rng, film.n, 65)
        px, py = (m / 2 + (m / 2 - length) * np.tanh((p - m / 2) / (m / 2 - length)) for p, m in ((px, w), (py, h)))
        vx, vy = smooth(np.gradient(px), 5), smooth(np.gradient(py), 5)
        swarm.append((px, py, smooth(np.unwrap(np.arctan2(vy, vx)), 3), np.hypot(vx, vy).cumsum()))
    order = rng.permutation(14)
    for k in range(film.n):
        frame, layers = image.copy(), {}
        for i in order:
            px, py, a, way = swarm[i]; layers[i] = film.layer()
            pts = film_fish[i](layers[i], px[k], py[k], lag(a, k, np.linspace(0, 8, 30)), way[k] / sizes[i] * 7, .9)
            ahead = pts[0] - pts[20] if i == 13 else ahead if i != order[0] else None
        shade = sum(cv2.warpAffine(l.cov, np.float32([[1, 0, 4 * s], [0, 1, 6 * s]]), (w, h)) for l in layers.values())
        frame = darken(frame, np.minimum(shade, 1), .25, 3 * s)
        hide = np.zeros((h, w), np.float32)
        for i in order:
            layers[i].over(frame)
            if list(order).index(i) > list(order).index(13):
                hide = np.maximum(hide, layers[i].a)
        others = []
        for i in range(13):
            c = layers[i].cov; area = float(c.sum())
            others.append([round(float(c.sum(0) @ np.arange(w)) / area, 2), round(float(c.sum(1) @ np.arange(h)) / area, 2)])
        film.add(frame, layers[13], ahead, hide, others=others)


def ribbons(film, x, width, n, top, color):
    """Returns a clump of water plants: broad ribbons from the floor up, drawn once."""
    rng, h, s = film.rng, film.h, film.s
    layer = film.layer()
    for _ in range(n):
        u = np.linspace(0, 1, 14); lean = rng.normal(0, .08) * h
        high = h * rng.uniform(top, top + .25)
        px = x + rng.uniform(-.5, .5) * width + lean * u ** 1.5 + 5 * s * np.sin(u * rng.uniform(4, 8) + rng.uniform(0, 6))
        tex = skin(rng, color * rng.uniform(.7, 1.25), grain=.12, shine=.1, rough=.3, bands=0)
        layer.tube(np.stack([px, h + 10 - (h - high) * u], 1), s * rng.uniform(4, 8) * np.interp(u, [0, .3, .85, 1], [.7, 1, .8, .15]), tex)
    return layer


def plants(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = tank(rng, h, w, floor=.88)
    length = w * rng.uniform(.16, .25)
    fish = side_fish(film, length, color=rng.choice([[40, 100, 210], [190, 180, 175], [60, 60, 70], [40, 160, 220]]))
    x, y, face, pitch, way = glide(film, rng.uniform(2, 3.4), (.4 * length, .2 * h, w - .4 * length, .78 * h))
    left, green = rng.uniform(.05, .6) * w, np.array([50, 120, 70]) * rng.uniform(.7, 1.2) + rng.normal(0, 12, 3)
    clumps = [(ribbons(film, left + .33 * w * (i + .5) / 6, .07 * w, int(rng.integers(3, 6)), rng.uniform(.1, .4), green * (.65 if i % 2 else 1)), i % 2,
               rng.uniform(.2, .5), rng.uniform(0, TAU), rng.uniform(6, 14) * s) for i in range(6)]
    gy, gx = np.mgrid[:h, :w].astype(np.float32)
    high = np.clip((h - gy) / h, 0, 1) ** 1.4

    def swayed(clump, k):
        layer, _, f, p, reach = clump
        cols = layer.a.any(0).nonzero()[0]; win = slice(None), slice(max(cols[0] - int(3 * reach), 0), cols[-1] + int(3 * reach) + 1)
        t, moved = k / 30 * TAU * f + p, film.layer()
        by = gx[win] + high[win] * np.float32(reach * (np.sin(t) + .35 * np.sin(2.3 * t))) + 2 * s * np.sin(gy[win] / (25 * s) - t * 1.5) * high[win]
        for name in ("rgb", "a"):
            getattr(moved, name)[win] = cv2.remap(getattr(layer, name), by, gy[win], cv2.INTER_LINEAR)
        return moved
    for k in range(film.n):
        frame, hide = image.copy(), np.zeros((h, w), np.float32)
        for clump in clumps:
            if clump[1]:
                swayed(clump, k).over(frame)
        layer = film.layer(); fish(layer, x[k], y[k], face[k], pitch[k], way[k] / length * 9); layer.over(frame)
        for clump in clumps:
            if not clump[1]:
                leaf = swayed(clump, k); leaf.over(frame); hide = np.maximum(hide, leaf.a)
        whole = layer.cov; area = max(float(whole.sum()), 1e-6)
        at = [round(float(whole.sum(0) @ np.arange(w)) / area, 2), round(float(whole.sum(1) @ np.arange(h)) / area, 2)]
        film.add(frame, layer, facing(face[k], pitch[k]), hide, whole_px=at, hidden=round(float((whole * hide).sum()) / area, 3))


def everyday(film, *whats):
    """Yields the scene, the animal's layer and its forward, of an ordinary animal that moves about."""
    rng, h, w, s = film.rng, film.h, film.w, film.s
    what = whats[film.seed % len(whats)]
    if what == "side_fish":
        image, length = tank(rng, h, w), w * rng.uniform(.17, .25)
        fish = side_fish(film, length)
        x, y, face, pitch, way = glide(film, rng.uniform(2, 3.4), (.5 * length, .2 * h, w - .5 * length, .76 * h))
        for k in range(film.n):
            layer = film.layer(); fish(layer, x[k], y[k], face[k], pitch[k], way[k] / length * 9)
            yield image.copy(), layer, facing(face[k], pitch[k])
        return
    if what == "mouse":
        image, length = ground(rng, h, w, bedding, arena, wood, weave, gravel), w * rng.uniform(.17, .23)
        tone = image.mean()
        color = (rng.uniform(35, 60) if tone > 105 else rng.uniform(175, 215)) * np.array([.88, .97, 1.03])
        body, rate = rodent(film, length, color, [140, 150, 195]), 1.0
        path = roam(film, 2.8, .24 * w, .11, step(drift(rng, film.n, 30), -1.4, -.6))
    else:
        image, length = ground(rng, h, w, gravel, sand, arena), w * rng.uniform(.17, .25)
        body, rate = top_fish(film, length, apart(fish_color(rng), image)), 7.0
        path = roam(film, 2.8, .2 * w, .08)
    x, y, a, way = path
    for k in range(film.n):
        layer = film.layer(); pts = body(layer, x[k], y[k], lag(a, k, np.linspace(0, 9, 30)), way[k] * (rate / length if rate > 1 else 1), .8)
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 3 * s], [0, 1, 5 * s]]), (w, h))
        yield darken(image.copy(), shade, .3, 3 * s), layer, pts[0] - pts[18]


def yard(rng, h, w, line):
    """A garden or a pen from a low view: something out of focus behind, ground before."""
    back = (rng.uniform(60, 120, 3) * [.75, 1.1, .85]) * (1 + .25 * cv2.GaussianBlur(fractal(rng, h, w, w / 7, 6, .7), (0, 0), w / 130))[..., None]
    flat = ground(rng, h, w, gravel, soil, sand, bedding)
    flat = cv2.resize(flat[:, int(.1 * w):int(.9 * w)], (w, int(h * .55)), interpolation=cv2.INTER_AREA)[:h - int(line)]
    image = np.concatenate([back[:int(line)], cv2.resize(flat, (w, h - int(line)))]).astype(np.float32)
    band = slice(max(int(line) - 6, 0), int(line) + 6)
    image[band] = cv2.GaussianBlur(image, (0, 0), 3)[band]
    for _ in range(160):  # tufts along the line and on the ground
        x, y, l = rng.uniform(0, w), line + abs(rng.normal(0, .12)) * h, rng.uniform(4, 16) * w / 640
        end = x + rng.normal(0, .4) * l, y - l
        cv2.line(image, (int(x * 8), int(y * 8)), (int(end[0] * 8), int(end[1] * 8)), (np.array([50, 115, 90]) * rng.uniform(.5, 1.2)).tolist(), 1, cv2.LINE_AA, 3)
    return image


def pecking(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image, L, f = yard(rng, h, w, h * rng.uniform(.35, .55)), w * rng.uniform(.17, .24), rng.choice([-1, 1])
    L = min(L, .33 * h)
    x0, y0 = w * (.5 - .12 * f) + rng.normal(0, .04) * w, h * rng.uniform(.58, .66)
    color = np.array([[95, 90, 90], [55, 90, 140], [190, 200, 205], [60, 60, 65], [50, 75, 100]][film.seed * 2 % 5]) * rng.uniform(.85, 1.15)
    plume = skin(rng, color, belly=mix(color, [170, 180, 190], rng.uniform(0, .6)), grain=.07, spots=rng.choice([0, .25]), shine=.1, cell=8)
    wing = skin(rng, color * rng.uniform(.5, .85), bands=rng.choice([4, 9]), grain=.09, shine=.1, cell=9)
    red, tex = np.array([50, 60, 190]), skin(rng, color * rng.uniform(.75, 1.1), grain=.06, shine=.15, cell=10)
    shank = mix([70, 95, 130], [60, 65, 140], rng.uniform())
    down, yaw, k = np.zeros(film.n), np.ones(film.n), int(rng.integers(10, 40))
    while k < film.n:
        for _ in range(int(rng.integers(1, 5))):
            m = int(rng.integers(7, 13)); down[k:k + m] = 1; k += m + int(rng.integers(5, 12))
        j = k + int(rng.integers(5, 30)); yaw[j:j + int(rng.integers(15, 50))] = rng.choice([-.5, .2, .55]); k += int(rng.integers(25, 80))
    low = smooth(down, 2.2); yaw = smooth(np.where(low > .1, 1, yaw), 2); bob = .01 * drift(rng, film.n, 6)
    comb = rng.uniform() < .5
    for k in range(film.n):
        layer, p, c = film.layer(), low[k], yaw[k]
        at = lambda u, v: np.array([x0 + f * u * L, y0 - v * L])
        for dx in (-.05, .1):  # legs
            foot = at(dx + .02, -.5)
            layer.tube([at(dx, -.18), at(dx - .03, -.34), foot], L * np.array([.045, .014, .011]), shank * .8)
            for toe in ((.11, -.015), (.08, -.035), (-.05, -.0)):
                layer.tube([foot, at(dx + .02 + toe[0], -.5 + toe[1])], L * .009, shank * .75)
        layer.poly([at(-.4, .08), at(-.82, .12 + bob[k]), at(-.85, .02 + bob[k]), at(-.42, -.1)], color * .55, rays=at(-.4, 0))
        u = np.linspace(0, 1, 16)
        body = np.stack([at(.42 - .9 * q, .03 + .1 * (1 - q) ** 2) for q in u])
        layer.tube(body, L * np.interp(u, [0, .15, .4, .7, 1], [.14, .23, .26, .2, .06]), plume, flip=-1 if f > 0 else 1, soft=1.5)
        chest = at(.36, .12)
        head = at(*((1 - p) * np.array([.46 + bob[k], .55]) + p * np.array([.78, -.34]) + .16 * np.sin(np.pi * p) * np.array([1, .6])))
        bow = (chest + head) / 2 + (1 - p) * L * .06 * np.array([-f, 0]) + p * L * np.array([.08 * f, -.06])
        t = np.linspace(0, 1, 8)[:, None]
        neck = chest * (1 - t) ** 2 + 2 * bow * t * (1 - t) + head * t * t
        layer.tube(neck, L * np.linspace(.15, .075, 8), tex, soft=1.5, flip=f)
        tilt = -.05 - 1.25 * p
        beak = np.array([f * c * np.cos(tilt), -np.sin(tilt)]); side = np.array([-beak[1], beak[0]])
        layer.poly([head + L * (.07 * beak + .035 * side), head + L * .2 * beak, head + L * (.07 * beak - .035 * side)], [60, 130, 170])
        if comb:
            layer.tube([head + L * np.array([.05 * f * c, -.085]), head + L * np.array([-.05 * f * c, -.1])], L * .03, red)
        layer.dot(*head, L * .095, tex.mean((0, 1)) * 1.02, soft=1.5)
        layer.dot(*(head + L * (.025 * beak + np.array([0, -.02]))), L * .017, [15, 15, 15])
        layer.tube([at(.26 - .62 * q, .1 - .1 * q) for q in np.linspace(0, 1, 9)], L * np.interp(np.linspace(0, 1, 9), [0, .3, .7, 1], [.07, .14, .1, .02]), wing, soft=1.4)
        shade = film.layer(); shade.tube([at(.45, -.53), at(-.7, -.53)], L * .05, [0] * 3)
        film.add(layer.over(darken(image.copy(), shade.a, .5, 5 * s)), layer, head - at(-.82, .07))


def tail_wagger(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    dog = film.seed % 3 != 2
    image = ground(rng, h, w, *((weave, wood) if dog else (gravel, sand, soil)))
    if dog:  # a rug
        rug, edge = weave(rng, h, w), film.layer()
        edge.poly([[w * .1, h * .12], [w * .88, h * .09], [w * .9, h * .9], [w * .12, h * .92]], [1, 1, 1]); image = mix(image, rug, edge.a[..., None])
    color = np.array([[45, 60, 80], [75, 115, 160], [40, 42, 45], [165, 185, 200]][rng.integers(4)] if dog else [60, 105, 100]) * rng.uniform(.8, 1.2)
    fur = skin(rng, color, patch=color * rng.uniform(.6, 1.35), grain=.1, shine=.06 if dog else .2, cell=9 if dog else 14, spots=0 if dog else .4, bands=0 if dog else 6)
    a0 = rng.uniform(0, TAU); d = np.array([np.cos(a0), np.sin(a0)])
    L = min(w * rng.uniform(.26, .34), .84 * min(w / abs(d[0]), h / abs(d[1])) / (1.9 if dog else 2.4))
    x0, y0 = np.array([w, h]) / 2 + d * L * (.12 if dog else .5) + rng.normal(0, .015, 2) * w
    busy = step(drift(rng, film.n, 18), -.6, .1)
    phase = np.cumsum(TAU * (rng.uniform(1.8, 3.2) if dog else .8) / 30 * (1 + .15 * drift(rng, film.n, 12)))
    looks = smooth(.5 * np.round(drift(rng, film.n, 45) * 1.1) / 1.5, 4)
    u, curve = np.linspace(0, 1, 22), rng.normal(0, .35)
    stays = [(q, o, rng.uniform(-.5, .9), rng.uniform(.8, 1.15)) for q, o in ((.1, 1), (.14, -1), (.85, 1), (.88, -1))]
    for k in range(film.n):
        layer = film.layer()
        pts = spine(x0 + .5 * L * np.cos(a0), y0 + .5 * L * np.sin(a0), a0 + curve * (u[1:] - .5), L)
        breath = 1 + .012 * np.sin(k / 30 * TAU * .35)
        half = L * np.interp(u, [0, .12, .3, .6, .88, 1], [.13, .19, .2, .16, .17, .07] if dog else [.05, .08, .1, .11, .07, .04]) * breath
        tail, d = aside(pts, .96, 0); n = np.array([-d[1], d[0]]); b = np.arctan2(d[1], d[0])
        v = np.linspace(0, 1, 14)
        swing = busy[k] * (.75 * np.sin(phase[k] - 1.2 * v) if dog else .9 * v * np.sin(phase[k] - 3 * v)) + .3 * v
        layer.tube(spine(*tail, b + swing, L * (.55 if dog else 1.1)), L * np.linspace(.045 if dog else .055, .02 if dog else .006, 15), fur, soft=2 if dog else 1)
        for q, side, ahead, long in stays:
            root, dd = aside(pts, q, side * half[int(q * 21)] * .7); nn = side * np.array([-dd[1], dd[0]])
            knee = root + L * long * (.16 * nn + .1 * ahead * dd) * (1 if dog else .8); foot = knee + L * long * (.04 * nn + .17 * (1 if q < .5 else .6) * dd) * (1 if dog else .6)
            layer.tube([root, knee, foot], L * np.array([.085, .06, .055] if dog else [.03, .024, .018]), color * .85, soft=1.8 if dog else 1)
        layer.tube(pts, half, fur, soft=2 if dog else 1)
        top = aside(pts, .02, 0)[0]; ha = a0 + curve * -.5 + looks[k]
        ahead = np.array([np.cos(ha), np.sin(ha)]); cross = np.array([-ahead[1], ahead[0]])
        hl = L * (.34 if dog else .2)
        skull = [top + ahead * hl * q for q in (-.1, .2, .45, .75, 1)]
        layer.tube(skull, hl * np.array([.34, .46, .42, .25, .17] if dog else [.3, .42, .42, .3, .15]), fur, soft=1.6)
        if dog:
            for side in (-1, 1):
                layer.tube([top + ahead * hl * .25 + cross * side * hl * .34, top + ahead * hl * .1 + cross * side * hl * .62], hl * np.array([.15, .17]), color * .6, soft=1.8)
            layer.dot(*skull[-1], hl * .08, [15, 15, 18])
        for side in (-1, 1):
            layer.dot(*(top + ahead * hl * .6 + cross * side * hl * (.2 if dog else .33)), hl * .045, [12, 12, 12])
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 4 * s], [0, 1, 6 * s]]), (w, h))
        film.add(layer.over(darken(image.copy(), shade, .4, 4 * s)), layer, skull[-1] - tail)


def hand_feeds(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    tone = np.array([[135, 160, 205], [95, 125, 175], [60, 85, 125]][rng.integers(3)]) * rng.uniform(.9, 1.1)
    flesh, size = skin(rng, tone, grain=.05, shine=.15, rough=.4, cell=40), h * rng.uniform(.2, .28)
    visits = [int(film.n * q + rng.integers(-8, 8)) for q in (.2, .5, .8)]
    edge, grains, last = rng.uniform(0, TAU), [], None
    crumb = np.array([60, 110, 150]) * rng.uniform(.6, 1.3)
    for k, (frame, layer, ahead) in enumerate(everyday(film, "mouse", "top_fish")):
        if layer.cov.sum() > 1:
            x = float(layer.cov.sum(0) @ np.arange(w) / layer.cov.sum()); y = float(layer.cov.sum(1) @ np.arange(h) / layer.cov.sum())
        heap = film.layer()
        for gx, gy, r, t, g in grains:
            if k >= t:
                heap.dot(gx, gy, r, crumb * g)
        heap.over(frame); layer.over(frame)
        hide = np.zeros((h, w), np.float32)
        for i, t0 in enumerate(visits):
            t = (k - t0) / 34
            if abs(t) >= 1:
                continue
            if last != i:  # where it reaches: at the animal, from a side of its own
                last, a = i, edge + i * rng.uniform(.3, 1.2)
            if t < -.1:
                aim = np.array([x, y])
            reach = step(1 - abs(t), 0, .75); d = np.array([np.cos(a), np.sin(a)]); n = np.array([-d[1], d[0]])
            tip = aim - d * (1 - reach) * 1.15 * w + n * 6 * s * np.sin(k / 4)
            if k == t0 - 14:
                grains += [(*(tip + rng.normal(0, .5, 2) * size), rng.uniform(1.2, 2.4) * s, k + int(rng.integers(4, 12)), rng.uniform(.7, 1.2)) for _ in range(12)]
            hand, wrist = film.layer(), tip - d * size * 1.25
            hand.tube([wrist - d * (w + size), wrist], size * np.array([.48, .3]), flesh, soft=1.5)
            hand.tube([wrist - d * size * .1, wrist + d * size * .3, wrist + d * size * .62], size * np.array([.3, .42, .4]), flesh, soft=1.5)
            for j, (o, long, inward) in enumerate(((-.3, .8, -.06), (-.1, .95, .0), (.11, .92, .04), (.3, .72, .1))):
                root = wrist + d * size * .55 + n * size * o
                mid = root + size * long * (.4 * d + .1 * inward * n); end = root + size * long * (.75 * d + inward * n * .8)
                hand.tube([root, mid, end], size * np.array([.125, .115, .09]), flesh, soft=1.3)
                hand.dot(*(end - d * size * .01), size * .05, tone * 1.13, .5, soft=2)
            hand.tube([wrist + d * size * .2 - n * size * .35, wrist + d * size * .55 - n * size * .55, wrist + d * size * .9 - n * size * .38], size * np.array([.15, .13, .1]), flesh, soft=1.3)
            shade = cv2.warpAffine(hand.a, np.float32([[1, 0, 12 * s], [0, 1, 16 * s]]), (w, h)) * (1 - hand.a)
            frame = hand.over(darken(frame, shade, .35, 9 * s)); hide = hand.a
        film.add(frame, layer, ahead, hide)


def bubbles(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    x0, wide, n = w * rng.uniform(.2, .8), rng.uniform(.025, .06) * w, int(rng.integers(60, 110))
    phase, speed = rng.uniform(0, 1, n), rng.uniform(.006, .013, n)
    size, off, wob, before = (1.6 + 4.5 * rng.uniform(0, 1, n) ** 2) * s, rng.normal(0, .6, n), rng.uniform(0, TAU, n), rng.uniform(0, 1, n) < .4
    for k, (frame, layer, ahead) in enumerate(everyday(film, "side_fish")):
        near, far = film.layer(), film.layer()
        for i in range(n):
            q = (phase[i] + speed[i] * k) % 1
            bx = x0 + wide * off[i] * (.3 + q) + 2.5 * s * np.sin(k / 4 + wob[i] + 9 * q)
            by, r = h * (.93 - .9 * q), size[i] * (.7 + .5 * q)
            to = near if before[i] else far
            to.dot(bx, by, r, [225, 224, 218], .75); to.dot(bx + r * .1, by + r * .1, r * .62, [105, 102, 92], .6); to.dot(bx - r * .35, by - r * .35, r * .3, [250] * 3, .9)
        layer.over(far.over(frame)); near.over(frame)
        film.add(frame, layer, ahead, near.a)


def clock(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    size = max(.42, .45 * s) * rng.uniform(1, 1.2); right, low = rng.uniform(0, 1, 2) < .5
    start, dot = rng.uniform(0, 86400), max(2.5, 3.5 * s)
    (wide, high), _ = cv2.getTextSize("00:00:00.00", cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    cx, cy = (w - wide - 4 * dot - 6 if right else 8), (h - 10 if low else 8 + high)
    boxed = rng.uniform() < .4
    for k, (frame, layer, ahead) in enumerate(everyday(film, "side_fish", "mouse", "top_fish")):
        now = start + k / 30
        text = f"{int(now // 3600) % 24:02d}:{int(now // 60) % 60:02d}:{int(now) % 60:02d}.{int(now * 100) % 100:02d}"

        def print_on(image):
            image = np.clip(image + .5, 0, 255).astype(np.uint8)
            if boxed:
                cv2.rectangle(image, (int(cx) - 4, int(cy - high - 4)), (int(cx + wide + 4 * dot), int(cy + 5)), (12, 12, 12), -1)
            else:
                for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1), (1, 1)):
                    cv2.putText(image, text, (int(cx) + dx, int(cy) + dy), cv2.FONT_HERSHEY_SIMPLEX, size, (10, 10, 10), 1, cv2.LINE_AA)
            cv2.putText(image, text, (int(cx), int(cy)), cv2.FONT_HERSHEY_SIMPLEX, size, (240, 240, 240), 1, cv2.LINE_AA)
            if k // 15 % 2 == 0:
                cv2.circle(image, (int(cx + wide + 2 * dot), int(cy - high / 2)), int(dot), (40, 40, 225), -1, cv2.LINE_AA)
            return image
        film.add(layer.over(frame), layer, ahead, after=print_on)


def camouflage(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    light = sand(rng, h, w); color = light.mean((0, 1))
    other = sand(rng, h, w, rng.uniform(45, 70) * np.array([1.1, 1, .9])) if rng.uniform() < .5 else np.clip(gravel(rng, h, w) * .4, 0, 255)
    gy, gx = np.mgrid[:h, :w]
    turn = rng.uniform(-.5, .5) + rng.choice([0, np.pi])
    edge = ((gx - w / 2) * np.cos(turn) + (gy - h / 2) * np.sin(turn)) + 12 * s * fractal(rng, h, w, 120, 5)
    image = mix(light, other, step(edge, -3 * s, 3 * s)[..., None])
    length, mouse = w * rng.uniform(.16, .23), film.seed % 2 == 0
    tone = color * rng.uniform(.9, 1.06) * rng.normal(1, .02, 3)
    body = rodent(film, length, tone, tone * 1.02) if mouse else top_fish(film, length, tone, .12, (rng.choice([0, .93]), 0, 0))
    x, y, a, way = roam(film, 3.2, .2 * w, .1)
    for k in range(film.n):
        layer = film.layer(); pts = body(layer, x[k], y[k], lag(a, k, np.linspace(0, 9, 30)), way[k] * (1 if mouse else 7 / length), .8)
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 1.5 * s], [0, 1, 2.5 * s]]), (w, h))
        film.add(layer.over(darken(image.copy(), shade, .15, 3 * s)), layer, pts[0] - pts[18])


def glossy_beetle(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = ground(rng, h, w, soil, sand, wood, weave, litter)
    image = image * max(1, 95 / image.mean())
    length = w * rng.uniform(.11, .17)
    shell = np.array([[28, 25, 22], [60, 45, 20], [25, 60, 30], [30, 30, 90]][rng.integers(4)]) * rng.uniform(.8, 1.2)
    beetle = insect(film, length, shell, "beetle")
    x, y, a, way = roam(film, 2.4, .14 * w, .14, step(drift(rng, film.n, 25), -1.5, -.7))
    lamp = rng.uniform(0, TAU)
    to, cross = np.array([np.cos(lamp), np.sin(lamp)]), np.array([-np.sin(lamp), np.cos(lamp)])
    for k in range(film.n):
        layer = film.layer(); d = beetle(layer, x[k], y[k], a[k], way[k], way[k] * .2)
        shine, back = film.layer(), np.array([x[k], y[k]]) - d * length * .15
        shine.tube([back + length * (.085 * to + v * .05 * cross) for v in (-1, 1)], length * .035, [250, 250, 248], soft=length * .03)
        shine.dot(*(np.array([x[k], y[k]]) + d * length * .24 + length * .06 * to), length * .03, [240] * 3, .9, soft=length * .025)
        shine.tube([back + length * (-.12 * to + v * .09 * cross) for v in (-1, 0, 1)], length * .02, [120, 110, 100], .45, soft=length * .04)
        shine.a *= layer.cov; shine.rgb *= layer.cov[..., None]
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, -5 * s * to[0]], [0, 1, -5 * s * to[1]]]), (w, h))
        film.add(shine.over(layer.over(darken(image.copy(), shade, .4, 2.5 * s))), layer, d)


def day_night(film):
    rng, n = film.rng, film.n
    low, mid = rng.uniform(.28, .38), rng.uniform(.42, .58)
    t = np.linspace(0, 1, n)
    night = np.where(t < mid, step(t, .05, mid), 1 - step(t, mid, .97))
    tint = np.array([[1.25, .98, .82], [.75, .97, 1.2]][int(rng.integers(2))])
    for k, (frame, layer, ahead) in enumerate(everyday(film, "mouse", "side_fish", "top_fish")):
        film.add(layer.over(frame) * (1.08 * ((1 - night[k]) + night[k] * low * tint)).astype(np.float32), layer, ahead)


def translucent(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = tank(rng, h, w) if film.seed % 2 else gravel(rng, h, w)
    clear, L = rng.uniform(.3, .5), w * rng.uniform(.17, .24)
    L = min(L, .32 * h)
    jelly = film.seed % 3 == 2
    tone = np.array([205, 205, 200]) * rng.uniform(.8, 1.1) + rng.normal(0, 8, 3)
    x, y, face, pitch, way = glide(film, 1.3 if jelly else 2.3, (.7 * L, .75 * L, w - .7 * L, h - .75 * L))
    lean, pulse = smooth(np.gradient(x), 10) * .35 / s, np.cumsum(.16 * (1 + .15 * drift(rng, film.n, 20)))
    shell = skin(rng, tone, bands=9, grain=.1, shine=.3, rough=.25)
    for k in range(film.n):
        layer = film.layer()
        if jelly:
            p, up = np.sin(pulse[k]), np.array([np.sin(lean[k]), -np.cos(lean[k])]); n = np.array([-up[1], up[0]])
            wide, c = L * (.36 + .06 * p), np.array([x[k], y[k]])
            for i in range(9):
                o = (i - 4) / 4; t = np.linspace(0, 1, 12)
                line = c + wide * o * n * .9 - up * (.02 * L + t[:, None] * L * (.75 - .15 * abs(o))) + n * (L * .06 * t * np.sin(7 * t - pulse[k] + i))[:, None]
                layer.tube(line, L * np.linspace(.008, .004, 12), tone, clear)
            dome = [c + wide * np.cos(q) * n + L * (.42 - .06 * p) * np.sin(q) * up * (1 if np.sin(q) > 0 else .25) for q in np.linspace(0, TAU, 40)]
            layer.poly(dome, tone, clear * .8)
            rim = [c + wide * q * n - L * .07 * up * np.sqrt(max(1 - q * q, 0)) for q in np.linspace(-1, 1, 15)]
            layer.tube(rim, L * .016, tone * 1.1, clear)
            for q in (-.5, -.17, .17, .5):
                layer.dot(*(c + wide * q * n + L * .14 * up), L * .045, [110, 90, 120], .55, soft=2)
            layer.tube([c + L * .1 * up, c - L * .3 * up], L * np.array([.05, .02]), tone * .8, clear)
            film.add(layer.over(image.copy()), layer, up)
            continue
        f = np.copysign(max(abs(face[k]), .25), face[k]); u = np.linspace(0, 1, 22)
        a = pitch[k] * .6 + 1.0 * step(u, .35, 1) - .12
        line = np.stack([np.cos(a), -np.sin(a)], 1).cumsum(0) * L / 22
        line = np.array([x[k], y[k]]) + (line.mean(0) - line) * [f, 1]
        for i in range(5):  # swimming legs
            root = line[9 + i * 2] + np.array([0, L * .04]); q = .5 * np.sin(way[k] * .25 / s + i)
            layer.tube([root, root + L * np.array([f * (.03 * q - .02), .09])], L * .012, tone, clear)
        for i in range(4):
            root = line[3 + i] + np.array([0, L * .05])
            layer.tube([root, root + L * np.array([f * (.05 - .03 * i), .09]), root + L * np.array([f * (.0 - .04 * i), .16])], L * .007, tone, clear)
        for q in (.5, .25, -.1):
            t = np.linspace(0, 1, 10)
            feel = line[0] + L * np.stack([f * (.65 * t - .25 * t * t * (1 + q)), -.5 * q * t + .3 * t * t * (.6 - q)], 1)
            layer.tube(feel, L * .004, tone, clear, own=False)
        layer.poly([line[-2], line[-1] + L * np.array([-f * .1, -.02]), line[-1] + L * np.array([-f * .12, .06]), line[-1] + L * np.array([-f * .02, .12])], tone, clear)
        layer.tube(line, L * np.interp(u, [0, .05, .2, .4, .7, 1], [.02, .055, .095, .085, .055, .025]), shell, clear, flip=-1 if f > 0 else 1)
        layer.tube(line[4:12] - [0, L * .02], L * np.interp(np.linspace(0, 1, 8), [0, .4, 1], [.03, .035, .008]), [40, 60, 70], .65, soft=2)
        layer.dot(*(line[1] + [0, -L * .035]), L * .025, [12, 12, 14])
        film.add(layer.over(image.copy()), layer, (line[0] - line[14]) * (abs(face[k]) > .3))


def group_of_two_sizes(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = ground(rng, h, w, gravel, sand, arena)
    length, color = w * rng.uniform(.2, .28), apart(fish_color(rng, rng.uniform() < .5), image)
    sizes = [length] + [length / 4 * rng.uniform(.9, 1.1) for _ in range(5)]
    fish = [top_fish(film, l, color * rng.uniform(.92, 1.08)) for l in sizes]
    paths = [roam(film, 2.6 if i == 0 else 1.8, .18 * w if i == 0 else .06 * w, .08 if i == 0 else .13) for i in range(6)]
    above = rng.uniform(0, 1, 6) < .5
    for k in range(film.n):
        layers = []
        for draw, l, (x, y, a, way) in zip(fish, sizes, paths):
            layers.append(film.layer()); pts = draw(layers[-1], x[k], y[k], lag(a, k, np.linspace(0, 9, 30)), way[k] / l * 7, .8)
            ahead = pts[0] - pts[20] if len(layers) == 1 else ahead
        shade = np.minimum(sum(cv2.warpAffine(l.cov, np.float32([[1, 0, 4 * s], [0, 1, 7 * s]]), (w, h)) for l in layers), 1)
        frame, hide = darken(image.copy(), shade, .28, 3 * s), np.zeros((h, w), np.float32)
        for i in [i for i in range(1, 6) if not above[i]] + [0] + [i for i in range(1, 6) if above[i]]:
            layers[i].over(frame)
            hide = np.maximum(hide, layers[i].a) if i and above[i] else hide
        others = [[round(float(l.cov.sum(j) @ np.arange(m) / max(l.cov.sum(), 1)), 2) for j, m in ((0, w), (1, h))] for l in layers[1:]]
        film.add(frame, layers[0], ahead, hide, others=others)


def wheel(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = tank(rng, h, w, bed=False, water=0) * .9
    floor = int(h * rng.uniform(.82, .88)); image[floor:] = bedding(rng, h, w)[floor:]
    for bx in range(int(rng.uniform(0, 30)), w, int(rng.uniform(26, 44) * s)):  # the bars of the cage
        cv2.line(image, (bx, 0), (bx, floor), (135, 138, 140), max(int(2 * s), 1), cv2.LINE_AA)
    R, cx = h * rng.uniform(.34, .39), w * rng.uniform(.4, .6); cy = floor - R - 6 * s
    f, color = rng.choice([-1, 1]), np.array([[150, 110, 60], [70, 150, 185], [120, 125, 130], [90, 80, 180], [95, 150, 90]][(film.seed + int(rng.integers(2))) % 5]) * rng.uniform(.85, 1.1)
    disc, spokes = film.layer(), int(rng.integers(5, 10))
    disc.dot(cx, cy, R, color * .8)
    disc.rgb *= (1 + .1 * fractal(rng, h, w, 40, 5))[..., None] * (1 - .3 * step(fractal(rng, h, w, 18, 2), 1.0, 1.2))[..., None]
    for i in range(spokes):
        a = TAU * i / spokes + .05
        disc.tube([[cx, cy], [cx + R * np.cos(a), cy + R * np.sin(a)]], 3.2 * s, color * .42)
        for q in (.45, .7):  # slots
            b = a + np.pi / spokes
            disc.tube([[cx + R * q * np.cos(b + t), cy + R * q * np.sin(b + t)] for t in (-.16, 0, .16)], 3.5 * s, color * .3)
    ring = film.layer()
    t = np.linspace(0, TAU, 61)
    ring.tube(np.stack([cx + R * np.cos(t), cy + R * np.sin(t)], 1), 4 * s, np.clip(color * 1.15, 0, 245))
    for i in range(36):  # rungs
        a = TAU * i / 36; ring.tube([[cx + R * q * np.cos(a), cy + R * q * np.sin(a)] for q in (.955, 1.015)], 1.6 * s, color * .45)
    stand = film.layer(); stand.tube([[cx, cy], [cx - .5 * R, floor + 14 * s]], 4 * s, [70, 72, 75]); stand.tube([[cx, cy], [cx + .5 * R, floor + 14 * s]], 4 * s, [70, 72, 75])
    stand.over(image)
    L = R * rng.uniform(.7, .85)
    coat = np.array([[70, 120, 175], [190, 200, 205], [85, 95, 105]][rng.integers(3)]) * rng.uniform(.85, 1.1)
    fur = skin(rng, coat, belly=mix(coat, [215, 220, 225], .7), patch=coat * 1.12, grain=.08, shine=.05, cell=9)
    fast = np.clip(.11 * (1 + .35 * drift(rng, film.n, 30)), .03, .2); turned = -f * np.cumsum(fast)
    sway = drift(rng, film.n, 25)
    for k in range(film.n):
        frame = image.copy(); c, sn = np.cos(turned[k]), np.sin(turned[k])
        m = [[c, -sn, cx - c * cx + sn * cy], [sn, c, cy - sn * cx - c * cy]]
        disc.warp(m).over(frame)
        phase, layer = np.cumsum(fast)[k] * R / L * 5, film.layer()
        x, y, lean = cx + f * (.08 + .03 * sway[k]) * R, cy + R * .93 - L * .36 + 1.5 * s * np.sin(2 * phase), .12 + .04 * sway[k]
        at = lambda u, v: np.array([x + f * L * (u * np.cos(lean) - v * np.sin(lean)), y - L * (u * np.sin(lean) + v * np.cos(lean))])
        for hip, o, g in ((-.3, 0, .7), (.25, np.pi, .7), (-.26, np.pi, 1), (.29, 0, 1)):
            q = np.sin(phase + o); lift = max(np.cos(phase + o), 0)
            foot = at(hip + .17 * q + .03, -.33 + .08 * lift + .06 * abs(hip + .17 * q))
            layer.tube([at(hip, -.12), at(hip + .08 * q - .04, -.22), foot], L * np.array([.09, .05, .03]), coat * g * .9, soft=1.5)
            layer.tube([foot, foot + f * L * np.array([.06, 0])], L * .025, [150, 160, 205] * np.array(g))
        u = np.linspace(0, 1, 18)
        layer.tube([at(.5 - q, .07 * np.sin(np.pi * q) - .02) for q in u], L * np.interp(u, [0, .1, .25, .5, .8, 1], [.06, .13, .17, .22, .2, .07]), fur, flip=-1 if f > 0 else 1, soft=1.9)
        layer.dot(*at(.27, .19), L * .06, mix(coat, [140, 140, 190], .5), soft=1.5); layer.dot(*at(.27, .19), L * .033, [110, 110, 150], soft=1.5)
        layer.dot(*at(.4, .07), L * .027, [8, 8, 8]); layer.dot(*at(.405, .08), L * .008, [230] * 3); layer.dot(*at(.545, -.03), L * .02, [120, 120, 180])
        rim = ring.warp(m)
        film.add(rim.over(layer.over(frame)), layer, at(.5, 0) - at(-.5, 0), rim.a)


def long_snake(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = ground(rng, h, w, sand, gravel, litter, soil)
    L, f = .8 * w, rng.choice([-1, 1])
    color = np.array([[45, 60, 75], [60, 120, 110], [60, 100, 160], [150, 170, 180]][rng.integers(4)]) * rng.uniform(.8, 1.15)
    color = apart(color, image, 30)
    tex = skin(rng, color, bands=rng.choice([0, 16, 28]), patch=color * .6 if rng.uniform() < .5 else None, grain=.14, shine=.3, cell=8)
    trail = np.arange(0, 2.6 * w, 1.0)
    a = rng.uniform(.55, .85) * np.sin(TAU * trail / (w * rng.uniform(.26, .36)) + .5 * drift(rng, len(trail), .2 * w)) + rng.normal(0, .06)
    px, py = np.cumsum(np.cos(a)), np.cumsum(np.sin(a))
    py = py - smooth(py, .18 * w) * .85; py = py - py.mean() + h * rng.uniform(.42, .58)
    made = np.concatenate([[0], np.hypot(np.diff(px), np.diff(py)).cumsum()])
    enter = np.interp(0, px - px[0], made); leave = np.interp(w, px - px[0], made)
    head = np.interp(np.cumsum(np.clip(1 + .35 * drift(rng, film.n, 25), .3, 2)), [0, film.n], [enter + .15 * L, leave + .75 * L])
    px -= px[0]; u = np.linspace(0, 1, 110)
    half = w * rng.uniform(.009, .012) * np.interp(u, [0, .012, .03, .05, .1, .5, .8, 1], [.5, .95, 1.05, .75, .9, 1, .7, .1])
    for k in range(film.n):
        layer = film.layer()
        pts = np.stack([np.interp(head[k] - L * u, made, c, left=np.nan) for c in (px, py)], 1)
        ok = np.isfinite(pts[:, 0]); pts = np.where(ok[:, None], pts, np.stack([head[k] - L * u, 0 * u + py[0]], 1))
        if f < 0:
            pts[:, 0] = w - 1 - pts[:, 0]
        layer.tube(pts, half, tex)
        for side in (-1, 1):
            layer.dot(*aside(pts, .018, side * half[2] * .7)[0], max(.8, w * .0018), [12, 12, 12])
        if k % 50 < 8:
            tip, d = aside(pts, 0, 0); layer.tube([tip, tip + d * .022 * w], .7 * s, [40, 40, 120])
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 2 * s], [0, 1, 3 * s]]), (w, h))
        seen = pts[(pts[:, 0] > 0) & (pts[:, 0] < w - 1)]
        film.add(layer.over(darken(image.copy(), shade, .4, 2 * s)), layer, seen[0] - seen[-1] if len(seen) > 1 else (0, 0))


KINDS = {f.__name__: f for f in (station, slow_crawler, head_fixed, resting_mirror, side_mirror, cast_shadow, lamp_shadow, two_tone, stop_and_go, ripple,
                                 shoal, pecking, tail_wagger, plants, hand_feeds, bubbles, clock, camouflage, glossy_beetle, day_night, translucent,
                                 group_of_two_sizes, wheel, long_snake)}
FLAGS = {"shoal": ["--follow", "largest"]}


def films(folder, seeds=(1, 2, 3), kinds=None):
    """Makes the missing films. Returns (name, path, path of the truth, flags of analyze, kind) for each."""
    folder, rows = pathlib.Path(folder), []
    folder.mkdir(parents=True, exist_ok=True)
    for kind in kinds or KINDS:
        for seed in seeds:
            stem = folder / f"{kind}-{seed}"
            made = [pathlib.Path(f"{stem}{end}") for end in (".mp4", ".truth.json", ".masks.npz")]
            if not all(p.exists() for p in made):
                film = Film(folder, kind, seed)
                KINDS[kind](film)
                film.close()
            rows.append((stem.name, made[0], made[1], FLAGS.get(kind, []), kind))
    return rows


if __name__ == "__main__":
    for row in films(sys.argv[1], kinds=sys.argv[2:] or None):
        print(*row[:2], flush=True)
