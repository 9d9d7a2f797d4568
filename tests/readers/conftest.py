"""Fixtures: a film of the virtual fish, its library, a flock with ground truth, and two data sets, made by flockreel."""
import os
import pathlib
import subprocess

import pytest

N_FRAMES, COUNT = 40, 12


def run(folder, *words):
    """Runs flockreel in a folder."""
    program = pathlib.Path(os.environ["FLOCKREEL_PROGRAM"]).resolve()
    subprocess.run([program, *words], cwd=folder, check=True, stderr=subprocess.DEVNULL)


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """Folder with everything."""
    folder = tmp_path_factory.mktemp("readers")
    run(folder, "sample", "-o", "film.mp4", "--frames", "200")
    run(folder, "analyze", "film.mp4", "-o", "library", "--view", "top")
    run(folder, "flock", "library", "-o", "flock.jpg", "--ground-truth", "truth", "--preset", "swarm", "--count", str(COUNT),
        "--frames", str(N_FRAMES))
    wishes = ["library", "--flocks", "3", "--pictures", "8", "--every", "4", "--count", "3", "9"]
    run(folder, "dataset", *wishes, "--formats", "coco,yolo_pose,dlc,tracks", "-o", "pose")
    run(folder, "dataset", *wishes, "--formats", "coco,yolo_segment", "-o", "segment")
    return folder
