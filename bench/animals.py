"""Bodies of drawn animals, and the ways they move (kinds.py).

A function named after a body returns a function that draws it on a layer.
"""
import numpy as np

from drawing import TAU, drift, mix, skin, smooth, step


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
        a = want if a is None else a
        a = a + np.clip((want - a + np.pi) % TAU - np.pi, -1, 1) * turn * min(1, fast[k] / (speed * film.s + 1e-9) + idle)
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
            corners = (-.02, 0), (.02, .08 + .03 * flap), (.09, .13 + .05 * flap), (.13, .09), (.07, 0)
            fin = [root + length * (a * -d + b * n) for a, b in corners]
            layer.poly(fin, color * .85 + 12, .55, rays=root)
        end, d = aside(pts, .93, 0); n = np.array([-d[1], d[0]]); bend = .02 * np.sin(phase - 6) * beat
        corners = (0, 0), (.06, .018 + bend), (.11, bend * 2), (.06, bend - .018)
        layer.poly([end + length * (-back * d + out * n) for back, out in corners], color * .8, .6)
        layer.tube(pts, half, tex)
        layer.tube([aside(pts, q, 0)[0] for q in (.38, .48, .6)], [.2, length * .009, .2], color * .45, .8)
        for side in (-1, 1):
            eye = aside(pts, .1, side * half[3] * .78)[0]
            layer.dot(*eye, length * .016, [12, 12, 12])
            layer.dot(*(eye - length * .004), length * .005, [200] * 3, .7)
        return pts
    return draw


def side_fish(film, length, color=None, tall=None):
    """Returns draw(layer, x, y, face, pitch, phase): a fish from the side, its middle at x, y."""
    rng = film.rng
    color = fish_color(rng) if color is None else np.asarray(color, float)
    tall = tall or rng.uniform(.13, .2)
    belly = mix(color, [200, 210, 215], rng.uniform(.3, .8))
    tex = skin(rng, color, belly=belly, bands=rng.choice([0, 0, 4, 6]), spots=rng.choice([0, .35]), grain=.12, cell=14)
    fin, fork, u = mix(color, rng.uniform(60, 200, 3), .3), rng.uniform(.0, .09), np.linspace(0, .84, 26)
    half = length * tall * np.interp(u, [0, .03, .1, .2, .34, .55, .72, .84], [.1, .38, .68, .9, 1, .78, .4, .28])

    def draw(layer, x, y, face, pitch, phase=0.0, beat=1.0):
        c, s, wave = np.cos(pitch), np.sin(pitch), beat * (.5 + .5 * np.sin(phase))
        f = np.copysign(max(abs(face), .22), face)

        def at(u, v=0.0):  # u from nose to tail, v upward, in lengths
            ahead = length * (.5 - u + .07 * wave * np.maximum(u - .4, 0)); v = v * length
            return np.stack([x + f * (ahead * c - v * s), y - ahead * s - v * c], -1)
        tip = .1 + .02 * np.sin(phase)
        tail = (.8, .045), (.92, tip), (1, tip * 1.25), (1 - fork, .0), (1, -tip * 1.25), (.92, -tip), (.8, -.045)
        layer.poly([at(*corner) for corner in tail], fin, .72, rays=at(.8))
        for corners, opacity, root in ((((.3, .9), (.38, 1.45), (.5, 1.4), (.64, 1.05), (.66, .5)), .7, (.42, .6)),
                                       (((.55, -.65), (.62, -1.2), (.7, -.95), (.72, -.3)), .65, (.58, -.4)),
                                       (((.36, -.9), (.45, -1.3), (.48, -.8)), .65, None)):
            rays = at(root[0], tall * root[1]) if root else None
            layer.poly([at(u, tall * v) for u, v in corners], fin, opacity, rays=rays)
        layer.tube(at(u), half, tex, flip=-1 if f > 0 else 1)
        layer.tube([at(.19, tall * .55), at(.225, .1 * tall), at(.2, -tall * .5)], length * .006, color * .5, .55)
        flap = .05 + .035 * np.sin(phase * .6 + 1)
        corners = (.26, -.1 * tall), (.36, -.1 * tall + flap), (.39, -.35 * tall - flap), (.3, -.4 * tall)
        layer.poly([at(*corner) for corner in corners], fin * .85, .7, rays=at(.26, -.2 * tall))
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
    shape = np.interp(u, [0, .05, .16, .28, .42, .68, .88, 1], [.022, .05, .095, .095, .125, .165, .125, .05])
    half = length * rng.uniform(.92, 1.1) * shape
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
            coat = mix(color, pink, .5) if below else color * .8
            layer.tube([hip, (hip + foot) / 2, foot], length * np.array([.04, .03, .022]), coat, soft=1.5)
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
            layer.dot(*ear, length * .047, mix(color, pink, .35), soft=1.6)
            layer.dot(*ear, length * .026, mix(color * .8, pink, .6), .8, soft=1.5)
            if not below:
                layer.dot(*aside(pts, .11, side * half[3] * .7)[0], length * .014, [10, 10, 10])
        layer.dot(*pts[0], length * .016, mix(pink, [90, 90, 160], .4) if nose is None else nose * .92)
        return pts
    return draw


