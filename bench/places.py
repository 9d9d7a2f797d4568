"""Where a flock is, compared with where its animal was filmed: world, footholds, crowding and cells of the picture.

All figures follow from the files of the library and of the flock. They do not use the program's own idea of support.

The *foot* of a frame is the lowest point of its matte. It is *still* if its height varies by less than 0.1 BL during
half a second, without the largest and the smallest tenth. The animal of a film is *carried* if most still feet have a
height to which feet return: the median over still feet of the number of others within 0.05 BL in height, divided by
the number within 0.25 BL, is above 0.6. Feet at any height have 0.2. Measured: 0.26 to 0.45 for five swimmers, 0.75
for a finch on perches, 0.81 for a dog on a floor. In the film of a carried animal, a frame is carried if its foot is
still and 5 % of the still feet are within 0.05 BL.
"""
import functools, io, json, math, zipfile

import cv2
import numpy as np

STILL_S, STILL_BL, SAME_BL, AROUND_BL, RETURNS, VISITS = .5, .1, .05, .25, .6, .05
# Distance of a foot from a foothold or line that still counts; difference in height and length of a line, BL.
NEAR_BL, LEVEL_BL, LINE_BL = .25, .1, 2
CELLS = 8, 6
# A centroid counts as at a wall within this distance; positions in space are rounded to less than this. BL.
AT_WALL_BL, ROUNDED_BL = .05, .01
# Every 10th frame is drawn, at half size.
EVERY, SIZE = 10, .5


class Film:
    """The film of a library: its centroids, its mattes and its footholds."""

    def __init__(self, folder):
        self.poses = json.loads((folder / "poses.json").read_text())
        self.library = json.loads((folder / "library.json").read_text())
        self.mattes = zipfile.ZipFile(folder / "mattes.zip")
        self.names = set(self.mattes.namelist())
        self.size = self.poses["image_size_px"]
        self.centroids = np.array([pose["centroid_px"] or [math.nan] * 2 for pose in self.poses["frames"]], float)
        self.component = self.library["component"]

    @functools.lru_cache(maxsize=400)
    def alpha(self, frame):
        """Returns the alpha of a frame's matte, or None."""
        name = f"{frame:06}.png"
        if name not in self.names:
            return None
        return cv2.imdecode(np.frombuffer(self.mattes.read(name), np.uint8), cv2.IMREAD_UNCHANGED)[..., 3]

    @functools.cached_property
    def feet(self):
        """Returns the lowest point of each matte from its centroid, pixels; nan if the border cuts the animal."""
        feet = np.full((len(self.centroids), 2), math.nan)
        for frame, pose in enumerate(self.poses["frames"]):
            alpha = self.alpha(frame) if pose["detected"] and not pose["cut"] else None
            if alpha is not None and (alpha >= 128).any():
                lowest = np.flatnonzero((alpha >= 128).any(1))[-1]
                columns = np.flatnonzero(alpha[lowest] >= 128)
                feet[frame] = np.array([columns.mean() + .5, lowest + 1]) - self.library["matte_center_px"][frame]
        return feet

    @functools.cached_property
    def carried(self):
        """Returns for each frame whether something carries the animal."""
        length_px, half = self.library["stats"]["length_px"], round(STILL_S / 2 * self.poses["fps"])
        heights = (self.centroids + self.feet)[:, 1] / length_px
        still = np.zeros(len(heights), bool)
        for t in range(half, len(heights) - half):
            around = np.sort(heights[t - half:t + half + 1])
            rare = len(around) // 10
            # A missing foot is nan, which sorts last.
            still[t] = not np.isnan(around[-1]) and around[-1 - rare] - around[rare] < STILL_BL
        apart = np.abs(heights[still][:, None] - heights[still])
        same, near = (apart < SAME_BL).sum(1), (apart < AROUND_BL).sum(1)
        carried = np.zeros(len(heights), bool)
        if len(same) and np.median(same / near) > RETURNS:
            carried[np.flatnonzero(still)[same >= VISITS * len(same)]] = True
        return carried

    @functools.cached_property
    def footholds(self):
        """Returns pairs of ends of lines on which the film's feet stood, pixels. A foothold is a line of length 0."""
        length_px = self.library["stats"]["length_px"]
        # One foothold of each square of 0.05 BL is enough.
        points = (self.centroids + self.feet)[self.carried]
        points = points[np.unique((points / length_px / .05).round(), axis=0, return_index=True)[1]]
        apart = np.abs(points[:, None] - points) / length_px
        a, b = np.nonzero((apart[..., 1] < LEVEL_BL) & (apart[..., 0] < LINE_BL))
        return points[a], points[b]

    def far_from_footholds(self, points):
        """Returns for each point whether it is more than 0.25 BL from all footholds and lines."""
        start, end = self.footholds
        along = end - start
        lengths = np.maximum((along ** 2).sum(-1), 1e-9)
        distances = []
        for point in points:
            share = np.clip(((point - start) * along).sum(-1) / lengths, 0, 1)
            distances.append(np.linalg.norm(start + share[:, None] * along - point, axis=-1).min())
        return np.array(distances) > NEAR_BL * self.library["stats"]["length_px"]


def column(one, name, default=1.0):
    return np.array(one.get(name) or [default] * len(one["source_frame"]), float)


