#!/usr/bin/env python3
"""Writes docs/measurements.md from the figures in bench/results.

    bench/measurements.py

A script that measures stores its figures with `save`, which also writes the page. The figures of accuracy.py,
flocks.py and ablation.py are raw, and these scripts have a function that renders them. All other results are
a table: `title`, `about` (text of the section), `command` (repeats the measurement), `head` and `rows` (cells).
Requires numpy and cv2, because the imported scripts do.
"""
import json, pathlib, re, textwrap

import ablation, accuracy, flocks
from table import table

HERE = pathlib.Path(__file__).resolve().parent
RESULTS = HERE / "results"
PAGE = HERE.parent / "docs" / "measurements.md"
INTRO = """\
# Measurements

`bench/measurements.py` writes this page from the figures in `bench/results`. To change it, repeat a measurement.
The column *bar* has the target of a figure, and a `*` marks a figure that misses it. BL is the length of the animal in
the picture. p50, p95 and p99 are percentiles.

`make measure GENERATOR=goldfish.py FOOTAGE=folder` repeats all sections but the speed of plans, boids,
films and distances. `GENERATOR` is a program that draws films with known poses of the
animal (the truth); `bench/accuracy.py` describes its interface. `FOOTAGE` is the folder of the recordings that
`bench/labels` names. Neither is part of the repository."""


def section(result):
    """Returns the lines of a section with one table."""
    return [f"## {result['title']}", "", result["about"], "", f"Repeat: `{result['command']}`", "", *table(result["head"], result["rows"])]


# Sections in the order of the page.
SECTIONS = {"accuracy": accuracy.page, "flocks": flocks.page, "papers": section, "fish": section, "ablation": ablation.page, "speed": section,
            "transitions": section, "swift": section, "service": section, "hostile": section, "page": section, "soak": section, "rebuild": section, "count": section}


def save(name, result):
    """Writes the figures of a script and the page."""
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"{name}.json").write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n")
    write()


def write():
    files = {name: RESULTS / f"{name}.json" for name in SECTIONS}
    sections = ["\n".join(SECTIONS[name](json.loads(file.read_text()))) for name, file in files.items() if file.exists()]
    # The documents have a space before a percent sign, and short lines except in tables.
    text = re.sub(r"(?<=\d)%", " %", "\n\n".join([INTRO, *sections]))
    lines = [line if line.startswith("|") else textwrap.fill(line, 120, break_on_hyphens=False) for line in text.splitlines()]
    PAGE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    write()
