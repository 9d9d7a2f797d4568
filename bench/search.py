#!/usr/bin/env python3
"""`search: window` against `search: full`: the same poses, byte for byte, on every film.

    bench/search.py PROGRAM FILM_OR_FOLDER...

Analyses each film both ways and compares poses.json (and poses.csv) but for the parameter itself. Films that are
refused must be refused both ways. Ends with 1 when any differ.
"""
import pathlib
import subprocess
import sys
import tempfile

KINDS = {".mp4", ".webm", ".mkv", ".avi", ".mov"}


def main():
    program, *places = sys.argv[1:]
    films = [film for place in map(pathlib.Path, places) for film in (sorted(place.iterdir()) if place.is_dir() else [place])]
    films = [film for film in films if film.suffix in KINDS]
    verdicts = [compare(program, film) for film in films]
    return 0 if films and all(verdicts) else 1


def compare(program, film):
    with tempfile.TemporaryDirectory() as folder:
        window, full = (analyze(program, film, pathlib.Path(folder) / way, way) for way in ("window", "full"))
    equal = window == full
    refused = "" if window[0] else f" (refused: {window[1].decode().strip().splitlines()[-1]})"
    print(f"{film.name:34} {'equal' if equal else 'DIFFERENT'}{refused}", flush=True)
    return equal


def analyze(program, film, library, way):
    done = subprocess.run([program, "analyze", str(film), "-o", str(library), "--set", f"search={way}"], capture_output=True)
    if done.returncode:
        return False, done.stderr
    poses = (library / "poses.json").read_bytes()
    return True, poses.replace(b'"search":"full"', b'"search":"window"'), (library / "poses.csv").read_bytes()


if __name__ == "__main__":
    sys.exit(main())