def turned(one, offsets):
    """Returns offsets in the mattes of the shown frames as they appear in the picture: mirrored, scaled and rotated."""
    scale, angle = column(one, "scale"), column(one, "rotation_rad", 0.0)
    u, v = np.where(one["mirrored"], -1, 1) * scale * offsets[:, 0], scale * offsets[:, 1]
    return np.stack([np.cos(angle) * u - np.sin(angle) * v, np.sin(angle) * u + np.cos(angle) * v], -1)


def on_footholds(flock, film):
    """Returns the share of the shown carried frames whose foot is near a filmed foothold or its line, or None."""
    if film.poses["view"] == "top" or not film.carried.any():
        return None
    feet = []
    for one in flock["individuals"]:
        frames = np.array(one["source_frame"])
        feet.append((np.array(one["centroid_px"]) + turned(one, film.feet[frames]))[film.carried[frames]])
    feet = np.concatenate(feet)
    return 1 - float(film.far_from_footholds(feet).mean()) if len(feet) else None


def room(flock, places, depths_bl):
    """Returns the distance of places in the picture from the walls of the flock's world, BL; negative outside.

    Walls in front of and behind the flock are left out.
    """
    space, camera = flock["space"], flock["space"]["camera"]
    z = space["front_bl"] + depths_bl
    px_per_bl, center = np.full(len(z), flock["length_px"]), 0
    if camera:
        px_per_bl, center = camera["focal_px"] / (camera["pane_bl"] + (z - camera["pane_bl"]) / camera["medium_index"]), camera["center_px"]
    points = np.column_stack([(places - np.array(center)) / px_per_bl[:, None], z])
    walls = [wall for wall in space["walls"] if abs(wall["outward"][2]) < 1]
    return np.min([wall["offset_bl"] - points @ wall["outward"] for wall in walls], axis=0)


def world(flock, film):
    """Returns the share of the filmed places that are inside the flock's world at one of its depths."""
    places = film.centroids[film.component]
    places = places[~np.isnan(places[:, 0])]
    back_bl = [wall["offset_bl"] - flock["space"]["front_bl"] for wall in flock["space"]["walls"] if wall["outward"][2] == 1]
    depths_bl = np.linspace(0, max(min(back_bl, default=0), 0), 31)
    return float(np.mean(np.max([room(flock, places, np.full(len(places), depth)) for depth in depths_bl], axis=0) >= -ROUNDED_BL))


def clipped(flock, is_as_filmed):
    """Returns the share of steps that a wall shortens: those that the flock counts, or an estimate.

    The estimate counts frames that are at a wall and whose speed is not as filmed, of those with a known speed.
    `is_as_filmed` is nan where speeds are not compared.
    """
    if "clipped_share" in flock["stats"]:
        return flock["stats"]["clipped_share"]
    counts = []
    for one, is_good in zip(flock["individuals"], is_as_filmed):
        depths_bl = np.array(one["boid"]["position"])[:, 2] / flock["length_px"]
        at_wall = room(flock, np.array(one["centroid_px"]), depths_bl) < AT_WALL_BL
        counts.append((at_wall & (is_good == 0))[~np.isnan(is_good)])
    return float(np.concatenate(counts).mean())


def same_cells(flock, film):
    """Returns the overlap of the shown and the filmed distribution over 8 x 6 cells of the picture, 0 to 1."""
    def shares(places):
        limits = [[0, side] for side in film.size]
        places = np.clip(places[~np.isnan(places[:, 0])], 0, np.array(film.size) - 1e-6)
        return np.histogram2d(*places.T, bins=CELLS, range=limits)[0] / len(places)
    shown = np.concatenate([one["centroid_px"] for one in flock["individuals"]])
    return float(np.minimum(shares(shown), shares(film.centroids[film.component])).sum())


def crowding(flock, film):
    """Returns the share of the bodies' area that overlaps others, and the visible share of the bodies' area.

    Bodies are the mattes of the shown frames, without fades. The visible share does not depend on their order.
    """
    width, height = (round(SIZE * side) for side in film.size)
    total = visible = shared = 0
    for t in range(0, len(flock["individuals"][0]["source_frame"]), EVERY):
        count = np.zeros((height, width), np.uint8)
        for one in flock["individuals"]:
            frame, (x, y) = one["source_frame"][t], one["centroid_px"][t]
            alpha = film.alpha(frame)
            if alpha is not None:
                scale, angle = column(one, "scale")[t] * SIZE, one["rotation_rad"][t]
                cos, sin, side = scale * math.cos(angle), scale * math.sin(angle), -1 if one["mirrored"][t] else 1
                turn = np.array([[side * cos, -sin], [side * sin, cos]])
                shift = SIZE * np.array([x, y]) - turn @ film.library["matte_center_px"][frame]
                count += cv2.warpAffine(alpha, np.column_stack([turn, shift]), (width, height)) >= 128
        total, visible, shared = total + int(count.sum()), visible + int((count > 0).sum()), shared + int(count[count > 1].sum())
    return {"overlap": shared / max(total, 1), "visible": visible / max(total, 1)}


def neighbor_p10(flock):
    """Returns the 10th percentile of the distance to the nearest neighbor in the picture, BL; None for one animal."""
    places = np.array([one["centroid_px"] for one in flock["individuals"]], float)
    if len(places) < 2:
        return None
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    apart[np.arange(len(places)), np.arange(len(places))] = np.inf
    return float(np.quantile(apart.min(1), .1)) / flock["length_px"]


def polarization(flock):
    """Returns the mean length of the mean of the shown headings as unit vectors, 0 to 1."""
    headings = np.array([one["heading_rad"] for one in flock["individuals"]], float)
    return float(np.abs(np.exp(1j * headings).mean(0)).mean())
