"""Counts the source: lines, constants and imports of each module (docs/measurements.md).

    count.py [--write]     --write: also into docs/measurements.md

Lines of code are those of the program, without tests, comments and empty lines. A numeric constant is a `const` of a
number. An import is upward if a file names an item of the `mod.rs` of a folder around it.
A circle is a set of files that use each other, directly or through others.
"""

import re
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CRATES = {"flockreel_core": ROOT / "crates/flockreel-core/src", "flockreel": ROOT / "src"}
NUMBER = r"(?:[iu](?:8|16|32|64|128|size)|f(?:32|64))"
CONSTANT = re.compile(rf"\bconst [A-Z][A-Z0-9_]*: {NUMBER} =")
COLUMNS = ("code", "tests", "constants", "upward")


def main():
    head, rows, n_circles = table()
    for row in [head, *rows]:
        print(f"{row[0]:34}" + "".join(f"{cell:>12}" for cell in row[1:]))
    for circle in circles():
        print("circle:", ", ".join(circle))
    if "--write" in sys.argv:
        from measurements import save

        about = __doc__.split("\n\n")[2].replace("\n", " ") + f" There are {n_circles} circles."
        save("count", {"title": "Size of the source", "about": about, "command": "make count WRITE=1", "head": head, "rows": rows})


def table():
    """Returns the head and the rows of the table, and the number of circles."""
    counts = modules()
    counts["all modules"] = {name: sum(module[name] for module in counts.values()) for name in COLUMNS}
    rows = [[name, *(f"{module[column]}" for column in COLUMNS)] for name, module in counts.items()]
    rows.append(["page (`static/`)", f"{lines_below('static', '.js', '.css', '.html')}", "", "", ""])
    rows.append(["tests outside the modules", "", f"{lines_below('tests', '.rs', '.py', '.mjs', '.c')}", "", ""])
    return ["module", "code", "tests", "constants", "upward"], rows, len(circles())


def modules():
    """Returns the counts of every top-level module, and of the folders of the algorithms."""
    found = defaultdict(lambda: dict.fromkeys(COLUMNS, 0))
    for file in FILES.values():
        counts = found[file.module]
        counts["code"] += 0 if file.is_test else len(file.code)
        counts["tests"] += file.n_tests
        counts["constants"] += sum(bool(CONSTANT.search(line)) for line in file.code)
        counts["upward"] += len(file.upward)
    return dict(sorted(found.items()))


def lines_below(folder, *endings):
    files = (path for path in (ROOT / folder).rglob("*") if path.suffix in endings)
    return sum(sum(bool(line.strip()) for line in path.read_text().splitlines()) for path in files)


class File:
    """A Rust file: its lines of code, and the files that it uses."""

    def __init__(self, crate, path):
        parts = path.relative_to(CRATES[crate]).with_suffix("").parts
        self.is_mod = parts[-1] in ("mod", "lib", "main")
        self.path = (crate, *(parts[:-1] if self.is_mod else parts))
        self.is_test = "tests" in parts
        self.module = "/".join(parts[:1]) + (".rs" if len(parts) == 1 else "")
        self.name = str(path.relative_to(ROOT))
        lines = path.read_text().splitlines()
        begin = next((at for at, line in enumerate(lines) if line == "#[cfg(test)]" and lines[at + 1].endswith("{")), len(lines))
        code = list(without_comments(lines))
        tests = [line for at, line in code if self.is_test or at >= begin]
        self.n_tests = len(tests)
        self.code = [] if self.is_test else [line for at, line in code if at < begin]
        self.uses, self.upward = set(), set()

    def link(self):
        """Finds the files whose items this file names."""
        for path in paths_in("\n".join(self.code), self.path):
            target = resolved(path)
            if target and target is not self:
                self.uses.add(target.name)
                if target.is_mod and self.path[: len(target.path)] == target.path:
                    self.upward.add(target.name)


def without_comments(lines):
    """Yields the number and the text of every line that has more than a comment."""
    for at, line in enumerate(lines):
        text = re.sub(r"//.*", "", line) if '"' not in line else line
        if text.strip() and not text.strip().startswith("//"):
            yield at, text


def paths_in(code, place):
    """Yields the absolute path of every item that the code names by `crate::`, `super::` or `flockreel_core::`."""
    for used in re.findall(r"\b((?:crate|self|super|flockreel_core)(?:::(?:super|[a-zA-Z_]\w*|\{[^;]*?\}(?=;)))+)", code):
        for path in spread(used):
            names = path.split("::")
            # `super` of a file is the module around it.
            base = list(place)
            if names[0] in ("crate", "flockreel_core"):
                base = [place[0] if names[0] == "crate" else names[0]]
                names = names[1:]
            while names and names[0] in ("self", "super"):
                base = base[:-1] if names[0] == "super" else base
                names = names[1:]
            yield tuple(base) + tuple(names)


def spread(path):
    """Returns the single paths of a path that may end in braces."""
    head, brace, rest = path.partition("::{")
    if not brace:
        return [head]
    parts, depth, part = [], 0, ""
    for char in rest.strip()[:-1] + ",":
        depth += (char == "{") - (char == "}")
        if char == "," and depth == 0:
            parts.append(part.strip())
            part = ""
        else:
            part += char
    return [single for part in parts if part for single in spread(f"{head}::{part}") if not part.startswith("self")] or [head]


def resolved(path):
    """Returns the file that defines an item: of the longest known module, through its own `use` of the item."""
    for n in range(len(path), 0, -1):
        file = MODULES.get(path[:n])
        if file and n < len(path):
            return REEXPORTS.get((file.name, path[n]), file)
        if file:
            return file if not file.is_mod or len(file.path) == 1 else None
    return None


def circles():
    """Returns the sets of files that use each other (Tarjan's strongly connected components)."""
    number, low, stack, found = {}, {}, [], []

    def visit(name):
        number[name] = low[name] = len(number)
        stack.append(name)
        for other in sorted(FILES[name].uses):
            if other not in number:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], number[other])
        if low[name] == number[name]:
            at = stack.index(name)
            found.append(sorted(stack[at:]))
            del stack[at:]

    for name in sorted(FILES):
        if name not in number:
            visit(name)
    return sorted(circle for circle in found if len(circle) > 1)


def reexports():
    """Maps a `mod.rs` and a name that it takes from a module below to the file of that module."""
    found = {}
    for file in FILES.values():
        if not file.is_mod:
            continue
        for used in re.findall(r"\buse ((?:self::|super::|crate::)?[a-z_]\w*(?:::[^;]*)?);", "\n".join(file.code)):
            for path in spread(used.replace("\n", " ")):
                names = path.replace(" ", "").split("::")
                below = next((MODULES[file.path + tuple(names[:n])] for n in range(len(names) - 1, 0, -1) if file.path + tuple(names[:n]) in MODULES), None)
                if below:
                    found[(file.name, names[-1])] = below
    return found


sys.setrecursionlimit(10_000)
FILES = {file.name: file for file in (File(crate, path) for crate, root in CRATES.items() for path in sorted(root.rglob("*.rs")))}
MODULES = {file.path: file for file in FILES.values()}
REEXPORTS = reexports()
for each in FILES.values():
    each.link()

if __name__ == "__main__":
    main()
