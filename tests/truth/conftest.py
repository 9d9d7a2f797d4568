"""Fixtures: a film of the virtual fish, its library, and a flock with ground truth, made by flockreel."""
import json
import os
import pathlib
import subprocess

import pytest

N_FRAMES = 60
COUNT = 12


@pytest.fixture(scope="session")
def truth(tmp_path_factory):
    """Folder written by `flockreel flock --ground-truth`, next to flock.json and flock.mp4."""
    program = pathlib.Path(os.environ["FLOCKREEL_PROGRAM"]).resolve()
    folder = tmp_path_factory.mktemp("truth")

    def run(*words):
        subprocess.run([program, *words], cwd=folder, check=True, stderr=subprocess.DEVNULL)

    run("sample", "-o", "film.mp4", "--frames", "300")
    run("analyze", "film.mp4", "-o", "library")
    run("flock", "library", "-o", "flock.mp4", "--plan", "flock.json", "--ground-truth", "truth", "--preset", "swarm",
        "--count", str(COUNT), "--frames", str(N_FRAMES))
    return folder / "truth"


@pytest.fixture(scope="session")
def flock(truth):
    return json.loads((truth.parent / "flock.json").read_text())