def skin_of(color):
    """Returns a small plain round texture."""
    v = np.linspace(-1, 1, 16)[:, None, None]
    return (np.asarray(color, np.float32) * (.5 + .5 * np.sqrt(np.clip(1 - .9 * v * v, 0, 1))) * np.ones((16, 8, 1))).astype(np.float32)


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
                leg = [at(root, .05 * side), at(root + ahead * .45 + swing * .6, side * out * .62), at(root + ahead + swing, side * out)]
                layer.tube(leg, length * np.array([.02, .017, .01]), color * .75)
        for side in (-1, 1):
            feeler = [at(.42, .03 * side), at(.53, .13 * side), at(.66, side * (.12 + .04 * np.sin(feel + side)))]
            layer.tube(feeler, length * .01, color * .8)
        for u, long, wide in parts[::-1]:
            v = np.linspace(-1, 1, 9)
            layer.tube([at(u - q * long * .9, 0) for q in v], length * wide * np.sqrt(1.02 - v * v * .9), tex)
        if kind != "ant":
            layer.tube([at(.08, 0), at(-.45, 0)], length * .006, color * .3, .9)
        return turn[0]
    return draw


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


def draw_jelly(layer, x, y, lean, pulse, length, tone, clear):
    """Draws a jellyfish from the side. Returns where it points."""
    p, up = np.sin(pulse), np.array([np.sin(lean), -np.cos(lean)])
    n, wide, c = np.array([-up[1], up[0]]), length * (.36 + .06 * p), np.array([x, y])
    t = np.linspace(0, 1, 12)
    for i in range(9):
        o = (i - 4) / 4
        drop, bend = .02 * length + t[:, None] * length * (.75 - .15 * abs(o)), length * .06 * t * np.sin(7 * t - pulse + i)
        layer.tube(c + wide * o * n * .9 - up * drop + n * bend[:, None], length * np.linspace(.008, .004, 12), tone, clear)
    high = length * (.42 - .06 * p)
    layer.poly([c + wide * np.cos(q) * n + high * np.sin(q) * up * (1 if np.sin(q) > 0 else .25) for q in np.linspace(0, TAU, 40)],
               tone, clear * .8)
    rim = [c + wide * q * n - length * .07 * up * np.sqrt(max(1 - q * q, 0)) for q in np.linspace(-1, 1, 15)]
    layer.tube(rim, length * .016, tone * 1.1, clear)
    for q in (-.5, -.17, .17, .5):
        layer.dot(*(c + wide * q * n + length * .14 * up), length * .045, [110, 90, 120], .55, soft=2)
    layer.tube([c + length * .1 * up, c - length * .3 * up], length * np.array([.05, .02]), tone * .8, clear)
    return up


