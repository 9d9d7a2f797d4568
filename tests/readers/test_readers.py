"""Reads keypoints and labels with the tools for which they are written: movement, sleap-io, and the label check of
ultralytics.

The package of ultralytics needs PyTorch, so its own functions are taken out of its source and run without it.
"""
import ast
import csv
import json
import os
import pathlib
import shutil
import zipfile

import numpy as np
import pytest
import sleap_io
from movement.io import load_poses
from PIL import Image

from conftest import COUNT, N_FRAMES, run

NAMES = ["head", *(f"midline_{k}" for k in range(1, 10)), "tail", "centroid"]


def points(row, names):
    """Returns the keypoints of a row of tracks.csv as complex numbers; NaN where they are not measured."""
    cells = [(row[f"{name}_x_px"], row[f"{name}_y_px"]) for name in names]
    return np.array([complex(float(x), float(y)) if x else np.nan for x, y in cells])


@pytest.fixture(scope="module")
def truth(folder):
    return folder / "truth"


def test_movement_and_sleap_read_the_keypoints_of_all_animals(truth):
    with (truth / "tracks.csv").open() as file:
        rows = list(csv.DictReader(file))
    own = np.array([points(row, NAMES) for row in rows]).reshape(N_FRAMES, COUNT, len(NAMES))
    flags = np.array([[float(row[f"{name}_v"]) for name in NAMES] for row in rows]).reshape(own.shape)
    assert (flags == 1).any() and (flags == 2).any()

    poses = load_poses.from_dlc_file(truth / "tracks_dlc.csv", fps=30)
    assert list(poses.keypoints.values) == NAMES and poses.sizes["individuals"] == COUNT
    position = poses.position.transpose("time", "individuals", "keypoints", "space").values
    np.testing.assert_allclose(position[..., 0] + 1j * position[..., 1], own)
    confidence = poses.confidence.transpose("time", "individuals", "keypoints").values
    np.testing.assert_array_equal(np.nan_to_num(confidence), flags / 2)

    labels = sleap_io.load_coco(str(truth / "coco.json"), dataset_root=str(truth))
    assert [node.name for node in labels.skeleton.nodes] == NAMES
    assert len(labels.skeleton.edges) == 10
    coco = json.loads((truth / "coco.json").read_text())
    keypoints = {}
    for annotation in coco["annotations"]:
        keypoints.setdefault(annotation["image_id"], []).append(np.reshape(annotation["keypoints"], (-1, 3)))
    assert len(labels.labeled_frames) == N_FRAMES
    for image_id, frame in enumerate(labels.labeled_frames, start=1):
        assert len(frame.instances) == len(keypoints[image_id])
        for instance, expected in zip(frame.instances, keypoints[image_id]):
            found = instance.numpy(invisible_as_nan=False)
            measured = expected[:, 2] > 0
            np.testing.assert_allclose(found[measured], expected[measured, :2])

def test_movement_and_sleap_read_the_poses_of_the_one_animal(folder):
    run(folder, "motion", "library", "-o", "keypoints.csv", "--keypoints")
    frames = json.loads((folder / "library" / "poses.json").read_text())["frames"]
    poses = load_poses.from_dlc_file(folder / "keypoints.csv", fps=30)
    assert list(poses.keypoints.values) == NAMES and poses.sizes["time"] == len(frames)
    position = poses.position.transpose("time", "individuals", "keypoints", "space").values[:, 0]
    confidence = poses.confidence.transpose("time", "individuals", "keypoints").values[:, 0]
    found = sleap_io.load_dlc(str(folder / "keypoints.csv"))
    assert {node.name for node in found.skeleton.nodes} == set(NAMES)
    n = 0
    for frame, pose in enumerate(frames):
        if not pose["detected"]:
            assert np.isnan(position[frame]).all()
            continue
        np.testing.assert_allclose(position[frame, -1], pose["centroid_px"], atol=0.002)
        if pose["midline_px"]:
            np.testing.assert_allclose(position[frame, :11], pose["midline_px"], atol=0.006)
            n += 1
        assert confidence[frame, -1] == pytest.approx(pose["confidence"])
    assert n > 100


def coco_keypoints(dataset, split):
    """Returns by picture the keypoints of its animals."""
    coco = json.loads((dataset / "annotations" / f"{split}.json").read_text())
    keypoints = {image["file_name"]: [] for image in coco["images"]}
    names = {image["id"]: image["file_name"] for image in coco["images"]}
    for annotation in coco["annotations"]:
        keypoints[names[annotation["image_id"]]].append(np.reshape(annotation["keypoints"], (-1, 3)))
    return keypoints


