"""Makes a small data set, stops and repeats it, and reads its labels: COCO with pycocotools, MOTChallenge, and YOLO by
the rules of its documentation."""
import contextlib
import csv
import filecmp
import hashlib
import io
import json
import os
import pathlib
import re
import signal
import subprocess
import time

import numpy as np
import pytest
from PIL import Image
from pycocotools.coco import COCO

from conftest import run

N_FLOCKS, N_PICTURES, EVERY = 5, 12, 3
WISHES = ["library", "--flocks", str(N_FLOCKS), "--pictures", str(N_PICTURES), "--every", str(EVERY), "--count", "3", "9",
          "--licence", "none", "--source", "a virtual fish", "--formats", "coco,mot,yolo_segment,tracks,masks,depth,dlc"]


@pytest.fixture(scope="module")
def dataset(folder):
    run(folder, "dataset", *WISHES, "-o", "dataset")
    return folder / "dataset"


@pytest.fixture(scope="module")
def coco(dataset):
    with contextlib.redirect_stdout(io.StringIO()):
        return {path.stem: COCO(str(path)) for path in sorted((dataset / "annotations").iterdir())}


def program(folder, *words, **options):
    command = [pathlib.Path(os.environ["FLOCKREEL_PROGRAM"]).resolve(), *words]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def same(a, b):
    names = files(a)
    return names == files(b) and filecmp.cmpfiles(a, b, names, shallow=False)[0] == names


def test_manifest_has_the_hash_of_every_file(dataset):
    manifest = json.loads((dataset / "manifest.json").read_text())
    assert {one["path"] for one in manifest["files"]} | {"manifest.json"} == set(files(dataset))
    for one in manifest["files"]:
        data = (dataset / one["path"]).read_bytes()
        assert (len(data), hashlib.sha256(data).hexdigest()) == (one["bytes"], one["sha256"])
    assert (manifest["licence"], manifest["source"]) == ("none", "a virtual fish")
    assert len(manifest["sequences"]) == N_FLOCKS
    assert {one["split"] for one in manifest["sequences"]} == {"train", "val", "test"}


def test_manifest_makes_the_same_bytes_with_another_number_of_threads(dataset, folder):
    environment = {**os.environ, "RAYON_NUM_THREADS": "1"}
    again = program(folder, "dataset", "library", "--from", dataset / "manifest.json", "-o", "again", "--json", env=environment)
    out, err = again.communicate()
    assert again.returncode == 0, err
    assert json.loads(out)["equals_manifest"] is True
    assert same(dataset, folder / "again")


def test_stopped_data_set_goes_on_and_keeps_finished_flocks(dataset, folder):
    other = folder / "stopped"
    first = program(folder, "dataset", *WISHES, "-o", other)
    while first.poll() is None and not (other / ".work" / "flock00001.json").exists():
        time.sleep(0.005)
    first.send_signal(signal.SIGSTOP)
    beside = program(folder, "dataset", *WISHES, "-o", other)
    assert "another process" in beside.communicate()[1] and beside.returncode == 2
    first.send_signal(signal.SIGKILL)
    first.communicate()
    assert not (other / "manifest.json").exists(), "the run ended before it was stopped"
    kept = {path: path.stat().st_mtime_ns for path in (other / "images").rglob("*/flock00000/*")}
    assert len(kept) == N_PICTURES
    wrong = program(folder, "dataset", *WISHES, "--seed", "7", "-o", other)
    assert "holds another data set" in wrong.communicate()[1] and wrong.returncode == 2
    again = program(folder, "dataset", *WISHES, "-o", other, "--json")
    assert json.loads(again.communicate()[0])["kept_flocks"] >= 2
    assert same(dataset, other)
    assert all(path.stat().st_mtime_ns == changed for path, changed in kept.items())
    # A stop between the manifest and the end leaves a finished data set with leftovers.
    (other / ".work").mkdir()
    run(folder, "dataset", *WISHES, "-o", other)
    assert same(dataset, other)
    assert all(path.stat().st_mtime_ns == changed for path, changed in kept.items())


def test_folder_with_other_files_is_refused(folder):
    (folder / "mine").mkdir()
    (folder / "mine" / "notes.txt").write_text("mine")
    refused = program(folder, "dataset", *WISHES, "-o", "mine")
    assert "not empty" in refused.communicate()[1] and refused.returncode == 2
    assert files(folder / "mine") == ["notes.txt"]


def test_estimate_counts_pictures_and_is_near_in_bytes(dataset, folder):
    words = [word for word in WISHES if word != "--json"]
    out = program(folder, "dataset", *words, "--dry-run", "--json").communicate()[0]
    estimate = json.loads(out)
    size = sum(one["bytes"] for one in json.loads((dataset / "manifest.json").read_text())["files"])
    assert estimate["pictures"] == N_FLOCKS * N_PICTURES
    assert 0.5 < estimate["bytes"] / size < 2


def rows_of(folder):
    with (folder / "tracks.csv").open() as file:
        return {(int(row["frame"]), int(row["id"])): row for row in csv.DictReader(file)}


