"""Reads the ground truth of a flock with pycocotools and TrackEval.

Each file is evaluated against itself and must score 100 %. It is also evaluated against a copy with one error
and must score less, which shows that the tools use the changed data.
"""
import contextlib
import copy
import csv
import io
import json
import shutil

import numpy as np
import pytest
import trackeval
from PIL import Image
from pycocotools import mask as masks
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from conftest import COUNT, N_FRAMES


@pytest.fixture(scope="module")
def coco(truth):
    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(str(truth / "coco.json"))


def labels(truth, frame):
    with Image.open(truth / "masks" / f"{frame:06}.png") as picture:
        return np.array(picture)


def test_every_annotation_is_the_mask_of_its_label(truth, coco):
    for image in coco.loadImgs(coco.getImgIds()):
        picture = labels(truth, image["frame"])
        assert picture.shape == (image["height"], image["width"])
        annotations = coco.loadAnns(coco.getAnnIds(image["id"]))
        assert {a["track_id"] for a in annotations} == set(np.unique(picture)) - {0}
        for annotation in annotations:
            mask = coco.annToMask(annotation).astype(bool)
            assert (mask == (picture == annotation["track_id"])).all()
            assert masks.toBbox(coco.annToRLE(annotation)).tolist() == annotation["bbox"]
            assert masks.area(coco.annToRLE(annotation)) == annotation["area"] == mask.sum()


def test_amodal_masks_hold_the_visible_ones_and_overlap_where_masks_do_not(coco):
    overlaps = 0
    for image in coco.getImgIds():
        annotations = coco.loadAnns(coco.getAnnIds(image))
        for annotation in annotations:
            visible, whole = coco.annToMask(annotation), masks.decode(annotation["amodal_segmentation"])
            # Labeled pixels have visible >= 0.5, and alpha is at least `visible`.
            assert not (visible & ~whole.astype(bool)).any()
            assert annotation["amodal_area"] >= whole.sum()
        overlaps += (sum(masks.decode(a["amodal_segmentation"]).astype(int) for a in annotations) > 1).sum()
    assert overlaps > 0


@pytest.mark.parametrize("kind", ["segm", "bbox"])
def test_coco_against_itself_scores_one_and_with_a_mask_shifted_less(coco, kind):
    def score(results):
        with contextlib.redirect_stdout(io.StringIO()):
            evaluation = COCOeval(coco, coco.loadRes(results), kind)
            evaluation.params.maxDets = [1, 10, 2 * COUNT]
            evaluation.evaluate()
            evaluation.accumulate()
        precision = evaluation.eval["precision"][..., 0, -1]  # of any size, all detections allowed
        return precision[precision > -1].mean()

    annotations = coco.loadAnns(coco.getAnnIds())
    own = [{"image_id": a["image_id"], "category_id": 1, "score": 1.0,
            **({"bbox": a["bbox"]} if kind == "bbox" else {"segmentation": a["segmentation"]})} for a in annotations]
    wrong = copy.deepcopy(own)
    for result in wrong[::2]:
        if kind == "bbox":
            result["bbox"][0] += 20
        else:
            mask = np.roll(masks.decode(result["segmentation"]), 20, axis=1)
            result["segmentation"] = masks.encode(np.asfortranarray(mask))
    assert score(own) == pytest.approx(1.0)
    assert score(wrong) < 0.9


def challenge(truth, folder, spoil=lambda rows: rows):
    """Returns HOTA, MOTA and IDF1 of TrackEval, for the truth changed by `spoil` against the truth."""
    sequence = folder / "gt" / "flock"
    shutil.copytree(truth / "gt", sequence / "gt")
    shutil.copy(truth / "seqinfo.ini", sequence)
    rows = [line.split(",") for line in (truth / "gt" / "gt.txt").read_text().splitlines()]
    data = folder / "trackers" / "itself" / "data"
    data.mkdir(parents=True)
    (data / "flock.txt").write_text("".join(",".join(row) + "\n" for row in spoil(rows)))
    quiet = {"PRINT_RESULTS": False, "PRINT_CONFIG": False, "TIME_PROGRESS": False, "OUTPUT_SUMMARY": False,
             "OUTPUT_DETAILED": False, "PLOT_CURVES": False, "USE_PARALLEL": False}
    dataset = trackeval.datasets.MotChallenge2DBox({
        "GT_FOLDER": str(folder / "gt"), "TRACKERS_FOLDER": str(folder / "trackers"), "SKIP_SPLIT_FOL": True,
        "TRACKERS_TO_EVAL": ["itself"], "SEQ_INFO": {"flock": None}, "DO_PREPROC": False, "PRINT_CONFIG": False,
    })
    metrics = [trackeval.metrics.HOTA(), trackeval.metrics.CLEAR({"PRINT_CONFIG": False}),
               trackeval.metrics.Identity({"PRINT_CONFIG": False})]
    with contextlib.redirect_stdout(io.StringIO()):
        results, _ = trackeval.Evaluator({**trackeval.Evaluator.get_default_eval_config(), **quiet}).evaluate([dataset], metrics)
    found = results["MotChallenge2DBox"]["itself"]["flock"]["pedestrian"]
    return found["HOTA"]["HOTA"].mean(), found["CLEAR"]["MOTA"], found["Identity"]["IDF1"]


def test_the_challenge_against_itself_scores_one(truth, tmp_path):
    assert challenge(truth, tmp_path) == pytest.approx((1.0, 1.0, 1.0))


def test_two_identities_exchanged_half_way_are_noticed(truth, tmp_path):
    def exchanged(rows):
        other = {"1": "2", "2": "1"}
        return [[row[0], other.get(row[1], row[1]) if int(row[0]) > N_FRAMES // 2 else row[1], *row[2:]] for row in rows]

    hota, mota, idf1 = challenge(truth, tmp_path, exchanged)
    assert hota < 0.999 and mota < 1.0 and idf1 < 0.999


def test_tracks_are_complete_and_agree_with_flock_json(truth, flock):
    with (truth / "tracks.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(int(row["frame"]), int(row["id"])) for row in rows] == [(f, i) for f in range(N_FRAMES) for i in range(COUNT)]
    for row in rows:
        frame, one = int(row["frame"]), flock["individuals"][int(row["id"])]
        assert [float(row["x_px"]), float(row["y_px"])] == pytest.approx(one["centroid_px"][frame], abs=1e-3)
        assert float(row["heading_rad"]) == one["heading_rad"][frame]
        assert int(row["source_frame"]) == one["source_frame"][frame]
        assert 0.0 <= float(row["visibility"]) <= 1.0


def test_the_same_truth_stands_in_all_files(truth, coco):
    with (truth / "tracks.csv").open() as file:
        rows = {(int(row["frame"]), int(row["id"])): row for row in csv.DictReader(file)}
    lines = [line.split(",") for line in (truth / "gt" / "gt.txt").read_text().splitlines()]
    assert len(lines) <= len(rows)
    for frame, identity, left, top, width, height, _, _, visibility in lines:
        row = rows[int(frame) - 1, int(identity) - 1]
        assert [int(left) - 1, int(top) - 1, int(width), int(height)] == [int(row[f"amodal_{k}_px"]) for k in "xywh"]
        assert float(visibility) == float(row["visibility"])
    for annotation in coco.loadAnns(coco.getAnnIds()):
        row = rows[annotation["image_id"] - 1, annotation["track_id"] - 1]
        assert annotation["bbox"] == [int(row[f"visible_{k}_px"]) for k in "xywh"]
        assert annotation["visibility"] == float(row["visibility"])
