#!/usr/bin/env python3
"""Sends every film of a folder through the service: upload, analysis, flock of 20 x 400.

    bench/footage.py FOLDER [--program target/release/flockreel] [--out target/footage]

Prints a line for each film and keeps its flock and poses in the output folder for inspection. A film may be
refused, and the code is printed. Exits with an error if a job does not end within 600 s.
"""
import argparse, json, pathlib, subprocess, sys, tempfile, time
import urllib.error, urllib.request

ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
ap.add_argument("folder", type=pathlib.Path)
ap.add_argument("--program", default="target/release/flockreel")
ap.add_argument("--out", type=pathlib.Path, default=pathlib.Path("target/footage"))
ap.add_argument("--port", type=int, default=8099)
args = ap.parse_args()
AT = f"http://127.0.0.1:{args.port}"
KINDS = {".mp4", ".webm", ".mkv", ".avi", ".mov"}


def call(path, body=None, content_type="application/json", raw=False):
    request = urllib.request.Request(AT + path, data=body, headers={"Content-Type": content_type} if body else {})
    try:
        with urllib.request.urlopen(request, timeout=600) as answer:
            return answer.read() if raw else json.load(answer)
    except urllib.error.HTTPError as error:
        return json.load(error)


def follow(job):
    began = time.time()
    while time.time() - began < 600:
        state = call(f"/v1/jobs/{job}")
        if state["state"] in ("done", "failed", "cancelled"):
            return state, time.time() - began
        time.sleep(.2)
    sys.exit(f"job {job} hangs")


def one(path):
    footage = call(f"/v1/footage?name={path.name}", path.read_bytes(), "application/octet-stream")
    if "id" not in footage:
        return f"refused at upload: {footage['code']}"
    analysis = call("/v1/analyses", json.dumps({"footage_id": footage["id"]}).encode())
    state, analysis_s = follow(analysis["job_id"])
    if state["state"] != "done":
        return f"refused: {state['error']['code']} after {analysis_s:.1f} s"
    library = analysis["library_id"]
    summary = call(f"/v1/libraries/{library}")
    flock = call("/v1/flocks", json.dumps({"library_id": library, "count": 20, "frames": 400, "seed": 1}).encode())
    state, flock_s = follow(flock["job_id"])
    if state["state"] != "done":
        return f"no flock: {state['error']['code']}"
    stem = args.out / path.stem
    stem.with_suffix(".flock.mp4").write_bytes(call(f"/v1/flocks/{flock['flock_id']}/video.mp4", raw=True))
    stem.with_suffix(".flock.json").write_bytes(call(f"/v1/flocks/{flock['flock_id']}/flock.json", raw=True))
    stem.with_suffix(".poses.json").write_bytes(call(f"/v1/libraries/{library}/poses.json", raw=True))
    return (f"{summary['view']}, found in {summary['detected_share']:.1%}, {summary['n_transitions']} transitions, "
            f"component {summary['component_share']:.0%}, analysis {analysis_s:.1f} s, flock {flock_s:.1f} s")


args.out.mkdir(parents=True, exist_ok=True)
with tempfile.TemporaryDirectory() as data:
    server = subprocess.Popen([args.program, "serve", "--no-sample", "--bind", f"127.0.0.1:{args.port}", "--data", data],
                              stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    try:
        for _ in range(100):
            try:
                call("/healthz", raw=True)
                break
            except OSError:
                time.sleep(.1)
        for path in sorted(p for p in args.folder.iterdir() if p.suffix in KINDS):
            print(f"{path.name:32} {one(path)}", flush=True)
    finally:
        server.terminate()
        server.wait(30)