def shrimp_of(film, length, tone, clear):
    """Returns draw(layer, x, y, face, pitch, phase): a shrimp from the side, its middle at x, y."""
    shell, u = skin(film.rng, tone, bands=9, grain=.1, shine=.3, rough=.25), np.linspace(0, 1, 22)
    half = length * np.interp(u, [0, .05, .2, .4, .7, 1], [.02, .055, .095, .085, .055, .025])

    def draw(layer, x, y, face, pitch, phase):
        f = np.copysign(max(abs(face), .25), face)
        a = pitch * .6 + 1.0 * step(u, .35, 1) - .12
        line = np.stack([np.cos(a), -np.sin(a)], 1).cumsum(0) * length / 22
        line = np.array([x, y]) + (line.mean(0) - line) * [f, 1]
        beside = lambda at, ahead, down: at + length * np.array([f * ahead, down])
        for i in range(5):  # swimming legs
            root = line[9 + i * 2] + np.array([0, length * .04])
            layer.tube([root, beside(root, .03 * .5 * np.sin(phase + i) - .02, .09)], length * .012, tone, clear)
        for i in range(4):
            root = line[3 + i] + np.array([0, length * .05])
            layer.tube([root, beside(root, .05 - .03 * i, .09), beside(root, -.04 * i, .16)], length * .007, tone, clear)
        t = np.linspace(0, 1, 10)
        for q in (.5, .25, -.1):
            feel = length * np.stack([f * (.65 * t - .25 * t * t * (1 + q)), -.5 * q * t + .3 * t * t * (.6 - q)], 1)
            layer.tube(line[0] + feel, length * .004, tone, clear, own=False)
        layer.poly([line[-2], *(beside(line[-1], *by) for by in ((-.1, -.02), (-.12, .06), (-.02, .12)))], tone, clear)
        layer.tube(line, half, shell, clear, flip=-1 if f > 0 else 1)
        gut = length * np.interp(np.linspace(0, 1, 8), [0, .4, 1], [.03, .035, .008])
        layer.tube(line[4:12] - [0, length * .02], gut, [40, 60, 70], .65, soft=2)
        layer.dot(*(line[1] + [0, -length * .035]), length * .025, [12, 12, 14])
        return (line[0] - line[14]) * (abs(face) > .3)
    return draw


def runner(film, length, coat, f):
    """Returns draw(layer, x, y, lean, phase): a rodent that runs in the picture's plane, toward f (-1 left, 1 right)."""
    fur = skin(film.rng, coat, belly=mix(coat, [215, 220, 225], .7), patch=coat * 1.12, grain=.08, shine=.05, cell=9)
    u, pink = np.linspace(0, 1, 18), np.array([150, 160, 205])
    half = length * np.interp(u, [0, .1, .25, .5, .8, 1], [.06, .13, .17, .22, .2, .07])

    def draw(layer, x, y, lean, phase):
        c, s = np.cos(lean), np.sin(lean)
        at = lambda u, v: np.array([x + f * length * (u * c - v * s), y - length * (u * s + v * c)])
        for hip, o, g in ((-.3, 0, .7), (.25, np.pi, .7), (-.26, np.pi, 1), (.29, 0, 1)):
            q, lift = np.sin(phase + o), max(np.cos(phase + o), 0)
            foot = at(hip + .17 * q + .03, -.33 + .08 * lift + .06 * abs(hip + .17 * q))
            leg = [at(hip, -.12), at(hip + .08 * q - .04, -.22), foot]
            layer.tube(leg, length * np.array([.09, .05, .03]), coat * g * .9, soft=1.5)
            layer.tube([foot, foot + f * length * np.array([.06, 0])], length * .025, pink * g)
        layer.tube([at(.5 - q, .07 * np.sin(np.pi * q) - .02) for q in u], half, fur, flip=-1 if f > 0 else 1, soft=1.9)
        for place, r, color, soft in (((.27, .19), .06, mix(coat, [140, 140, 190], .5), 1.5), ((.27, .19), .033, [110, 110, 150], 1.5),
                                      ((.4, .07), .027, [8, 8, 8], 1), ((.405, .08), .008, [230] * 3, 1),
                                      ((.545, -.03), .02, [120, 120, 180], 1)):
            layer.dot(*at(*place), length * r, color, soft=soft)
        return at(.5, 0) - at(-.5, 0)
    return draw
