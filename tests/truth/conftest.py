"""Fixtures: a film of the virtual fish, its library, and a flock with ground truth, made by flockreel."""
import json
import os
import pathlib
import subprocess

import pytest

N_FRAMES = 60
COUNT = 12


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """Folder with a library of the virtual fish."""
    folder = tmp_path_factory.mktemp("truth")
    run(folder, "sample", "-o", "film.mp4", "--frames", "300")
    run(folder, "analyze", "film.mp4", "-o", "library")
    return folder


@pytest.fixture(scope="session")
def truth(folder):
    """Folder written by `flockreel flock --ground-truth`, next to flock.json and flock.mp4."""
    run(folder, "flock", "library", "-o", "flock.mp4", "--plan", "flock.json", "--ground-truth", "truth", "--preset", "swarm",
        "--count", str(COUNT), "--frames", str(N_FRAMES))
    return folder / "truth"


def run(folder, *words):
    """Runs flockreel in a folder."""
    program = pathlib.Path(os.environ["FLOCKREEL_PROGRAM"]).resolve()
    subprocess.run([program, *words], cwd=folder, check=True, stderr=subprocess.DEVNULL)


@pytest.fixture(scope="session")
def flock(truth):
    return json.loads((truth.parent / "flock.json").read_text())
