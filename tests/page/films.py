"""Small films that are refused, one recipe for each reason: gray frames, drawn row by row."""

import random
import subprocess
from math import cos, sin

WIDTH, HEIGHT, FPS = 160, 120, 20


def scene(seed, brightest=200):
    """Returns a still scene: patches of gray, different for each seed."""
    draw = random.Random(seed)
    cells = [[draw.randrange(90, brightest) for _ in range(WIDTH // 10)] for _ in range(HEIGHT // 10)]
    return [bytearray(cells[y // 10][x // 10] + draw.randrange(4) for x in range(WIDTH)) for y in range(HEIGHT)]


def disc(rows, x, y, radius, level=None, brighter=0):
    """Draws a disc: of one level, or brighter than what is behind it."""
    for j in range(max(0, int(y - radius)), min(HEIGHT, int(y + radius) + 1)):
        half = int(max(0, radius**2 - (j - y) ** 2) ** 0.5 * 1.3)
        for i in range(max(0, int(x) - half), min(WIDTH, int(x) + half + 1)):
            rows[j][i] = level if level is not None else rows[j][i] + brighter


def path(k, phase=0.0, reach=(55, 38)):
    """Returns where a swimmer is in frame k."""
    return WIDTH / 2 + reach[0] * cos(0.09 * k + phase), HEIGHT / 2 + reach[1] * sin(0.14 * k + phase)


def write(path_of_film, frames, *options):
    """Writes frames, which are lists of rows, as a film."""
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{WIDTH}x{HEIGHT}", "-r", str(FPS), "-i", "-"]
    command += ["-c:v", "libx264", "-crf", "8", "-pix_fmt", "yuv420p", *options, path_of_film]
    subprocess.run(command, input=b"".join(bytes(row) for rows in frames for row in rows), check=True)
    return path_of_film


def copied(rows):
    return [bytearray(row) for row in rows]


def animal(n=100, base=None, radius=8, brighter=0, level=40):
    """Yields frames of one swimmer before a still scene."""
    base = base or scene(1)
    for k in range(n):
        rows = copied(base)
        disc(rows, *path(k), radius, None if brighter else level, brighter)
        yield rows


def several_animals(seed=1):
    for k, rows in enumerate(animal(base=scene(seed))):
        disc(rows, *path(k, 3.1), 7, 40)
        yield rows


def background_not_static(seed=1):
    """Dark and bright clouds drift through the right part of the picture."""
    base = scene(seed)
    for k in range(100):
        rows = copied(base)
        for x in range(96, WIDTH):
            for y in range(HEIGHT):
                cloud = (x // 16 * 13 + y + 5 * k) % 60
                if cloud < 40:
                    rows[y][x] = 30 if cloud < 20 else 250
        x, y = path(k, reach=(30, 38))
        disc(rows, x - 35, y, 8, 30)
        yield rows


def moved(rows, dx, dy):
    return [rows[(y + dy) % HEIGHT][dx:] + rows[(y + dy) % HEIGHT][:dx] for y in range(HEIGHT)]


def camera_moved():
    """Still for a while; then the camera rests nowhere for long, and the lens is covered at the end."""
    base, places = scene(1, brightest=130), [(4, 2), (8, 4), (12, 6), (16, 8)]
    for k in range(200):
        if k >= 154:
            yield [bytearray(b"\x10" * WIDTH) for _ in range(HEIGHT)]
            continue
        rows = copied(base if k < 70 else moved(base, *places[(k - 70) // 21]))
        disc(rows, *path(k), 8, 40)
        yield rows


def lit(rows, seed):
    """Returns a scene under leaves, which leave light and shadow on it."""
    draw = random.Random(seed)
    cells = [[draw.choice((0.1, 0.5, 1)) for _ in range(WIDTH // 20)] for _ in range(HEIGHT // 20)]
    return [bytearray(int(row[i] * cells[j // 20][i // 20]) for i in range(WIDTH)) for j, row in enumerate(rows)]


def light_changes():
    """Steady light, then other shadows every 15 frames."""
    base = scene(1)
    scenes = [base, *(lit(base, seed) for seed in range(8))]
    for k in range(200):
        rows = copied(scenes[0] if k < 80 else scenes[1 + (k - 80) // 15])
        disc(rows, *path(k), 8, 20)
        yield rows


def scene_changes():
    """One scene, then a cut every three frames."""
    scenes = [scene(seed) for seed in range(40)]
    for k in range(200):
        rows = copied(scenes[0] if k < 80 else scenes[(k - 80) // 3])
        disc(rows, *path(k), 8, 30)
        yield rows


def animal_too_large():
    base = scene(1)
    for k in range(100):
        rows = copied(base)
        disc(rows, *path(k, reach=(30, 20)), 34, 40)
        yield rows


def masks_of_the_large_animal():
    for k in range(100):
        rows = [bytearray(WIDTH) for _ in range(HEIGHT)]
        disc(rows, *path(k, reach=(30, 20)), 34, 255)
        yield rows


def nothing_moves():
    """An animal that is hardly brighter than the scene. A darker one would be taken for a shadow."""
    return animal(brighter=10)


def too_few_frames(level=40):
    return animal(n=10, level=level)
