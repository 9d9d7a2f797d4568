"""Films of kinds of animals and situations, drawn, with exact truth (cases.py makes the files).

Each kind draws one animal as textured, shaded bodies with soft edges on a textured place, seen through a slightly
blurred, noisy camera. Everything (place, colors, sizes, timing) follows from the kind and the seed. A kind yields
(picture, pose) for every frame.
"""
import cv2
import numpy as np

from animals import (apart, aside, draw_jelly, facing, fish_color, glide, insect, lag, ribbons, roam, rodent, runner, shrimp_of,
                     side_fish, spine, top_fish)
from drawing import (TAU, arena, bedding, center_of, darken, drift, fractal, gravel, ground, litter, mix, sand, skin, smooth, soil, step,
                     tank, turned, weave, wood, yard)


def station(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    left, length = rng.uniform() < .5, w * rng.uniform(.26, .42)
    image = arena(rng, h, w) * rng.uniform(.6, 1)
    x, y = np.mgrid[:w, :h].transpose(0, 2, 1)
    along = x if film.seed % 2 else y
    p = rng.uniform(22, 50) * s
    stripes = rng.uniform(.25, .55) * (.5 + .5 * np.clip(3 * np.sin(TAU * along / p), -1, 1))
    image *= 1 - (stripes * (1 + .15 * fractal(rng, h, w, 30, 4)))[..., None]
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
        layer = film.layer()
        pts = fish(layer, x0 + dx[k], y0 + dy[k], np.pi + turn[k] + np.zeros(30), phase[k], 1.0)
        frame = film.lit(image, layer, 7, 10, .22, 5)
        for q, r, v, c in motes:  # what the current carries along
            mx, my = (q + k * (.012 + .008 * v)) % 1.2 * w - .1 * w, wall + r * (h - 2 * wall)
            drop = film.layer(); drop.tube([[mx, my], [mx + 5 * s, my]], .6 * s, [200 * c + 30] * 3, .35); drop.over(frame)
        yield film.frame(*turned(not left, frame, layer.cov, pts[0] - pts[20]))


def slow_crawler(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    what = ("slug", "worm", "caterpillar")[film.seed % 3]
    agar = what == "worm" or rng.uniform() < .3
    length = w * (rng.uniform(.2, .32) if what != "worm" else rng.uniform(.16, .26))
    if agar:
        image = (rng.uniform(140, 190) + rng.normal(0, 6, 3)) * (1 + .035 * fractal(rng, h, w, w / 2, 7, .55)[..., None])
        tone = lambda by: (image.mean((0, 1)) * by).tolist()
        middle = int(w * rng.uniform(.4, .6)), int(h * rng.uniform(.4, .6))
        cv2.circle(image, middle, int(.52 * w), tone(.6), int(5 * s), cv2.LINE_AA)
        for _ in range(120):
            at, r = (int(rng.integers(w)), int(rng.integers(h))), int(rng.integers(1, 3))
            cv2.circle(image, at, r, tone(rng.uniform(.5, 1.15)), -1, cv2.LINE_AA)
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
    if what == "worm":
        bend = .75 * np.sin(TAU * trail / length / rng.uniform(.55, .8))
    else:
        bend = rng.uniform(.3, .6) * drift(rng, len(trail), length * .3)
    way = np.cumsum(np.stack([np.cos(a0 + bend), np.sin(a0 + bend)], 1), 0)
    way += (w / 2, h / 2) - way[int(1.55 * length)]
    u = np.linspace(0, 1, 34)
    wide = length * thick * np.interp(u, [0, .05, .15, .5, .8, 1], [.45, .75, .9, 1, .8, .6 if what == "caterpillar" else .12])
    for k in range(film.n):
        layer, head = film.layer(), 1.2 * length + made[k]
        squeeze = np.sin(TAU * (2 * u - k / 30 * .7))
        where = head - length * (u + (.018 * squeeze if what != "worm" else 0))
        pts = np.stack([np.interp(where, trail, c) for c in way.T], 1)
        half = wide * (1 - .1 * squeeze * (what != "worm"))
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
        yield film.frame(film.lit(image, layer, 3, 4, .4, 2.5), layer, pts[0] - pts[-1])


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
    gel.tube(cut, 3.2 * s, [light * .6] * 3, .6, soft=3)
    gel.tube(np.array(cut) - d * 4 * s, 1.5 * s, [min(light * 1.35, 250)] * 3, .6, soft=3)
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
        skull = length * .075 * np.interp(u[:13], [0, .03, .1, .17, .26, .36], [.4, .75, .98, .85, .75, .4])
        layer.tube(pts[:13], skull, tex, .92, soft=1.5)
        for side in (-1, 1):
            layer.tube([aside(pts, .065, side * length * .058)[0], aside(pts, .115, side * length * .062)[0]], length * .026, [18, 18, 20])
            (root, fd), flap = aside(pts, .2, side * length * .05), .03 * np.sin(phase[k] * .7) * abs(beat[k])
            fn = side * np.array([-fd[1], fd[0]])
            fin = [root + length * (-back * fd + out * fn) for back, out in ((0, 0), (.02, .05 + flap), (.08, .045 + flap), (.06, 0))]
            layer.poly(fin, [light * .8] * 3, .4)
        layer.tube(pts[8:11], length * .03, [light * .25] * 3, .6, soft=2)  # the swim bladder
        yield film.frame(layer.over(image.copy()), layer, d)


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
    x = smooth(np.where(t < rest, x1 + .8 * s * drift(rng, film.n, 50), lag(gx, moved, 0)), 2)
    y = smooth(np.where(t < rest, y1 + .6 * s * np.sin(t / 31), lag(gy, moved, 0)), 2)
    face = np.where(t < rest, gf[0], lag(gf, moved, 0)); pitch = smooth(np.where(t < rest, -.03, lag(gp, moved, 0)), 3)
    phase = np.cumsum(np.where(t < rest, .1, .5) * (1 + .2 * drift(rng, film.n, 20)))
    dim, side = rng.uniform(.35, .55), rng.uniform(.25, .4)
    soft = cv2.GaussianBlur(fractal(rng, h, w, 30, 3) * .12 + 1, (0, 0), 2)
    for k in range(film.n):
        layer = film.layer(); fish(layer, x[k], y[k], face[k], pitch[k], phase[k], .25 if k < rest else 1)
        frame = image.copy()
        low = layer.warp([[1, 0, 0], [0, -1, 2 * floor]])
        low.rgb, low.a = (cv2.GaussianBlur(picture, (0, 0), 1.0 * s) for picture in (low.rgb, low.a))
        low.over(frame, (dim * soft * below).astype(np.float32))
        layer.warp([[-1, 0, 2 * wall], [0, 1, 0]]).over(frame, (side * soft * (beyond & ~below)).astype(np.float32))
        yield film.frame(*turned(right, layer.over(frame), layer.cov, facing(face[k], pitch[k])))


def side_mirror(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    slant, right = np.radians(rng.uniform(10, 40)) * rng.choice([-1, 1]), rng.uniform() < .5
    px, py = w * rng.uniform(.28, .38), h * .5
    nx, ny = np.cos(slant), np.sin(slant)  # into the tank
    gy, gx = np.mgrid[:h, :w].astype(np.float32)
    depth = ((gx - px) * nx + (gy - py) * ny).astype(np.float32)
    image = tank(rng, h, w, floor=.88)
    behind = gx - 2 * depth * np.float32(nx), gy - 2 * depth * np.float32(ny)
    copy = cv2.remap(image, *behind, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
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
        yield film.frame(*turned(right, layer.over(frame), layer.cov, facing(face[k], pitch[k])))


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
        yield film.frame(layer.over(darken(image.copy(), shade, dark)), layer, facing(face[k], pitch[k]))


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
            m = np.float32([[1, 0, t * length * np.cos(lamp)], [0, 1, t * length * np.sin(lamp)]])
            shade = np.maximum(shade, cv2.warpAffine(part, m, (w, h)) * (1 - .25 * t))
        yield film.frame(layer.over(darken(image.copy(), shade, dark)), layer, pts[0] - pts[18])


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
        yield film.frame(film.lit(image, layer, 2, 3, .12 if below else .3, (6 if below else 3)), layer, pts[0] - pts[18])


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
        yield film.frame(film.lit(image, layer, 1.5, 2, .3, 1.5), layer, d)


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
        frame = film.lit(image, layer, 8, 12, .3, 4)
        dx, dy, bright = np.zeros((h, w), np.float32), np.zeros((h, w), np.float32), np.zeros((h, w), np.float32)
        for f, b, speed, p in waves:
            arg = f * (gx * np.float32(np.cos(b)) + gy * np.float32(np.sin(b))) - np.float32(TAU * speed * k / 30 - p)
            c = np.cos(arg); dx += c * np.float32(np.cos(b)); dy += c * np.float32(np.sin(b)); bright -= np.sin(arg)
        dx, dy = (reach / 2.6 * d for d in (dx, dy))
        warp = lambda p: cv2.remap(p, gx + dx, gy + dy, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        yield film.frame(warp(frame) * (1 + .035 * bright)[..., None], warp(layer.cov), pts[0] - pts[20])


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
        yield film.frame(frame, layers[13], ahead, hide, others=[center_of(layers[i].cov) for i in range(13)])


def plants(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = tank(rng, h, w, floor=.88)
    length = w * rng.uniform(.16, .25)
    fish = side_fish(film, length, color=rng.choice([[40, 100, 210], [190, 180, 175], [60, 60, 70], [40, 160, 220]]))
    x, y, face, pitch, way = glide(film, rng.uniform(2, 3.4), (.4 * length, .2 * h, w - .4 * length, .78 * h))
    left, green = rng.uniform(.05, .6) * w, np.array([50, 120, 70]) * rng.uniform(.7, 1.2) + rng.normal(0, 12, 3)
    clumps = []
    for i in range(6):
        n, top = int(rng.integers(3, 6)), rng.uniform(.1, .4)
        leaves = ribbons(film, left + .33 * w * (i + .5) / 6, .07 * w, n, top, green * (1, .65)[i % 2])
        clumps.append((leaves, i % 2, rng.uniform(.2, .5), rng.uniform(0, TAU), rng.uniform(6, 14) * s))
    gy, gx = np.mgrid[:h, :w].astype(np.float32)
    high = np.clip((h - gy) / h, 0, 1) ** 1.4

    def swayed(clump, k):
        layer, _, f, p, reach = clump
        cols = layer.a.any(0).nonzero()[0]; win = slice(None), slice(max(cols[0] - int(3 * reach), 0), cols[-1] + int(3 * reach) + 1)
        t, moved = k / 30 * TAU * f + p, film.layer()
        by = gx[win] + high[win] * np.float32(reach * (np.sin(t) + .35 * np.sin(2.3 * t)))
        by = by + 2 * s * np.sin(gy[win] / (25 * s) - t * 1.5) * high[win]
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
        hidden = float((layer.cov * hide).sum()) / max(float(layer.cov.sum()), 1e-6)
        yield film.frame(frame, layer, facing(face[k], pitch[k]), hide, whole_px=center_of(layer.cov), hidden=round(hidden, 3))


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
        layer = film.layer()
        pts = body(layer, x[k], y[k], lag(a, k, np.linspace(0, 9, 30)), way[k] * (rate / length if rate > 1 else 1), .8)
        shade = cv2.warpAffine(layer.cov, np.float32([[1, 0, 3 * s], [0, 1, 5 * s]]), (w, h))
        yield darken(image.copy(), shade, .3, 3 * s), layer, pts[0] - pts[18]


def pecking(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image, L, f = yard(rng, h, w, h * rng.uniform(.35, .55)), w * rng.uniform(.17, .24), rng.choice([-1, 1])
    L = min(L, .33 * h)
    x0, y0 = w * (.5 - .12 * f) + rng.normal(0, .04) * w, h * rng.uniform(.58, .66)
    colors = [95, 90, 90], [55, 90, 140], [190, 200, 205], [60, 60, 65], [50, 75, 100]
    color = np.array(colors[film.seed * 2 % 5]) * rng.uniform(.85, 1.15)
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
        q = np.linspace(0, 1, 9)
        layer.tube([at(.26 - .62 * v, .1 - .1 * v) for v in q], L * np.interp(q, [0, .3, .7, 1], [.07, .14, .1, .02]), wing, soft=1.4)
        shade = film.layer(); shade.tube([at(.45, -.53), at(-.7, -.53)], L * .05, [0] * 3)
        yield film.frame(layer.over(darken(image.copy(), shade.a, .5, 5 * s)), layer, head - at(-.82, .07))


def tail_wagger(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    dog = film.seed % 3 != 2
    image = ground(rng, h, w, *((weave, wood) if dog else (gravel, sand, soil)))
    if dog:  # a rug
        rug, edge = weave(rng, h, w), film.layer()
        edge.poly([[w * .1, h * .12], [w * .88, h * .09], [w * .9, h * .9], [w * .12, h * .92]], [1, 1, 1])
        image = mix(image, rug, edge.a[..., None])
    coats = [45, 60, 80], [75, 115, 160], [40, 42, 45], [165, 185, 200]
    color = np.array(coats[rng.integers(4)] if dog else [60, 105, 100]) * rng.uniform(.8, 1.2)
    look = {"shine": .06, "cell": 9} if dog else {"shine": .2, "cell": 14, "spots": .4, "bands": 6}
    fur = skin(rng, color, patch=color * rng.uniform(.6, 1.35), grain=.1, **look)
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
        long, thick = (.55, np.linspace(.045, .02, 15)) if dog else (1.1, np.linspace(.055, .006, 15))
        layer.tube(spine(*tail, b + swing, L * long), L * thick, fur, soft=2 if dog else 1)
        for q, side, ahead, long in stays:
            root, dd = aside(pts, q, side * half[int(q * 21)] * .7); nn = side * np.array([-dd[1], dd[0]])
            knee = root + L * long * (.16 * nn + .1 * ahead * dd) * (1 if dog else .8)
            foot = knee + L * long * (.04 * nn + .17 * (1 if q < .5 else .6) * dd) * (1 if dog else .6)
            thick = L * np.array([.085, .06, .055] if dog else [.03, .024, .018])
            layer.tube([root, knee, foot], thick, color * .85, soft=1.8 if dog else 1)
        layer.tube(pts, half, fur, soft=2 if dog else 1)
        top = aside(pts, .02, 0)[0]; ha = a0 + curve * -.5 + looks[k]
        ahead = np.array([np.cos(ha), np.sin(ha)]); cross = np.array([-ahead[1], ahead[0]])
        hl = L * (.34 if dog else .2)
        skull = [top + ahead * hl * q for q in (-.1, .2, .45, .75, 1)]
        layer.tube(skull, hl * np.array([.34, .46, .42, .25, .17] if dog else [.3, .42, .42, .3, .15]), fur, soft=1.6)
        if dog:
            for side in (-1, 1):
                ear = [top + hl * (a * ahead + side * out * cross) for a, out in ((.25, .34), (.1, .62))]
                layer.tube(ear, hl * np.array([.15, .17]), color * .6, soft=1.8)
            layer.dot(*skull[-1], hl * .08, [15, 15, 18])
        for side in (-1, 1):
            layer.dot(*(top + ahead * hl * .6 + cross * side * hl * (.2 if dog else .33)), hl * .045, [12, 12, 12])
        yield film.frame(film.lit(image, layer, 4, 6, .4, 4), layer, skull[-1] - tail)


def hand_feeds(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    tone = np.array([[135, 160, 205], [95, 125, 175], [60, 85, 125]][rng.integers(3)]) * rng.uniform(.9, 1.1)
    flesh, size = skin(rng, tone, grain=.05, shine=.15, rough=.4, cell=40), h * rng.uniform(.2, .28)
    visits = [int(film.n * q + rng.integers(-8, 8)) for q in (.2, .5, .8)]
    edge, grains, last = rng.uniform(0, TAU), [], None
    crumb = np.array([60, 110, 150]) * rng.uniform(.6, 1.3)
    for k, (frame, layer, ahead) in enumerate(everyday(film, "mouse", "top_fish")):
        if layer.cov.sum() > 1:
            x, y = center_of(layer.cov)
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
                grains += [(*(tip + rng.normal(0, .5, 2) * size), rng.uniform(1.2, 2.4) * s, k + int(rng.integers(4, 12)),
                            rng.uniform(.7, 1.2)) for _ in range(12)]
            hand, wrist = film.layer(), tip - d * size * 1.25
            hand.tube([wrist - d * (w + size), wrist], size * np.array([.48, .3]), flesh, soft=1.5)
            palm = [wrist + d * size * q for q in (-.1, .3, .62)]
            hand.tube(palm, size * np.array([.3, .42, .4]), flesh, soft=1.5)
            for j, (o, long, inward) in enumerate(((-.3, .8, -.06), (-.1, .95, .0), (.11, .92, .04), (.3, .72, .1))):
                root = wrist + d * size * .55 + n * size * o
                mid = root + size * long * (.4 * d + .1 * inward * n); end = root + size * long * (.75 * d + inward * n * .8)
                hand.tube([root, mid, end], size * np.array([.125, .115, .09]), flesh, soft=1.3)
                hand.dot(*(end - d * size * .01), size * .05, tone * 1.13, .5, soft=2)
            thumb = [wrist + size * (q * d - out * n) for q, out in ((.2, .35), (.55, .55), (.9, .38))]
            hand.tube(thumb, size * np.array([.15, .13, .1]), flesh, soft=1.3)
            shade = cv2.warpAffine(hand.a, np.float32([[1, 0, 12 * s], [0, 1, 16 * s]]), (w, h)) * (1 - hand.a)
            frame = hand.over(darken(frame, shade, .35, 9 * s)); hide = hand.a
        yield film.frame(frame, layer, ahead, hide)


def bubbles(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    x0, wide, n = w * rng.uniform(.2, .8), rng.uniform(.025, .06) * w, int(rng.integers(60, 110))
    phase, speed = rng.uniform(0, 1, n), rng.uniform(.006, .013, n)
    size, off = (1.6 + 4.5 * rng.uniform(0, 1, n) ** 2) * s, rng.normal(0, .6, n)
    wob, before = rng.uniform(0, TAU, n), rng.uniform(0, 1, n) < .4
    for k, (frame, layer, ahead) in enumerate(everyday(film, "side_fish")):
        near, far = film.layer(), film.layer()
        for i in range(n):
            q = (phase[i] + speed[i] * k) % 1
            bx = x0 + wide * off[i] * (.3 + q) + 2.5 * s * np.sin(k / 4 + wob[i] + 9 * q)
            by, r = h * (.93 - .9 * q), size[i] * (.7 + .5 * q)
            to = near if before[i] else far
            for aside_r, size_r, color, opacity in ((0, 1, [225, 224, 218], .75), (.1, .62, [105, 102, 92], .6), (-.35, .3, [250] * 3, .9)):
                to.dot(bx + r * aside_r, by + r * aside_r, r * size_r, color, opacity)
        layer.over(far.over(frame)); near.over(frame)
        yield film.frame(frame, layer, ahead, near.a)


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
        yield film.frame(layer.over(frame), layer, ahead, after=print_on)


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
        yield film.frame(film.lit(image, layer, 1.5, 2.5, .15, 3), layer, pts[0] - pts[18])


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
        dull = [back + length * (-.12 * to + v * .09 * cross) for v in (-1, 0, 1)]
        shine.tube(dull, length * .02, [120, 110, 100], .45, soft=length * .04)
        shine.a *= layer.cov; shine.rgb *= layer.cov[..., None]
        yield film.frame(shine.over(film.lit(image, layer, -5 * to[0], -5 * to[1], .4, 2.5)), layer, d)


def day_night(film):
    rng, n = film.rng, film.n
    low, mid = rng.uniform(.28, .38), rng.uniform(.42, .58)
    t = np.linspace(0, 1, n)
    night = np.where(t < mid, step(t, .05, mid), 1 - step(t, mid, .97))
    tint = np.array([[1.25, .98, .82], [.75, .97, 1.2]][int(rng.integers(2))])
    for k, (frame, layer, ahead) in enumerate(everyday(film, "mouse", "side_fish", "top_fish")):
        yield film.frame(layer.over(frame) * (1.08 * ((1 - night[k]) + night[k] * low * tint)).astype(np.float32), layer, ahead)


def translucent(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = tank(rng, h, w) if film.seed % 2 else gravel(rng, h, w)
    clear, L = rng.uniform(.3, .5), w * rng.uniform(.17, .24)
    L = min(L, .32 * h)
    is_jelly = film.seed % 3 == 2
    tone = np.array([205, 205, 200]) * rng.uniform(.8, 1.1) + rng.normal(0, 8, 3)
    x, y, face, pitch, way = glide(film, 1.3 if is_jelly else 2.3, (.7 * L, .75 * L, w - .7 * L, h - .75 * L))
    lean, pulse = smooth(np.gradient(x), 10) * .35 / s, np.cumsum(.16 * (1 + .15 * drift(rng, film.n, 20)))
    shrimp = shrimp_of(film, L, tone, clear)
    for k in range(film.n):
        layer = film.layer()
        if is_jelly:
            ahead = draw_jelly(layer, x[k], y[k], lean[k], pulse[k], L, tone, clear)
        else:
            ahead = shrimp(layer, x[k], y[k], face[k], pitch[k], way[k] * .25 / s)
        yield film.frame(layer.over(image.copy()), layer, ahead)


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
        yield film.frame(frame, layers[0], ahead, hide, others=[center_of(layer.cov) for layer in layers[1:]])


def wheel(film):
    rng, h, w, s = film.rng, film.h, film.w, film.s
    image = tank(rng, h, w, bed=False, water=0) * .9
    floor = int(h * rng.uniform(.82, .88)); image[floor:] = bedding(rng, h, w)[floor:]
    for bx in range(int(rng.uniform(0, 30)), w, int(rng.uniform(26, 44) * s)):  # the bars of the cage
        cv2.line(image, (bx, 0), (bx, floor), (135, 138, 140), max(int(2 * s), 1), cv2.LINE_AA)
    R, cx = h * rng.uniform(.34, .39), w * rng.uniform(.4, .6); cy = floor - R - 6 * s
    f, colors = rng.choice([-1, 1]), ([150, 110, 60], [70, 150, 185], [120, 125, 130], [90, 80, 180], [95, 150, 90])
    color = np.array(colors[(film.seed + int(rng.integers(2))) % 5]) * rng.uniform(.85, 1.1)
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
    stand = film.layer()
    for side in (-.5, .5):
        stand.tube([[cx, cy], [cx + side * R, floor + 14 * s]], 4 * s, [70, 72, 75])
    stand.over(image)
    L = R * rng.uniform(.7, .85)
    coat = np.array([[70, 120, 175], [190, 200, 205], [85, 95, 105]][rng.integers(3)]) * rng.uniform(.85, 1.1)
    mouse = runner(film, L, coat, f)
    fast = np.clip(.11 * (1 + .35 * drift(rng, film.n, 30)), .03, .2)
    turned_rad, sway = -f * np.cumsum(fast), drift(rng, film.n, 25)
    for k in range(film.n):
        frame, layer, c, sn = image.copy(), film.layer(), np.cos(turned_rad[k]), np.sin(turned_rad[k])
        m = [[c, -sn, cx - c * cx + sn * cy], [sn, c, cy - sn * cx - c * cy]]
        disc.warp(m).over(frame)
        phase = np.cumsum(fast)[k] * R / L * 5
        y = cy + R * .93 - L * .36 + 1.5 * s * np.sin(2 * phase)
        ahead = mouse(layer, cx + f * (.08 + .03 * sway[k]) * R, y, .12 + .04 * sway[k], phase)
        rim = ring.warp(m)
        yield film.frame(rim.over(layer.over(frame)), layer, ahead, rim.a)


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
        seen = pts[(pts[:, 0] > 0) & (pts[:, 0] < w - 1)]
        yield film.frame(film.lit(image, layer, 2, 3, .4, 2), layer, seen[0] - seen[-1] if len(seen) > 1 else (0, 0))


KINDS = {draw.__name__: draw for draw in (
    station, slow_crawler, head_fixed, resting_mirror, side_mirror, cast_shadow, lamp_shadow, two_tone, stop_and_go, ripple, shoal, pecking,
    tail_wagger, plants, hand_feeds, bubbles, clock, camouflage, glossy_beetle, day_night, translucent, group_of_two_sizes, wheel,
    long_snake)}
FLAGS = {"shoal": ["--follow-largest"]}
SEEDS = (1, 2, 3)
