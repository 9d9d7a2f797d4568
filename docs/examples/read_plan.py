"""Prints the number of individuals of a plan, and writes x and y of every frame as CSV.

    python read_plan.py flock.plan > tracks.csv

docs/reference/formats.md describes the file. Only the standard library is needed.
"""

import csv
import json
import struct
import sys

CODES = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i"}


def read_plan(path):
    """Returns the head, and the columns as lists of numbers by name."""
    with open(path, "rb") as file:
        data = file.read()
    magic, version, n_head = struct.unpack_from("<8sII", data)
    if magic != b"FLOCKPLN" or version != 1:
        raise ValueError(f"{path} is not a plan of version 1")
    head = json.loads(data[16 : 16 + n_head])
    columns = {}
    for column in head["columns"]:
        form = f"<{column['n']}{CODES[column['type']]}"
        stored = struct.unpack_from(form, data, 16 + n_head + column["at"])
        columns[column["name"]] = [value * column["scale"] for value in stored]
    return head, columns


if __name__ == "__main__":
    head, columns = read_plan(sys.argv[1])
    n_frames = head["n_frames"]
    print(f"{head['n_individuals']} individuals, {n_frames} frames", file=sys.stderr)
    out = csv.writer(sys.stdout)
    out.writerow(["frame", "id", "x_px", "y_px"])
    for frame in range(n_frames):
        for index, individual in enumerate(head["individuals"]):
            cell = index * n_frames + frame
            out.writerow([frame, individual["id"], round(columns["x"][cell], 2), round(columns["y"][cell], 2)])
