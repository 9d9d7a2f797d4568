"""Replays a service's calls without what was not synced (docs/explanation/promises.md, "Durable answers").

The model of the disk is the strictest that POSIX permits. A file has the content of its last sync, a folder the
entries of its last sync, and a name that no sync of its folder has written does not exist. Writes to the
database after its last sync may be on the disk in any selection, and the selection is drawn by a seed.

    power_loss.py PROGRAM [--points 50] [--seed 1]
"""

import argparse
import random
import sqlite3
import struct
import subprocess
import sys
import tempfile
from pathlib import Path
from uuid import UUID

from scenario import Client, Service, compile_steps, make_film

HEADER = struct.Struct("=qQqII8s")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--points", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program = options.program.resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder).resolve()
        records, facts, root = recorded(program, folder)
        points = chosen_points(records, facts, options)
        faults = [fault for point in points for fault in faults_after(program, folder, records[:point], facts, root, options.seed)]
    for fault in faults:
        print(fault)
    print(f"power loss at {len(points)} of {len(records)} records, {len(facts)} facts: {len(faults)} faults")
    return 1 if faults else 0


def recorded(program, folder):
    """Runs the story under the recording library. Returns its records, its facts and the inode of the data."""
    library, film, data = compile_steps(folder), make_film(program, folder), folder / "data"
    data.mkdir()
    log = folder / "log"
    with Service(program, data, library, CRASH_LOG=str(log)) as service:
        assert service.is_ready()
        client = Client(service, film)
        client.run()
    kinds = sorted(fact.kind for fact in client.facts)
    assert kinds == ["done", "done", "film", "film", "gone", "job", "job"], kinds
    return list(records_of(log.read_bytes())), client.facts, data.stat().st_ino


def records_of(log):
    """Yields (time in ns, kind, inode, offset, path, data)."""
    at = 0
    while at < len(log):
        time_ns, inode, offset, path_bytes, data_bytes, kind = HEADER.unpack_from(log, at)
        at += HEADER.size
        path, data = log[at : at + path_bytes], log[at + path_bytes : at + path_bytes + data_bytes]
        at += path_bytes + data_bytes
        yield time_ns, kind.rstrip(b"\0").decode(), inode, offset, path.decode(), data


def chosen_points(records, facts, options):
    """Points in random places, and one just after each answer."""
    times = [record[0] for record in records]
    answered = {sum(time <= fact.time_ns for time in times) for fact in facts}
    others = [point for point in range(1, len(records) + 1) if point not in answered]
    n_others = max(0, min(len(others), options.points - len(answered)))
    return sorted(answered | set(random.Random(options.seed).sample(others, n_others)))


def faults_after(program, folder, records, facts, root, seed):
    """Loses the power after these records and opens what is left."""
    chance = random.Random(seed + len(records))
    files, folders = disk_after(records, chance)
    place = folder / f"after-{len(records)}"
    write_folder(place, root, files, folders)
    time_ns = records[-1][0]
    known = [fact for fact in facts if fact.time_ns <= time_ns and (fact.until_ns is None or time_ns < fact.until_ns)]
    if not (place / "flockreel.db").exists():
        return [f"record {len(records)}: no database for {fact.kind} {fact.id}" for fact in known]
    done = subprocess.run([program, "check", "--data", place], capture_output=True, text=True, check=False)
    faults = [] if done.returncode == 0 else done.stderr.splitlines()
    if not faults:
        faults = missing(place / "flockreel.db", known)
    subprocess.run(["rm", "-r", place], check=True)
    return [f"record {len(records)}: {fault}" for fault in faults]


def disk_after(records, chance):
    """Returns the content of each file and the entries of each folder, by inode."""
    files, folders, unsynced = {}, {}, {}
    for _, kind, inode, offset, _, data in records:
        if kind == "file":
            files[inode] = data
            unsynced[inode] = []
        elif kind == "folder":
            entries = (line.split(" ", 2) for line in data.decode().splitlines())
            folders[inode] = [(name, int(entry), is_folder == "1") for entry, is_folder, name in entries]
        else:
            unsynced.setdefault(inode, []).append((kind, offset, data))
    for inode, writes in unsynced.items():
        content = bytearray(files.get(inode, b""))
        for kind, offset, data in writes:
            if chance.random() < 0.5:
                apply(content, kind, offset, data)
        files[inode] = bytes(content)
    return files, folders


def apply(content, kind, offset, data):
    if kind == "cut":
        del content[offset:]
        content.extend(bytes(offset - len(content)))
        return
    content.extend(bytes(max(0, offset - len(content))))
    content[offset : offset + len(data)] = data


def write_folder(place, inode, files, folders):
    place.mkdir()
    for name, entry, is_folder in folders.get(inode, []):
        if is_folder:
            write_folder(place / name, entry, files, folders)
        else:
            (place / name).write_bytes(files.get(entry, b""))


def missing(database, facts):
    """Returns the facts that the database does not hold."""
    connection = sqlite3.connect(database)
    films = {str(UUID(bytes=row[0])) for row in connection.execute("select id from footage")}
    jobs = {str(UUID(bytes=name)): state for name, state in connection.execute("select id, state from jobs")}
    connection.close()
    holds = {
        "film": lambda name: name in films,
        "gone": lambda name: name not in films,
        "job": lambda name: name in jobs,
        "done": lambda name: jobs.get(name) == "done",
    }
    return [f"lost after its answer: {fact.kind} {fact.id}" for fact in facts if not holds[fact.kind](fact.id)]


if __name__ == "__main__":
    sys.exit(main())