def test_sleap_reads_coco_of_a_data_set_and_saves_it_as_slp(folder, tmp_path):
    dataset = folder / "pose"
    labels = sleap_io.load_coco(str(dataset / "annotations" / "train.json"), dataset_root=str(dataset))
    expected = coco_keypoints(dataset, "train")
    labels.save(str(tmp_path / "train.slp"))
    again = sleap_io.load_slp(str(tmp_path / "train.slp"))
    assert len(again.labeled_frames) == len(expected) == 8
    n = sum(len(frame.instances) for frame in again.labeled_frames)
    assert n == sum(len(animals) for animals in expected.values())
    for frame in again.labeled_frames:
        picture = pathlib.Path(frame.video.filename[frame.frame_idx]).relative_to(dataset.resolve())
        for instance, own in zip(frame.instances, expected[picture.as_posix()]):
            measured = own[:, 2] > 0
            np.testing.assert_allclose(instance.numpy(invisible_as_nan=False)[measured], own[measured, :2], atol=1e-3)


def test_sleap_reads_the_labels_of_deeplabcut(folder, tmp_path):
    sequence = next((folder / "pose" / "sequences" / "train").iterdir())
    project = tmp_path / "labeled-data" / sequence.name
    shutil.copytree(folder / "pose" / "images" / "train" / sequence.name, project)
    shutil.copy(sequence / "CollectedData_flockreel.csv", project)
    labels = sleap_io.load_dlc(str(project / "CollectedData_flockreel.csv"))
    order = [[node.name for node in labels.skeleton.nodes].index(name) for name in NAMES]
    with (sequence / "tracks.csv").open() as file:
        rows = list(csv.DictReader(file))
    visible = {}
    for row in rows:
        own = points(row, NAMES)
        own[[row[f"{name}_v"] != "2" for name in NAMES]] = np.nan
        if not np.isnan(own).all():
            visible.setdefault(int(row["frame"]) // 4, []).append(own)
    assert len(labels.labeled_frames) == len(visible) == 8
    for number, frame in enumerate(labels.labeled_frames):
        assert len(frame.instances) == len(visible[number])
        for instance, own in zip(frame.instances, visible[number]):
            found = instance.numpy()[order]
            np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], own, atol=1e-3)


@pytest.fixture(scope="module")
def ultralytics(tmp_path_factory):
    """The functions of ultralytics that find and check a label, without the rest of the package."""
    wheel = next(pathlib.Path(os.environ["FLOCKREEL_WHEELS"]).glob("ultralytics-*.whl"))
    wanted = {"img2label_paths", "exif_size", "check_image", "verify_image_label", "segments2boxes", "xyxy2xywh", "IMG_FORMATS"}
    scope = {"os": os, "np": np, "Image": Image, "empty_like": np.empty_like, "FORMATS_HELP_MSG": "", "Path": pathlib.Path}
    with zipfile.ZipFile(wheel) as archive:
        for name in ("ultralytics/utils/ops.py", "ultralytics/data/utils.py"):
            module = ast.parse(archive.read(name))
            # The future import keeps types in signatures from being looked up.
            kept = [node for node in module.body if isinstance(node, ast.ImportFrom) and node.module == "__future__"]
            for node in module.body:
                targets = [target.id for target in getattr(node, "targets", []) if isinstance(target, ast.Name)]
                if getattr(node, "name", None) in wanted or wanted & set(targets):
                    kept.append(node)
            exec(compile(ast.Module(kept, []), name, "exec"), scope)
    return scope


@pytest.mark.parametrize("kind", ["pose", "segment"])
def test_ultralytics_accepts_every_label(folder, ultralytics, kind):
    dataset = folder / kind
    n = 0
    for split in ("train", "val", "test"):
        expected = coco_keypoints(dataset, split)
        coco = json.loads((dataset / "annotations" / f"{split}.json").read_text())
        boxes = {name: [] for name in expected}
        names = {image["id"]: (image["file_name"], image["width"], image["height"]) for image in coco["images"]}
        for annotation in coco["annotations"]:
            name, width, height = names[annotation["image_id"]]
            x, y, w, h = annotation["bbox"]
            boxes[name].append([(x + w / 2) / width, (y + h / 2) / height, w / width, h / height])
        for picture in sorted((dataset / "images" / split).rglob("*.jpg")):
            label = ultralytics["img2label_paths"]([str(picture)])[0]
            is_pose = kind == "pose"
            found = ultralytics["verify_image_label"]((str(picture), label, "", is_pose, 1, 12 if is_pose else 0, 3, False))
            _, rows, (height, width), segments, keypoints, missing, _, empty, corrupt, message = found
            assert (missing, corrupt, message) == (0, 0, ""), message
            name = picture.relative_to(dataset).as_posix()
            # The check may sort rows. Boxes are compared as sets.
            order = lambda rows: sorted(np.round(rows, 4).tolist())
            np.testing.assert_allclose(order(rows[:, 1:]), order(np.reshape(boxes[name], (-1, 4))), atol=2e-4)
            if is_pose:
                own = np.array(expected[name])
                own[..., :2] /= (width, height)
                shown = own[..., 2] == 2
                np.testing.assert_allclose(keypoints[shown], own[shown], atol=1e-5)
            else:
                assert len(segments) == len(rows)
            n += len(rows)
    assert n > 60
