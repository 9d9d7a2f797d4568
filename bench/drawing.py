"""Draws films with exact truth: places, layers with soft edges, and a camera with blur and noise (kinds.py)."""
import zlib

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


# Places. Each function returns a float picture (BGR) of the film's size.

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


def yard(rng, h, w, line):
    """A garden or a pen from a low view: something out of focus behind, ground before."""
    tone = rng.uniform(60, 120, 3) * [.75, 1.1, .85]
    back = tone * (1 + .25 * cv2.GaussianBlur(fractal(rng, h, w, w / 7, 6, .7), (0, 0), w / 130))[..., None]
    flat = ground(rng, h, w, gravel, soil, sand, bedding)
    flat = cv2.resize(flat[:, int(.1 * w):int(.9 * w)], (w, int(h * .55)), interpolation=cv2.INTER_AREA)[:h - int(line)]
    image = np.concatenate([back[:int(line)], cv2.resize(flat, (w, h - int(line)))]).astype(np.float32)
    band = slice(max(int(line) - 6, 0), int(line) + 6)
    image[band] = cv2.GaussianBlur(image, (0, 0), 3)[band]
    for _ in range(160):  # tufts along the line and on the ground
        x, y, l = rng.uniform(0, w), line + abs(rng.normal(0, .12)) * h, rng.uniform(4, 16) * w / 640
        end = x + rng.normal(0, .4) * l, y - l
        ends = [tuple(int(v * 8) for v in point) for point in ((x, y), end)]
        cv2.line(image, *ends, (np.array([50, 115, 90]) * rng.uniform(.5, 1.2)).tolist(), 1, cv2.LINE_AA, 3)
    return image


# Bodies, and what is drawn with them.

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
            across = np.clip(.5 + .5 * v * np.float32(flip), 0, 1) * (color.shape[0] - 1)
            color = cv2.remap(color, u * (color.shape[1] - 1), across, cv2.INTER_LINEAR)
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
        color = np.asarray(color, np.float32) * light[..., None]
        self.put((slice(lo[1], hi[1]), slice(lo[0], hi[0])), mask / np.float32(255), color, opacity, own)

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
    """What a kind draws with: its random numbers, the size and the number of frames, and the camera."""

    def __init__(self, kind, seed):
        self.seed, self.rng = seed, np.random.default_rng([zlib.crc32(kind.encode()), seed])
        rng = self.rng
        self.w, self.h = SIZES[rng.integers(len(SIZES))]
        self.n, self.s = int(rng.integers(240, 451)), self.w / 640
        self.blur, self.noise = rng.uniform(.5, .95) * max(self.s, .7), rng.uniform(.9, 2.6)
        y, x = np.mgrid[-1:1:self.h * 1j, -1:1:self.w * 1j]
        slope = rng.normal(0, .05, 2)
        dark = rng.uniform(.04, .2) * (x * x + y * y) / 2
        self.lens = ((1 - dark + slope[0] * x + slope[1] * y)[..., None] * rng.normal(1, .03, 3)).astype(np.float32)

    def layer(self):
        return Layer(self.h, self.w)

    def lit(self, image, layer, x, y, dark, soft):
        """Returns the picture with the animal and its shadow, which falls x, y aside; lengths in 1/640 of the width."""
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, x * self.s], [0, 1, y * self.s]]), (self.w, self.h))
        return layer.over(darken(image.copy(), shade, dark, soft * self.s))

    def frame(self, image, animal, forward, hide=None, after=None, **more):
        """Returns what the camera takes, and the pose with the mask.

        The animal is its layer or how much of each pixel it covers. `hide` covers it, `after` prints on the picture.
        """
        image = cv2.GaussianBlur(np.asarray(image, np.float32) * self.lens, (0, 0), self.blur)
        grain = self.rng.standard_normal((self.h, self.w, 4), np.float32)
        grain = cv2.GaussianBlur(.8 * grain[..., :3] + .6 * grain[..., 3:], (3, 3), .45) * 1.3
        image = np.clip(image + grain * (self.noise * np.sqrt(.3 + np.clip(image, 0, 255) / 180)), 0, 255)
        image = image if after is None else after(image)
        cover = animal.cov if isinstance(animal, Layer) else animal
        cover = cover if hide is None else cover * (1 - hide)
        mask, pose = cover >= .5, {"centroid_px": None, "forward": [0, 0, 0], "absent": True, **more}
        if mask.sum() >= 12:
            long = np.hypot(*forward[:2])
            ahead = [*(round(float(v / long), 5) for v in forward[:2]), 0] if long > 1e-6 else [0, 0, 0]
            pose |= {"centroid_px": center_of(cover), "forward": ahead, "box_px": cv2.boundingRect(mask.astype(np.uint8)),
                     "area_px": float(cover.sum()), "absent": False, "mask": mask}
        return np.round(image), pose


def center_of(cover):
    """Returns the centroid of a picture of weights, x and y."""
    area = max(float(cover.sum()), 1e-6)
    return [round(float(cover.sum(1 - axis) @ np.arange(cover.shape[axis])) / area, 3) for axis in (1, 0)]


def turned(is_left, image, cover, forward):
    """Returns picture, animal and direction, with left and right exchanged if `is_left`."""
    return (image[:, ::-1], cover[:, ::-1], (-forward[0], forward[1])) if is_left else (image, cover, forward)