def test_coco_agrees_with_masks_and_tracks(dataset, coco):
    n = 0
    for split, annotations in coco.items():
        assert len(annotations.getImgIds()) % N_PICTURES == 0
        for image in annotations.loadImgs(annotations.getImgIds()):
            with Image.open(dataset / image["file_name"]) as picture:
                assert picture.size == (image["width"], image["height"])
            path = pathlib.PurePath(image["file_name"])
            sequence = dataset / "sequences" / split / path.parent.name
            labels = np.array(Image.open(sequence / "masks" / f"{path.stem}.png"))
            depth = np.array(Image.open(sequence / "depth" / f"{path.stem}.png"))
            assert ((depth > 0) == (labels > 0)).all()
            rows = rows_of(sequence)
            assert image["frame"] == (int(path.stem) - 1) * EVERY
            found = annotations.loadAnns(annotations.getAnnIds(image["id"]))
            assert {one["track_id"] for one in found} == set(np.unique(labels)) - {0}
            for one in found:
                assert (annotations.annToMask(one).astype(bool) == (labels == one["track_id"])).all()
                row = rows[image["frame"], one["track_id"] - 1]
                assert set(np.unique(depth[labels == one["track_id"]])) == {int(row["depth_rank"]) + 1}
                assert one["depth_rank"] == int(row["depth_rank"])
                names = annotations.cats[1]["keypoints"]
                own = [[float(row[f"{name}_{k}"] or 0) for k in ("x_px", "y_px", "v")] for name in names]
                np.testing.assert_allclose(np.reshape(one["keypoints"], (-1, 3)), own)
                n += 1
    assert n > N_FLOCKS * N_PICTURES * 2
    ids = [one for annotations in coco.values() for one in annotations.getAnnIds()]
    assert len(set(ids)) == len(ids)


def test_challenge_names_its_pictures_and_agrees_with_tracks(dataset):
    for sequence in sorted((dataset / "sequences").glob("*/*")):
        info = dict(line.split("=") for line in (sequence / "seqinfo.ini").read_text().splitlines()[1:])
        pictures = sorted((sequence / info["imDir"]).glob(f"*{info['imExt']}"))
        assert [path.stem for path in pictures] == [f"{k:06}" for k in range(1, int(info["seqLength"]) + 1)]
        rows = rows_of(sequence)
        for line in (sequence / "gt" / "gt.txt").read_text().splitlines():
            number, identity, left, top, width, height, *_ = line.split(",")
            row = rows[(int(number) - 1) * EVERY, int(identity) - 1]
            assert [int(left) - 1, int(top) - 1, int(width), int(height)] == [int(row[f"amodal_{k}_px"]) for k in "xywh"]


def inside(polygon, width, height):
    """Returns the pixels whose centers are inside of a polygon, by the even-odd rule."""
    result = np.zeros((height, width), bool)
    (left, top), (right, bottom) = polygon.min(axis=0).round().astype(int), polygon.max(axis=0).round().astype(int)
    x, y = np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5)
    part = result[top:bottom, left:right]
    for (x1, y1), (x2, y2) in zip(polygon, np.roll(polygon, -1, axis=0)):
        if y1 != y2:
            part ^= ((y1 > y) != (y2 > y)) & (x < x1 + (y - y1) / (y2 - y1) * (x2 - x1))
    return result


def test_yolo_outlines_are_the_masks(dataset):
    yaml = (dataset / "data.yaml").read_text()
    n = 0
    for split in ("train", "val", "test"):
        assert f"{split}: images/{split}\n" in yaml
        pictures = sorted((dataset / "images" / split).glob("*/*"))
        # The loader finds a label by the path of its picture.
        for picture in pictures[:: max(1, len(pictures) // 6)]:
            label = pathlib.Path(str(picture).replace(f"{os.sep}images{os.sep}", f"{os.sep}labels{os.sep}")).with_suffix(".txt")
            masks = np.array(Image.open(dataset / "sequences" / split / picture.parent.name / "masks" / f"{picture.stem}.png"))
            height, width = masks.shape
            lines = [line.split() for line in label.read_text().splitlines()]
            left = masks > 0
            assert len(lines) == len(np.unique(masks)) - 1
            for line in lines:
                assert line[0] == "0" and len(line) >= 7 and len(line) % 2 == 1
                polygon = np.reshape([float(cell) for cell in line[1:]], (-1, 2))
                assert polygon.min() >= 0 and polygon.max() <= 1
                filled = inside(polygon * (width, height), width, height)
                identity = np.bincount(masks[filled]).argmax()
                own = masks == identity
                assert (filled & own).sum() == own.sum() and filled.sum() <= own.sum() * 1.02
                left &= ~own
                n += 1
            assert not left.any()
    assert n > 20


def test_commands_and_code_of_the_guide_work(folder, tmp_path):
    guide = (pathlib.Path(__file__).parents[2] / "docs" / "how-to" / "train-a-tracker.md").read_text()
    blocks = re.findall(r"```(sh|python)\n(.*?)```", guide, re.DOTALL)
    # What the guide sends to a service is tested in tests/it/jobs/datasets.rs.
    make, vary, read, again = [text for _, text in blocks if "/v1/" not in text][:4]
    os.symlink(pathlib.Path(os.environ["FLOCKREEL_PROGRAM"]).resolve(), tmp_path / "flockreel")
    os.symlink(folder / "film.mp4", tmp_path / "film.mp4")
    # Fewer pictures take less time; the second block needs two films and a folder of pictures.
    make = make.replace("--flocks 20 --pictures 100", "--flocks 3 --pictures 5")
    vary = vary.replace("--flocks 200 --pictures 150", "--flocks 2 --pictures 3").replace("fish-a fish-b -o set", "library library -o other")
    assert "--flocks 3" in make and "--flocks 2" in vary
    environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    shell = lambda text: subprocess.run(["sh", "-ec", text], cwd=tmp_path, env=environment, check=True, capture_output=True)
    shell(make)
    (tmp_path / "tanks").mkdir()
    Image.open(tmp_path / "sheet.png").resize((640, 480)).save(tmp_path / "tanks" / "tank.jpg")
    shell(vary)
    shell(again)
    assert same(tmp_path / "set", tmp_path / "again")
    with contextlib.chdir(tmp_path), contextlib.redirect_stdout(io.StringIO()):
        found = {}
        exec(read, found)
    assert found["mask"].any() and set(found["visible"]) <= {0, 1, 2}
