"""Compares keypoints with the poses from which they come, by a formula of its own, and the report with the tracks."""
import csv
import json

import numpy as np
import pytest

from conftest import COUNT, N_FRAMES, run

NAMES = ["head", *(f"midline_{k}" for k in range(1, 10)), "tail", "centroid"]


def points(row, names):
    """Returns the keypoints of a row of tracks.csv as complex numbers; NaN where they are not measured."""
    cells = [(row[f"{name}_x_px"], row[f"{name}_y_px"]) for name in names]
    return np.array([complex(float(x), float(y)) if x else np.nan for x, y in cells])


@pytest.mark.parametrize("view", ["top", "side"])
def test_keypoints_of_one_animal_are_the_poses_of_the_frames_shown(folder, tmp_path, view):
    library = folder / "library"
    if view == "top":
        library = tmp_path / "library"
        run(folder, "analyze", "film.mp4", "-o", library, "--view", view)
    run(tmp_path, "flock", library, "-o", "one.jpg", "--plan", "one.json", "--ground-truth", "truth", "--count", "1",
        "--frames", "60", "--size", "800x600")
    poses = json.loads((library / "poses.json").read_text())
    assert poses["view"] == view
    one = json.loads((tmp_path / "one.json").read_text())["individuals"][0]
    scale = 800 / poses["image_size_px"][0]
    with (tmp_path / "truth" / "tracks.csv").open() as file:
        for frame, row in enumerate(csv.DictReader(file)):
            pose = poses["frames"][one["source_frame"][frame]]
            shown = complex(*one["centroid_px"][frame]) * scale
            assert abs(points(row, ["centroid"])[0] - shown) < 0.05
            assert row["keypoint_source"] == ("midline" if view == "top" else "body_ends")
            if view == "side":
                # The ends of the body lie along its axis on both sides, about one length apart.
                head, tail = points(row, ["head", "tail"])
                length = pose["length_px"] * one["scale"][frame] * scale
                assert abs(head - tail) == pytest.approx(length, rel=0.25)
                continue
            offsets = np.array([complex(*point) for point in pose["midline_px"]]) - complex(*pose["centroid_px"])
            if one["mirrored"][frame]:
                offsets = -offsets.conjugate()
            turn = np.exp(1j * one["rotation_rad"][frame]) * one["scale"][frame] * scale
            assert np.abs(points(row, NAMES[:11]) - (shown + turn * offsets)).max() < 0.05
            # The head lies ahead of the tail.
            heading = np.exp(1j * float(row["heading_rad"]))
            head, tail = points(row, ["head", "tail"])
            assert ((head - tail) * heading.conjugate()).real > 0


def test_report_agrees_with_tracks_and_masks(truth):
    report = json.loads((truth / "report.json").read_text())
    with (truth / "tracks.csv").open() as file:
        rows = list(csv.DictReader(file))
    area = np.array([int(row["visible_area_px"]) for row in rows]).reshape(N_FRAMES, COUNT)
    place = np.array([complex(float(row["x_px"]), float(row["y_px"])) for row in rows]).reshape(N_FRAMES, COUNT)
    distance = np.abs(place[:, :, None] - place[:, None, :])
    distance[:, range(COUNT), range(COUNT)] = np.inf
    for one in report["individuals"]:
        hidden = {frame for a, b in one["hidden"] for frame in range(a, b)}
        assert hidden == set(np.flatnonzero(area[:, one["id"]] == 0))
        assert one["nearest_px"] == pytest.approx(distance[:, one["id"]].min(), abs=0.006)
        assert distance[one["nearest_frame"], one["id"], one["nearest_id"]] == pytest.approx(one["nearest_px"], abs=0.006)
    # A pair whose boxes do not overlap in a frame does not cross in it.
    sides = np.array([[float(row[f"amodal_{side}_px"] or 0) for side in "xywh"] for row in rows])
    sides = sides.reshape(N_FRAMES, COUNT, 4)
    assert report["n_crossings"] == len(report["crossings"]) > 0
    for crossing in report["crossings"]:
        a, b = crossing["ids"]
        for frame in range(*crossing["frames"]):
            (x, y, w, h), (x2, y2, w2, h2) = sides[frame, a], sides[frame, b]
            assert x < x2 + w2 and x2 < x + w and y < y2 + h2 and y2 < y + h
